"""The bytes of a C3D file to be written: Intel order, float points, no analog channels.

Written here rather than by a library because of what other programs need to see: counts beyond 65535 frames, and
residual words that all of them take alike for measured, computed and lost.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

from markerscope.solver.io.c3d_parameters import BLOCK, DEC, from_floats

Value = tuple[str, ...] | np.ndarray
"""Text, or numbers: integers are written as 16 bits, others as floats."""
MOST_PER_PARAMETER = 255
MEASURED_WORD = 0x0101
"""Camera byte and residual byte both set, since programs disagree on which is which."""
_SHORT = 65535


def encode_c3d(
    groups: Mapping[str, Mapping[str, Value]], words: np.ndarray, first: int, rate: float, residual_unit: float
) -> bytes:
    """A whole file.

    Parameters
    ----------
    groups : parameters by group and name; the counts and the scale are added here
    words : (T, M, 4) x, y, z in the file's unit and the residual word (-1 lost, 0 computed, else measured)
    first : number of the first frame, from 1
    rate : Hz
    residual_unit : what the residual word counts, file units

    Raises
    ------
    ValueError : the parameters do not fit a C3D
    """
    frames, count = words.shape[:2]
    last = first + frames - 1
    point: dict[str, Value] = {
        "USED": np.array([count]),
        "FRAMES": np.array([min(frames, _SHORT)]),
        "LONG_FRAMES": np.array([float(frames)]),
        "SCALE": np.array([-residual_unit]),
        "RATE": np.array([rate]),
        "DATA_START": np.array([0]),
        **groups.get("POINT", {}),
    }
    trial = {"ACTUAL_START_FIELD": _long(first), "ACTUAL_END_FIELD": _long(last)}
    every: dict[str, Mapping[str, Value]] = {**groups, "POINT": point, "TRIAL": trial}
    data_block = 2 + len(_section(every)) // BLOCK
    point["DATA_START"] = np.array([data_block])
    section = _section(every)
    if last > _SHORT:  # the 16 bits of the header cannot say it; TRIAL does
        first, last = 1, min(frames, _SHORT)
    header = struct.pack("<2B5HfHHf", 2, 0x50, count, 0, first, last, 0, -residual_unit, data_block, 1, rate)
    data = np.ascontiguousarray(words, dtype="<f4").tobytes()
    return b"".join([header.ljust(BLOCK, b"\0"), section, data, b"\0" * (-len(data) % BLOCK)])


def _long(number: int) -> np.ndarray:
    """A 32-bit count as two 16-bit words, low one first."""
    return np.array([number % 65536, number // 65536])


def _section(groups: Mapping[str, Mapping[str, Value]]) -> bytes:
    """The parameter section, padded to whole blocks."""
    records: list[bytes] = []
    for identity, (group, parameters) in enumerate(groups.items(), 1):
        records.append(_record(group, -identity, b"\0"))
        records += [_record(name, identity, _value(value) + b"\0") for name, value in parameters.items()]
    body = b"".join(records) + b"\0\0"
    blocks = -(-(4 + len(body)) // BLOCK)
    if blocks > 255:
        raise ValueError("the parameters take more than 255 blocks")
    return (bytes([1, 0x50, blocks, 84]) + body).ljust(blocks * BLOCK, b"\0")


def _record(name: str, identity: int, content: bytes) -> bytes:
    """One group or parameter with the link to the next."""
    link = len(content) + 2
    if link > 32767:
        raise ValueError(f"the parameter {name} is too large")
    return struct.pack("<bb", len(name), identity) + name.encode("ascii") + struct.pack("<H", link) + content


def parameter_content(value: Value, order: str, processor: int) -> bytes:
    """What stands behind a parameter's link, with an empty description, in the byte order of another file.

    Parameters
    ----------
    value : text, or numbers of up to two dimensions (the last one runs fastest)
    order, processor : as in the file's ``Section``
    """
    if isinstance(value, tuple):
        return _value(value) + b"\0"
    kind = 2 if np.issubdtype(value.dtype, np.integer) else 4
    shape = () if value.size == 1 else value.shape[::-1]
    raw = value.astype(order + "u2").tobytes() if kind == 2 else from_floats(value, order, processor == DEC)
    return struct.pack(f"<bB{len(shape)}B", kind, len(shape), *shape) + raw + b"\0"


def _value(value: Value) -> bytes:
    if isinstance(value, tuple):
        encoded = [text.encode("utf-8") for text in value]
        width = max(map(len, encoded), default=0) or 1
        return struct.pack("<bBBB", -1, 2, width, len(encoded)) + b"".join(text.ljust(width) for text in encoded)
    kind, dtype = (2, "<u2") if np.issubdtype(value.dtype, np.integer) else (4, "<f4")
    shape = struct.pack("<bB", kind, 0) if value.size == 1 else struct.pack("<bBB", kind, 1, value.size)
    return shape + value.astype(dtype).tobytes()
