"""Markers written back into the C3D they came from: all that is no marker stays byte for byte."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.atomic import write_bytes_atomic
from markerscope.solver.io.c3d import read_c3d
from markerscope.solver.io.c3d_encode import MEASURED_WORD
from markerscope.solver.io.c3d_format import C3DContent, decode_c3d
from markerscope.solver.io.c3d_layout import Layout, point_words, trial_range
from markerscope.solver.io.c3d_parameters import (
    BLOCK,
    DEC,
    Section,
    from_floats,
    section_bytes,
    with_numbers,
    with_texts,
)
from markerscope.solver.io.labels import unique
from markerscope.solver.io.markers_in import is_c3d, markers_of
from markerscope.solver.io.text import read_bytes
from markerscope.solver.io.units import metres_per_unit, settle_units

_LABEL_BYTES = 120
_SAME = 1e-5
"""Share of a metre within which a sample is as it was."""


@dataclass(frozen=True)
class Original:
    """The file that markers came from, and how it was read.

    Attributes
    ----------
    path : the file
    units, subject : as in ``load_markers``
    """

    path: Path
    units: str | None = None
    subject: str | None = None


@np.errstate(all="ignore")
def write_c3d_like(path: str | Path, markers: Markers, original: Original, labels: Sequence[str] | None = None) -> None:
    """Write trajectories into a copy of the C3D they were read from.

    Analog channels, force plates, events, further points and all parameters stay as they are. Samples that were not
    changed keep their bytes; filled ones get residual 0, those cut -1. Where the markers are a range of the file's
    frames, all that is stored by frame is cut to it.

    Parameters
    ----------
    path : file to write, whole or not at all
    markers : frames of that file, in its order of markers
    original : the file
    labels : M names for the file's points, None to leave them as they stand

    Raises
    ------
    InputError : the original cannot be read, or the file not be written
    ValueError : the original is no C3D, or cannot hold what is to be written; the message says which section
    """
    data = read_bytes(original.path)
    if not is_c3d(data, original.path):
        raise ValueError("it is no C3D")
    content = decode_c3d(data, original.path)
    own = markers_of(read_c3d(original.path, data), original.subject, original.path)
    factor, _ = settle_units(own.positions, own.units, original.units, str(original.path))
    assert own.points is not None
    rate = content.rate or markers.rate
    start = round(markers.first_time * markers.rate) - (content.first_frame - 1)
    frames = len(markers.positions)
    if len(own.points) != len(markers.labels) or start < 0 or start + frames > content.layout.frames or not rate:
        raise ValueError("its points: the markers are not those of the file any more")
    words = _points(content, data, own.points, markers, factor, start)
    if abs(markers.rate / rate - 1) > 1e-6:
        raise ValueError("its clock: another frame rate was asked for")
    head = _head(data, content, own.points, labels, start, frames, original.units)
    write_bytes_atomic(
        path, head + _data(data, content.layout, words, content, start) + _tail(data, content, start, frames)
    )


def _points(
    content: C3DContent, data: bytes, points: np.ndarray, markers: Markers, factor: float, start: int
) -> np.ndarray:
    """(T, N, 4) words of all the file's points, as they are stored."""
    layout, frames = content.layout, len(markers.positions)
    words = point_words(data, layout, content.section)[start : start + frames]
    scale = 1.0 if layout.floating else layout.scale
    wanted = markers.positions @ markers.R_lab_internal.T / factor
    seen = np.isfinite(wanted).all(axis=2)
    old, old_word = words[:, points, :3] * scale, words[:, points, 3]
    was = (old_word >= 0) & np.isfinite(old).all(axis=2) & (old != 0).any(axis=2)
    filled = np.zeros(seen.shape, dtype=bool) if markers.filled is None else markers.filled & seen
    near = seen & was & (np.abs(wanted - old).max(axis=2) <= max(_SAME / factor, scale if not layout.floating else 0))
    new_word = np.where(was & (old_word > 0), old_word, float(MEASURED_WORD))
    if not (was & (old_word > 0)).any():  # a file with residual 0 throughout, which would not tell what was filled
        new_word = np.where(was & ~filled.any(), old_word, float(MEASURED_WORD))
    new_word = np.where(filled & ~(near & (old_word == 0)), 0.0, new_word)
    changed = np.where(near[..., None], words[:, points, :3], np.where(seen[..., None], wanted / scale, 0.0))
    if not layout.floating and np.abs(changed).max(initial=0) > 32767:
        raise ValueError("its points: whole numbers of 16 bits cannot hold these places")
    kept = near & ~filled & (new_word == old_word) | ~seen & ~was
    own = np.concatenate([changed, np.where(seen, new_word, -1.0)[..., None]], axis=2)
    words[:, points] = np.where(kept[..., None], words[:, points], own)
    return words


def _data(data: bytes, layout: Layout, words: np.ndarray, content: C3DContent, start: int) -> bytes:
    """The data section: points as given, analog values as they were."""
    frames, section = len(words), content.section
    raw = np.frombuffer(data, np.uint8, frames * layout.stride, layout.begin + start * layout.stride)
    rows = raw.reshape(frames, layout.stride).copy()
    width = 4 * layout.count * (4 if layout.floating else 2)
    flat = words.reshape(frames, -1)
    if layout.floating:
        new = from_floats(flat, section.order, section.processor == DEC)
    else:
        new = np.round(flat).astype(np.int64).astype(section.order + "i2").tobytes()
    rows[:, :width] = np.frombuffer(new, np.uint8).reshape(frames, width)
    return rows.tobytes()


def _tail(data: bytes, content: C3DContent, start: int, frames: int) -> bytes:
    """What stands behind the points, filled up to a whole block."""
    layout = content.layout
    behind = data[layout.end :]
    if frames == layout.frames:
        return behind
    if len(behind.rstrip(b"\0")) >= BLOCK or content.section.count("ROTATION", "USED"):
        each, left = divmod(len(behind.rstrip(b"\0")) + 3, layout.frames)
        used = content.section.count("ROTATION", "USED") or 0
        if not used or each < 68 * used or left >= BLOCK:
            raise ValueError("what stands behind its points, of which no part can be cut out")
        behind = behind[start * 68 * used : (start + frames) * 68 * used]
    else:
        behind = b""
    return behind + b"\0" * (-(frames * layout.stride + len(behind)) % BLOCK)


def _head(
    data: bytes,
    content: C3DContent,
    points: np.ndarray,
    labels: Sequence[str] | None,
    start: int,
    frames: int,
    units: str | None,
) -> bytes:
    """Header and parameters up to the data."""
    section, layout = content.section, content.layout
    head = bytearray(data[: layout.begin])
    contents: dict[int, bytes] = {}
    _agree(head, contents, content, units)
    if frames != layout.frames:
        _cut_frames(head, contents, content, start, frames)
    if labels is not None:
        _rename(contents, content, points, labels)
    return bytes(head) if not contents else _moved(bytes(head), section, contents, layout)


def with_section(data: bytes, content: C3DContent, section: Section) -> bytes:
    """A whole file's bytes with another parameter section; points and analog values move behind it.

    Raises
    ------
    ValueError : it cannot be had, in words that follow "of this file could not be kept"
    """
    layout = content.layout
    return _moved(data[: layout.begin], section, {}, layout) + data[layout.begin :]


def _moved(start: bytes, section: Section, contents: dict[int, bytes], layout: Layout) -> bytes:
    """Header and parameters up to the data, the parameters written anew; where they take more room, the data move."""
    head, contents = bytearray(start), dict(contents)
    first = (section.block - 1) * BLOCK
    if first >= layout.begin:
        raise ValueError("its parameters, which stand behind the points")
    room = (layout.begin - first) // BLOCK
    new = section_bytes(section, start[first : first + 2], contents, room)
    moved = len(new) // BLOCK - room
    if moved:
        for name in (("POINT", "DATA_START"), ("ROTATION", "DATA_START")):
            record, value = section.record(*name), section.count(*name)
            if record is not None and value:
                at = section.records.index(record)
                contents[at] = with_numbers(record.content, np.array([value + moved]), section.order, False)
        new = section_bytes(section, start[first : first + 2], contents, room)
        struct.pack_into(section.order + "H", head, 16, layout.begin // BLOCK + 1 + moved)
    return bytes(head[:first]) + new


def _agree(head: bytearray, contents: dict[int, bytes], content: C3DContent, units: str | None) -> None:
    """Where header and parameters disagreed, both say what was read; the unit is the one that was asked for."""
    section, header, layout = content.section, content.header, content.layout
    order, dec = section.order, section.processor == DEC
    block = layout.begin // BLOCK + 1
    if (header.count, header.analog, header.block) != (layout.count, layout.analog, block):
        struct.pack_into(order + "2H", head, 2, layout.count, layout.analog)
        struct.pack_into(order + "H", head, 16, block)
    short = min(layout.frames, 65535)
    if header.last - header.first + 1 != short:
        struct.pack_into(
            order + "2H",
            head,
            6,
            min(content.first_frame, 65536 - short),
            min(content.first_frame, 65536 - short) + short - 1,
        )
    scale = section.number("POINT", "SCALE")
    if scale is not None and (
        (header.scale < 0) != layout.floating or (not layout.floating and header.scale != layout.scale)
    ):
        right = -abs(header.scale) if layout.floating else layout.scale
        head[12:16] = from_floats(np.array([right]), order, dec)
    said = {("POINT", "USED"): layout.count, ("POINT", "DATA_START"): block, ("POINT", "FRAMES"): short}
    for name, value in said.items():
        record = section.record(*name)
        if record is not None and section.count(*name) not in (None, value):
            contents[section.records.index(record)] = with_numbers(record.content, np.array([value]), order, dec)
    record = section.record("POINT", "SCALE")
    if record is not None and scale is not None and (scale < 0) != layout.floating:
        right = -abs(scale) if layout.floating else abs(scale)
        contents[section.records.index(record)] = with_numbers(record.content, np.array([right]), order, dec)
    declared, record = section.text("POINT", "UNITS"), section.record("POINT", "UNITS")
    if units and record is not None and declared and metres_per_unit(declared[0]) != metres_per_unit(units):
        contents[section.records.index(record)] = with_texts(record.content, (units,) * len(declared))


def _cut_frames(head: bytearray, contents: dict[int, bytes], content: C3DContent, start: int, frames: int) -> None:
    """The counts of frames in header and parameters."""
    section = content.section
    first = content.first_frame + start
    last = first + frames - 1
    short = (first, last) if last <= 65535 else (1, min(frames, 65535))
    struct.pack_into(section.order + "2H", head, 6, *short)
    said = {("POINT", "FRAMES"): [min(frames, 65535)], ("POINT", "LONG_FRAMES"): [frames]}
    if trial_range(section)[0]:
        said["TRIAL", "ACTUAL_START_FIELD"] = [first % 65536, first // 65536]
        said["TRIAL", "ACTUAL_END_FIELD"] = [last % 65536, last // 65536]
    for name, values in said.items():
        record = section.record(*name)
        if record is not None and len(section.numbers(*name)) == len(values):
            at = section.records.index(record)
            contents[at] = with_numbers(record.content, np.array(values), section.order, section.processor == DEC)


def _rename(contents: dict[int, bytes], content: C3DContent, points: np.ndarray, labels: Sequence[str]) -> None:
    """New names for some points, in POINT:LABELS and its continuations."""
    section = content.section
    names = list(section.text("POINT", "LABELS"))
    if len(names) < content.layout.count:
        raise ValueError("its names of points, of which it has too few")
    others = [name for i, name in enumerate(names) if i not in set(points.tolist())]
    for point, name in zip(points.tolist(), unique([*others, *labels], _LABEL_BYTES)[len(others) :], strict=True):
        names[point] = name
    at = 0
    for suffix in ("", *map(str, range(2, 1000))):
        record = section.record("POINT", f"LABELS{suffix}")
        if record is None or at >= len(names):
            break
        count = len(section.text_of("POINT", f"LABELS{suffix}"))
        contents[section.records.index(record)] = with_texts(record.content, tuple(names[at : at + count]))
        at += count


def kept_or_plain(
    path: Path, markers: Markers, original: Original | None, labels: Sequence[str] | None = None
) -> tuple[str, ...]:
    """Write a C3D like the one the markers came from, else a plain one; say what was not kept.

    Raises
    ------
    InputError : the file cannot be written
    """
    from markerscope.solver.io.export_c3d import write_c3d

    if original is not None:
        try:
            write_c3d_like(path, markers, original, labels)
            return ()
        except (ValueError, InputError) as error:
            if isinstance(error, InputError) and "cannot be written" in str(error):
                raise
            write_c3d(path, markers, labels=labels)
            if str(error) == "it is no C3D":
                return ()
            return (f"Markers alone were written to {path.name}; of {original.path.name} could not be kept {error}.",)
    write_c3d(path, markers, labels=labels)
    return ()
