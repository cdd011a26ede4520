"""Where a C3D file keeps its points: header and parameters say it both, and the size of the file tells who is right."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.c3d_parameters import BLOCK, DEC, Section, floats

_LIMIT = 65535
_SMOOTHER = 3.0
"""Of two readings that both fit the size, one must move this much more smoothly to be taken against the parameters."""


@dataclass(frozen=True)
class Header:
    """What the first block says.

    Attributes
    ----------
    count, analog : points, and analog words, in a frame
    first, last : numbers of frames, from 1
    scale : file units in one count of an integer point; negative where points are floats
    block : the first one of the data, from 1
    samples : analog samples in a frame
    rate : frames a second, Hz
    """

    count: int
    analog: int
    first: int
    last: int
    scale: float
    block: int
    samples: int
    rate: float


@dataclass(frozen=True)
class Layout:
    """One reading of the data section.

    Attributes
    ----------
    count, analog : points, and analog words, in a frame
    floating : whether words are floats, else integers of 16 bits
    scale : file units in one count, for integers
    begin : byte where the data begin
    frames : how many
    fit : how well that has the size of the section: 3 to the last byte but zeros, 2 but for less than a block,
        1 but for zeros, 0 where bytes are left, -1 where bytes are missing
    """

    count: int
    analog: int
    floating: bool
    scale: float
    begin: int
    frames: int
    fit: int = -1

    @property
    def stride(self) -> int:
        """Bytes of a frame."""
        return (4 * self.count + self.analog) * (4 if self.floating else 2)

    @property
    def end(self) -> int:
        """Byte behind the last frame."""
        return self.begin + self.frames * self.stride


def read_header(data: bytes, section: Section) -> Header:
    """The numbers of the first block."""
    dec = section.processor == DEC
    count, analog, first, last, _gap = struct.unpack_from(section.order + "5H", data, 2)
    block, samples = struct.unpack_from(section.order + "2H", data, 16)
    scale, rate = (float(floats(data[at : at + 4], section.order, dec)[0]) for at in (12, 20))
    return Header(count, analog, first, last, scale, block, samples, rate)


@np.errstate(all="ignore")
def find_layout(data: bytes, header: Header, section: Section, path: str | Path) -> tuple[Layout, tuple[str, ...]]:
    """The reading of header and parameters under which the data section has its size, and what they disagree on.

    Raises
    ------
    InputError : no reading fits, the file is cut off, or it has no points
    """
    claims = _claims(header, section)
    if max(claims.counts) == 0:
        raise InputError("is a C3D without points", path, "export it with its marker trajectories")
    if not claims.scales:
        raise InputError("is damaged: its C3D scale is not a number", path, "export it again")
    readings = [layout for candidate in claims.each() for layout in _with_frames(data, candidate, header, section)]
    disputed = claims.disputed()
    best = _best(data, readings, section)
    if best is None or (disputed and best.fit < 1):
        _refuse(data, claims, readings, disputed, path)
    assert best is not None
    return best, claims.notes(best, header, section, data)


@dataclass(frozen=True)
class _Claims:
    """What header and parameters say, the parameters' word first.

    Attributes
    ----------
    spare_block : the first behind the parameters, to be tried where header and parameters disagree or say nothing
    """

    counts: tuple[int, ...]
    analogs: tuple[int, ...]
    scales: tuple[float, ...]
    blocks: tuple[int, ...]
    spare_block: int | None

    def disputed(self) -> tuple[str, ...]:
        """On what they disagree, as far as it decides where a number stands."""
        signs = {scale < 0 for scale in self.scales}
        sides = {
            "the number of points": self.counts,
            "the analog channels": self.analogs,
            "whether points are whole numbers": tuple(signs),
            "where the data begin": self.blocks,
        }
        return tuple(name for name, said in sides.items() if len(said) > 1)

    def each(self) -> Iterator[Layout]:
        blocks = dict.fromkeys([*self.blocks, self.spare_block])
        for block, count, analog, scale in product(blocks, self.counts, self.analogs, self.scales):
            if count and block is not None and block >= 2:
                yield Layout(count, analog, scale < 0, scale, (block - 1) * BLOCK, 0)

    def notes(self, taken: Layout, header: Header, section: Section, data: bytes) -> tuple[str, ...]:
        """What they disagreed on, and what was taken."""
        found: list[tuple[str, object, object, str]] = []
        by_size = "the size of the file says {}"
        if len(self.counts) > 1:
            found.append(("number of points", header.count, self.counts[0], by_size.format(taken.count)))
        if len(self.analogs) > 1:
            found.append(("analog values a frame", header.analog, self.analogs[0], by_size.format(taken.analog)))
        begins = taken.begin // BLOCK + 1
        if len(self.blocks) > 1 or begins not in self.blocks:
            said = self.blocks[0] if len(self.blocks) > 1 else begins
            found.append(("first block of the data", header.block, said, by_size.format(begins)))
        if len({scale < 0 for scale in self.scales}) > 1:
            kind = "decimal numbers" if taken.floating else "whole numbers"
            found.append(("sign of the scale", f"{header.scale:g}", f"{self.scales[0]:g}", by_size.format(kind)))
        elif len(self.scales) > 1 and not taken.floating:
            found.append(("scale", f"{header.scale:g}", f"{self.scales[0]:g}", f"{taken.scale:g} was taken"))
        notes = [f"The C3D header says {a} for the {what} and the parameters {b}; {end}." for what, a, b, end in found]
        return (*notes, *_frame_notes(taken, header, section, data))


def _claims(header: Header, section: Section) -> _Claims:
    samples = _samples(header, section)
    channels = section.count("ANALOG", "USED") or 0
    scales = (section.number("POINT", "SCALE"), header.scale)
    analog = None if channels and samples is None else channels * (samples or 0)
    blocks = [block for block in (section.count("POINT", "DATA_START"), header.block) if block]
    behind = section.block + section.blocks
    agreed = len(set(blocks)) == 1 and blocks[0] >= 2
    return _Claims(
        counts=_distinct(section.count("POINT", "USED"), header.count),
        analogs=_distinct(analog, header.analog),
        scales=tuple(dict.fromkeys(s for s in scales if s is not None and np.isfinite(s) and s != 0)),
        blocks=_distinct(*blocks) or (behind,),
        spare_block=None if agreed else behind,
    )


def _distinct(*claims: int | None) -> tuple[int, ...]:
    return tuple(dict.fromkeys(claim for claim in claims if claim is not None))


def _samples(header: Header, section: Section) -> int | None:
    """Analog samples a frame, by the rates where they are there, else by the header."""
    analog, point = section.number("ANALOG", "RATE"), section.number("POINT", "RATE") or header.rate
    if analog and point and analog > 0 and point > 0 and abs(analog / point - round(analog / point)) < 0.01:
        return round(analog / point)
    return header.samples or None


def _with_frames(data: bytes, layout: Layout, header: Header, section: Section) -> list[Layout]:
    """The same with each number of frames that somebody claims, and how well it fits."""
    room = len(data) - layout.begin
    turns = _rotation_bytes(section)
    claims = frame_claims(header, section)
    wanted = [n for n in claims if n > 0]
    if wanted and room // layout.stride > _LIMIT:
        # Counts of 16 bits end or wrap round there: the size is all there is to go by.
        by_size = [_by_size(data, layout, each) for each in (turns, 0)] if max(wanted) >= _LIMIT else []
        wraps = [n + 65536 * ((room // (layout.stride + turns) - n) // 65536) for n in wanted if n < _LIMIT]
        wanted += [n for n in by_size + wraps if n > _LIMIT]
    found = []
    for n in dict.fromkeys(wanted):
        reading = replace(layout, frames=n)
        found.append(replace(reading, fit=_fit(data, reading, n * turns)))
    return found


def _by_size(data: bytes, layout: Layout, behind: int) -> int:
    """Frames that fill the section, with so many bytes of each behind the points; zeros may fill the last block."""
    tail = data[max(layout.begin, len(data) - BLOCK + 1) :]
    used = len(data) - layout.begin - (len(tail) - len(tail.rstrip(b"\0")))
    return -(-used // (layout.stride + behind))


def _rotation_bytes(section: Section) -> int:
    """Bytes a frame of the rotations that some programs write behind all points: 4 x 4 numbers and a quality each."""
    used, ratio = section.count("ROTATION", "USED") or 0, section.number("ROTATION", "RATIO")
    rate, point = section.number("ROTATION", "RATE"), section.number("POINT", "RATE")
    if not ratio:
        ratio = rate / point if rate and point else 1.0
    return int(used * 17 * 4 * max(1, round(ratio)))


def _fit(data: bytes, layout: Layout, behind: int) -> int:
    """How well a reading has the size of its section, with or without so many bytes behind the points."""
    best = -1
    for extra in {0, behind}:
        rest = len(data) - layout.end - extra
        if rest < 0:
            continue
        zeros = data.count(b"\0", len(data) - rest) == rest
        best = max(best, 3 if rest < BLOCK and zeros else 2 if rest < BLOCK else 1 if zeros else 0)
    return best


def _best(data: bytes, readings: list[Layout], section: Section) -> Layout | None:
    """The best fit; among equals the first one, unless points move far more smoothly under another."""
    fitting = [layout for layout in readings if layout.fit >= 0]
    if not fitting:
        return None
    top = max(layout.fit for layout in fitting)
    # A few frames more or less hardly tell in small files, so that a fit but for a block is as good as a whole one.
    equals = [layout for layout in fitting if layout.fit == top]
    best = equals[0]
    placed = {(x.count, x.analog, x.floating, x.begin) for x in equals}
    if len(placed) == 1:
        return best
    for layout in equals[1:]:
        if _roughness(data, layout, section) < _roughness(data, best, section) / _SMOOTHER:
            best = layout
    return best


def _roughness(data: bytes, layout: Layout, section: Section) -> float:
    """How far points move in a frame, as part of how far they spread; infinite where they are no numbers."""
    frames = min(layout.frames, 50)
    words = point_words(data, replace(layout, frames=frames), section)
    xyz = np.where(words[..., 3:] >= 0, words[..., :3], np.nan)
    if not np.isfinite(xyz).any() or np.nanmax(np.abs(xyz)) > 1e7 or frames < 2:
        return np.inf
    spread = float(np.nanstd(xyz))
    return float(np.nanmean(np.abs(np.diff(xyz, axis=0))) / spread) if spread > 0 else np.inf


def point_words(data: bytes, layout: Layout, section: Section) -> np.ndarray:
    """(T, M, 4) coordinates and residual word of every point, as they stand in the file, unscaled."""
    item = 4 if layout.floating else 2
    raw = np.frombuffer(data, np.uint8, layout.frames * layout.stride, layout.begin)
    raw = np.ascontiguousarray(raw.reshape(layout.frames, layout.stride)[:, : 4 * layout.count * item])
    if layout.floating:
        values = floats(raw.tobytes(), section.order, section.processor == DEC)
    else:
        values = np.frombuffer(raw.tobytes(), section.order + "i2").astype(float)
    return values.reshape(layout.frames, layout.count, 4)


def frame_claims(header: Header, section: Section) -> list[int]:
    """Numbers of frames that the file names, the most trustworthy first: trial, long count, count, header.

    Counts of 16 bits end at 65535; longer trials say theirs in TRIAL or POINT:LONG_FRAMES, which stale editors leave
    as they were, so that the short counts are believed where they agree.
    """
    short = header.last - header.first + 1
    count = section.count("POINT", "FRAMES")
    point = short if count is None else count
    start, stop = trial_range(section)
    trial = stop - start + 1 if start >= 1 and stop >= start else 0
    many = section.number("POINT", "LONG_FRAMES") or 0
    claims = [trial, int(many) if 0 < many < 2**31 else 0, point, short]
    if short == point and 0 < short < _LIMIT:
        claims = [short, *claims[:2]]
    return claims


def trial_range(section: Section) -> tuple[int, int]:
    """Numbers of the first and last frame by TRIAL, 0 where absent."""
    first, last = (_long_count(section.numbers("TRIAL", f"ACTUAL_{end}_FIELD")) for end in ("START", "END"))
    return first, last


def _long_count(words: np.ndarray) -> int:
    """32-bit count kept as two 16-bit words, low one first; 0 where absent."""
    if words.size < 2 or not np.isfinite(words[:2]).all():
        return 0
    return int(words[0]) % 65536 + 65536 * (int(words[1]) % 65536)


def first_frame(taken: Layout, header: Header, section: Section) -> int:
    """Number of the first frame, from 1."""
    start, stop = trial_range(section)
    return start if start >= 1 and stop - start + 1 == taken.frames else max(header.first, 1)


def _frame_notes(taken: Layout, header: Header, section: Section, data: bytes) -> tuple[str, ...]:
    claims = frame_claims(header, section)
    said = {n for n in claims if 0 < n < _LIMIT}
    notes: tuple[str, ...] = ()
    if len(said | ({taken.frames} if taken.frames < _LIMIT else set())) > 1:
        listed = " and ".join(map(str, sorted(said | {taken.frames})))
        told = f"The C3D header and parameters disagree on the number of frames ({listed})"
        notes = (f"{told}; {taken.frames} were read.",)
    elif taken.frames > _LIMIT and taken.frames not in claims:
        notes = (f"The C3D counts no further than {_LIMIT} frames; its size holds {taken.frames}, which were read.",)
    left = len(data) - taken.end - taken.frames * _rotation_bytes(section)
    if taken.fit == 0:
        notes += (f"{left if left > 0 else len(data) - taken.end} bytes behind the points were not read.",)
    return notes


def _refuse(data: bytes, claims: _Claims, readings: list[Layout], disputed: tuple[str, ...], path: str | Path) -> None:
    if disputed:
        what = f"contradicts itself: header and parameters disagree on {' and '.join(disputed)}"
        raise InputError(f"{what}, and neither fits its size", path, "copy or export it again")
    wanted = max((layout.frames for layout in readings), default=0)
    room = max((max(0, len(data) - layout.begin) // layout.stride for layout in claims.each()), default=0)
    what = f"is cut off after frame {room} of {wanted}" if room and wanted else "is cut off before the first frame"
    raise InputError(what, path, "copy or export it again")
