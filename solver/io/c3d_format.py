"""The bytes of a C3D file: header, parameters, points.

Decoded here rather than by a library because every length in the file has to be checked against the file's own size
before it is believed: a truncated file must be refused, not filled with zeros, a damaged one must not crash or
exhaust memory, and trials beyond 65535 frames must keep all of them. The tests hold it against two libraries.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.errors import InputError

BLOCK = 512
_INTEL, _DEC, _MIPS = 84, 85, 86
_PARAMETER_TYPES = {-1: "S1", 1: "i1", 2: "i2", 4: "f4"}
_LIMIT = 65535


@dataclass(frozen=True)
class C3DContent:
    """A decoded file.

    Attributes
    ----------
    parameters : values by (GROUP, NAME); text as a tuple of str, numbers as a flat float array
    xyz : (T, M, 3) float64, file units
    lost : (T, M) True where the point was not seen
    computed : (T, M) True where neither a camera nor a residual stands behind the point
    first_frame : 1-based
    rate : Hz as the header says it
    notes : what was found odd, one sentence each
    """

    parameters: dict[tuple[str, str], tuple[str, ...] | np.ndarray]
    xyz: np.ndarray
    lost: np.ndarray
    computed: np.ndarray
    first_frame: int
    rate: float
    notes: tuple[str, ...] = ()

    def text(self, group: str, name: str) -> tuple[str, ...]:
        """Text of a parameter and of its continuations (``LABELS2``, ...), empty where absent."""
        found: list[str] = []
        for suffix in ("", *map(str, range(2, 1000))):
            value = self.parameters.get((group, name + suffix))
            if not isinstance(value, tuple):
                break
            found += value
        return tuple(found)

    def numbers(self, group: str, name: str) -> np.ndarray:
        """Numbers of a parameter, empty where absent."""
        value = self.parameters.get((group, name))
        return value if isinstance(value, np.ndarray) else np.zeros(0)


def looks_like_c3d(data: bytes) -> bool:
    """True where the file begins as C3D files do."""
    return len(data) >= 2 and data[1] == 0x50 and data[0] < 32


def decode_c3d(data: bytes, path: str | Path) -> C3DContent:
    """Decode a whole C3D file.

    Raises
    ------
    InputError : not a C3D, damaged, cut off, or without points
    """
    if not looks_like_c3d(data):
        raise InputError("is not a C3D file", path, "export it again or give the file its right extension")
    if len(data) < 2 * BLOCK:
        raise InputError("is cut off within the C3D header", path, "copy or export it again")
    start = (data[0] - 1) * BLOCK if data[0] else BLOCK
    section = data[start : start + 255 * BLOCK]
    if len(section) < 8:
        raise InputError("is cut off before the C3D parameters", path, "copy or export it again")
    processor = section[3]
    if processor not in (_INTEL, _DEC, _MIPS):
        raise InputError("is damaged: its C3D parameter section has no valid header", path, "export it again")
    order = ">" if processor == _MIPS else "<"
    parameters = _parameters(section, order, processor == _DEC, path)
    return _points(data, parameters, order, processor == _DEC, path)


def _floats(raw: bytes, order: str, dec: bool) -> np.ndarray:
    """32-bit floats; the VAX kind has its 16-bit halves swapped and an exponent that is 2 larger."""
    if not dec:
        return np.frombuffer(raw, order + "f4").astype(float)
    words = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1]
    return np.ascontiguousarray(words).view("<f4").ravel().astype(float) / 4


def _parameters(
    section: bytes, order: str, dec: bool, path: str | Path
) -> dict[tuple[str, str], tuple[str, ...] | np.ndarray]:
    groups: dict[int, str] = {}
    found: list[tuple[int, str, tuple[str, ...] | np.ndarray]] = []
    at = 4
    while at + 2 <= len(section):
        length, identity = struct.unpack_from("bb", section, at)
        length = abs(length)
        if length == 0 or identity == 0:
            break
        link = at + 2 + length
        if link + 2 > len(section):
            raise InputError("is cut off within the C3D parameters", path, "copy or export it again")
        name = _clean(section[at + 2 : link]).upper()
        (offset,) = struct.unpack_from(order + "H", section, link)
        if identity < 0:
            groups[-identity] = name
        else:
            found.append((identity, name, _parameter(section, link + 2, order, dec, path)))
        if offset == 0:
            break
        if offset < 2:
            raise InputError("is damaged: its C3D parameters run in a circle", path, "export it again")
        at = link + offset
    return {(groups.get(identity, "?"), name): value for identity, name, value in found}


def _parameter(section: bytes, at: int, order: str, dec: bool, path: str | Path) -> tuple[str, ...] | np.ndarray:
    kind, rank = struct.unpack_from("bB", section, at) if at + 2 <= len(section) else (0, 0)
    shape = tuple(section[at + 2 : at + 2 + rank])
    dtype = _PARAMETER_TYPES.get(kind)
    count = int(np.prod(shape, dtype=np.int64)) if rank <= 7 else -1
    begin = at + 2 + rank
    size = count * (1 if dtype is None else np.dtype(dtype).itemsize)
    if dtype is None or count < 0 or len(shape) < rank or begin + size > len(section):
        raise InputError("is damaged: a C3D parameter does not fit its section", path, "copy or export it again")
    raw = section[begin : begin + size]
    if kind == -1:
        width = shape[0] if rank else 1
        return tuple(_clean(raw[i : i + width]) for i in range(0, size, width)) if width else ()
    if kind == 4:
        return _floats(raw, order, dec)
    return np.frombuffer(raw, (order if kind == 2 else "") + dtype).astype(float)


def _clean(raw: bytes) -> str:
    raw = raw.split(b"\0")[0]
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()


def _points(
    data: bytes,
    parameters: dict[tuple[str, str], tuple[str, ...] | np.ndarray],
    order: str,
    dec: bool,
    path: str | Path,
) -> C3DContent:
    count, analog, first, last, _gap = struct.unpack_from(order + "5H", data, 2)
    scale = float(_floats(data[12:16], order, dec)[0])
    (block,) = struct.unpack_from(order + "H", data, 16)
    rate = float(_floats(data[20:24], order, dec)[0])
    whole = C3DContent(parameters, np.zeros((0, 0, 3)), np.zeros((0, 0), bool), np.zeros((0, 0), bool), first, rate)
    notes: tuple[str, ...] = ()
    if count == 0:
        raise InputError("is a C3D without points", path, "export it with its marker trajectories")
    if not np.isfinite(scale) or scale == 0:
        raise InputError("is damaged: its C3D scale is not a number", path, "export it again")
    begin = (block - 1) * BLOCK
    item = 4 if scale < 0 else 2
    stride = (4 * count + analog) * item
    room = max(0, len(data) - begin) // stride if block >= 2 else 0
    frames, first, odd = _frame_range(whole, first, last, room)
    if odd:
        notes += ("The C3D header and parameters disagree on the number of frames.",)
    if frames > room or frames == 0:
        raise InputError(
            f"is cut off after frame {room} of {frames}" if room else "is cut off before the first frame",
            path,
            "copy or export it again",
        )
    raw = np.frombuffer(data, np.uint8, frames * stride, begin).reshape(frames, stride)[:, : 16 * count * item // 4]
    values, word = _decode_points(np.ascontiguousarray(raw), count, scale, order, dec)
    # Programs disagree on which byte of the word is the residual and which the cameras, but not on signs and zeros.
    return C3DContent(parameters, values, ~(word >= 0), word == 0, first, rate, notes)


def _decode_points(raw: np.ndarray, count: int, scale: float, order: str, dec: bool) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (T, M, 3) in file units and the residual word (T, M), from the points' bytes (T, bytes)."""
    to_floats: Callable[[bytes], np.ndarray] = (
        (lambda b: _floats(b, order, dec)) if scale < 0 else (lambda b: np.frombuffer(b, order + "i2").astype(float))
    )
    words = to_floats(raw.tobytes()).reshape(len(raw), count, 4)
    return words[..., :3] * (1.0 if scale < 0 else scale), words[..., 3]


def _frame_range(content: C3DContent, first: int, last: int, room: int) -> tuple[int, int, bool]:
    """Number of frames, number of the first one, and whether the file contradicts itself.

    Counts of 16 bits end at 65535; longer trials say theirs in TRIAL or POINT:LONG_FRAMES, which stale editors
    leave as they were, so that the short counts are believed where they agree.
    """
    header = last - first + 1
    point = content.numbers("POINT", "FRAMES")[:1]
    frames = int(point[0]) % 65536 if point.size and np.isfinite(point[0]) else header
    start, stop = (_long_count(content.numbers("TRIAL", f"ACTUAL_{end}_FIELD")) for end in ("START", "END"))
    trial = stop - start + 1 if start >= 1 and stop >= start else 0
    if header == frames and 0 < header < _LIMIT:
        return header, start if trial == header else max(first, 1), False
    many = content.numbers("POINT", "LONG_FRAMES")[:1]
    claims = [trial, int(many[0]) if many.size and 0 < many[0] < 2**31 else 0, frames, header]
    claims = [n for n in claims if n > 0]
    if not claims:
        return 0, 1, False
    if max(claims) == _LIMIT < room:
        claims = [room]  # a writer that knew no way to say more: the size of the file is all there is to go by
    count = next((n for n in claims if n <= room), min(claims))
    return count, start if trial == count else max(first, 1), len({n for n in claims if n < _LIMIT}) > 1


def _long_count(words: np.ndarray) -> int:
    """32-bit count kept as two 16-bit words, low one first; 0 where absent."""
    if words.size < 2 or not np.isfinite(words[:2]).all():
        return 0
    return int(words[0]) % 65536 + 65536 * (int(words[1]) % 65536)
