"""The course of a donor marker, as commercial programs call a pattern fill."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import blend, drift, ends_of
from markerscope.solver.cleaning.fill.neighbours import neighbours_of
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, gaps_to_fill, together


def fill_pattern(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """The path of the neighbour whose distance varies least, shifted to meet both ends."""
    present = np.isfinite(positions).all(axis=2)
    near = neighbours_of(positions)
    parts = []
    for gap in gaps_to_fill(present, rate, settings):
        ends = ends_of(gap, present[:, gap.marker])
        span = np.arange(gap.first, gap.last + 1)
        usable = present[np.concatenate([span, ends])].all(axis=0)
        donor = near.nearest(gap.marker, usable, 1)
        if len(donor) == 0 or len(ends) == 0:
            continue
        apart = positions[:, gap.marker] - positions[:, donor[0]]
        both = np.flatnonzero(present[:, gap.marker] & present[:, donor[0]])
        values = positions[span, donor[0]] + blend(gap, ends, apart[ends])
        error = drift(both, apart[both], gap, ends)
        parts.append((Fill(gap.marker, gap.first, gap.last, "pattern", 0.0, error), values))
    return together(positions, parts, settings)
