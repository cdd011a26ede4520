"""The bytes of a C3D file: header, parameters, points.

Decoded here rather than by a library because every length in the file has to be checked against the file's own size
before it is believed: a truncated file must be refused, not filled with zeros, a damaged one must not crash or
exhaust memory, and trials beyond 65535 frames must keep all of them. The tests hold it against two libraries.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.c3d_layout import Header, Layout, find_layout, first_frame, point_words, read_header
from markerscope.solver.io.c3d_parameters import BLOCK, Section, read_section


@dataclass(frozen=True)
class C3DContent:
    """A decoded file.

    Attributes
    ----------
    section : the parameters
    header : what the first block says
    layout : where the points are
    xyz : (T, M, 3) float64, file units
    lost : (T, M) True where the point was not seen
    computed : (T, M) True where neither a camera nor a residual stands behind the point
    first_frame : 1-based
    rate : Hz, None where the file says none
    notes : what was found odd, one sentence each
    """

    section: Section
    header: Header
    layout: Layout
    xyz: np.ndarray
    lost: np.ndarray
    computed: np.ndarray
    first_frame: int
    rate: float | None
    notes: tuple[str, ...] = ()

    def text(self, group: str, name: str) -> tuple[str, ...]:
        """Text of a parameter and of its continuations (``LABELS2``, ...), empty where absent."""
        return self.section.text(group, name)

    def numbers(self, group: str, name: str) -> np.ndarray:
        """Numbers of a parameter, empty where absent."""
        return self.section.numbers(group, name)


def looks_like_c3d(data: bytes) -> bool:
    """True where the file begins as C3D files do: two bytes, and zeros, of which no text has any."""
    return len(data) >= 2 and data[1] == 0x50 and data[0] < 32 and b"\0" in data[2:BLOCK]


def decode_c3d(data: bytes, path: str | Path) -> C3DContent:
    """Decode a whole C3D file.

    Raises
    ------
    InputError : not a C3D, damaged, cut off, without points, or in contradiction with itself
    """
    if len(data) < 2 or data[1] != 0x50:
        raise InputError("is not a C3D file", path, "export it again or give the file its right extension")
    if len(data) < 2 * BLOCK:
        raise InputError("is cut off within the C3D header", path, "copy or export it again")
    section = read_section(data, path)
    header = read_header(data, section)
    layout, notes = find_layout(data, header, section, path)
    words = point_words(data, layout, section)
    rate, rate_notes = _rate(header, section)
    xyz = words[..., :3] * (1.0 if layout.floating else layout.scale)
    lost = ~(words[..., 3] >= 0)
    # An exact zero is where programs put what they lost, whatever the residual.
    if lost.all() and (np.isfinite(xyz) & (xyz != 0)).any():
        raise InputError(
            "marks every point as invalid (residual -1) though it holds coordinates",
            path,
            "export it again from the program it comes from, with residuals of 0 or more",
        )
    # Programs disagree on which byte of the word is the residual and which the cameras, but not on signs and zeros.
    return C3DContent(
        section, header, layout, xyz, lost, words[..., 3] == 0, first_frame(layout, header, section), rate,
        (*section.notes, *notes, *rate_notes),
    )  # fmt: skip


def _rate(header: Header, section: Section) -> tuple[float | None, tuple[str, ...]]:
    """Frames a second: as POINT:RATE says, unless the header agrees with the analog rate and it does not."""
    point, analog = section.number("POINT", "RATE"), section.number("ANALOG", "RATE")
    said = [rate for rate in (point, header.rate) if rate is not None and np.isfinite(rate) and rate > 0]
    if len(said) < 2 or abs(said[0] - said[1]) <= 1e-3 * said[1]:
        return (said[0] if said else None), ()
    taken = said[0]
    if analog and header.samples > 1 and abs(analog / header.samples - said[1]) <= 1e-3 * said[1]:
        taken = said[1]
    return taken, (f"The C3D header says {said[1]:g} Hz and the parameters {said[0]:g} Hz; {taken:g} Hz was taken.",)
