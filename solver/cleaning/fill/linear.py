"""A straight line through the gap."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import blend, drift, ends_of
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, gaps_to_fill, together


def fill_linear(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """Straight lines between the samples before and after; gaps at the start or end of a recording stay."""
    present = np.isfinite(positions).all(axis=2)
    parts = []
    for gap in gaps_to_fill(present, rate, settings):
        ends = ends_of(gap, present[:, gap.marker])
        if len(ends) < 2:
            continue
        track, seen = positions[:, gap.marker], np.flatnonzero(present[:, gap.marker])
        error = drift(seen, track[seen], gap, ends)
        parts.append((Fill(gap.marker, gap.first, gap.last, "linear", 0.0, error), blend(gap, ends, track[ends])))
    return together(positions, parts, settings)
