"""The place of a marker on the fitted body."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import blend, drift, ends_of
from markerscope.solver.cleaning.gaps import Fill, Filled, FillMethod, FillSettings, gaps_to_fill, together


def fill_by_body(placed: np.ndarray) -> FillMethod:
    """A way of filling: each marker where the body has it, plus the distance it had from there before and after.

    Parameters
    ----------
    placed : (T, M, 3) m, ``placed`` of a ``FittedMotion``; NaN for markers that were not used
    """

    def fill(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
        """Fill by the fitted body."""
        present = np.isfinite(positions).all(axis=2)
        known = np.isfinite(placed).all(axis=2)
        parts = []
        for gap in gaps_to_fill(present, rate, settings):
            m, span = gap.marker, np.arange(gap.first, gap.last + 1)
            both = present[:, m] & known[:, m]
            if not known[span, m].all() or not both.any():
                continue
            off = positions[:, m] - placed[:, m]
            ends, frames = ends_of(gap, both), np.flatnonzero(both)
            values = placed[span, m] + blend(gap, ends, off[ends])
            parts.append((Fill(m, gap.first, gap.last, "body", 0.0, drift(frames, off[frames], gap, ends)), values))
        return together(positions, parts, settings)

    return fill
