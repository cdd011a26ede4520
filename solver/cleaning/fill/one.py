"""One gap filled by one method, from the frames about it: what a user asks for on a curve, and what is previewed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.cleaning.fill.body import fill_by_body
from markerscope.solver.cleaning.gaps import Fill, FillMethod, FillSettings, Gap, find_gaps

ABOUT = 1000
"""Frames on either side of a gap from which it is filled: enough to learn from, and as quick in an hour's recording."""
_ANY = FillSettings(max_gap=None, min_confidence=0.0)
"""Whoever asks for one gap sees what error is to be expected, and decides."""


def fill_gap(positions: np.ndarray, rate: float, gap: Gap, method: FillMethod) -> tuple[Fill, np.ndarray] | None:
    """The fill of a gap and its (L, 3) m; None where the method cannot tell.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    rate : Hz
    gap : of these positions, as ``find_gaps`` has it
    method : which looks at no frame farther from the gap than ``ABOUT``
    """
    start = max(gap.first - ABOUT, 0)
    part = positions[start : gap.last + 1 + ABOUT]
    first, last = gap.first - start, gap.last - start
    made = method(part, rate, replace(_ANY, only=Gap(gap.marker, first, last)))
    fill = next((f for f in made.fills if (f.marker, f.first, f.last) == (gap.marker, first, last)), None)
    if fill is None:
        return None
    return replace(fill, first=gap.first, last=gap.last), made.positions[first : last + 1, gap.marker]


def fill_gap_by_body(
    positions: np.ndarray, placed: np.ndarray, rate: float, gap: Gap
) -> tuple[Fill, np.ndarray] | None:
    """The same by a fitted body: ``placed`` (T, M, 3) m is where it has the markers."""
    start = max(gap.first - ABOUT, 0)
    return fill_gap(positions, rate, gap, fill_by_body(placed[start : gap.last + 1 + ABOUT]))


def gaps_in(positions: np.ndarray, marker: int, first: int, last: int) -> list[Gap]:
    """The whole gaps of one marker that a span of frames touches."""
    present = np.isfinite(positions[:, [marker]]).all(axis=2)
    return [replace(gap, marker=marker) for gap in find_gaps(present) if gap.first <= last and gap.last >= first]
