"""Gaps of the labelled markers, filled by the fitted body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.markers import Markers


def filled_by_body(markers: Markers, placed: np.ndarray) -> Markers:
    """The same markers with their gaps filled from the fitted body, every filled sample flagged.

    In a gap the marker keeps to its place on the body; the distance it had from there before and after is carried
    through, linearly, so that the track stays continuous.

    Parameters
    ----------
    markers : T frames of M markers
    placed : (T, M, 3) m, where the fit says each marker is; NaN for markers that were not used
    """
    positions, present = markers.positions.copy(), markers.present
    frames = np.arange(len(positions))
    filled = np.zeros(present.shape, bool) if markers.filled is None else markers.filled.copy()
    for m in range(positions.shape[1]):
        seen, known = present[:, m], np.isfinite(placed[:, m]).all(axis=1)
        gap = ~seen & known
        if not seen.any() or not gap.any():
            continue
        both = np.flatnonzero(seen & known)
        if not len(both):
            continue
        offset = positions[both, m] - placed[both, m]
        for k in range(3):
            positions[gap, m, k] = placed[gap, m, k] + np.interp(frames[gap], both, offset[:, k])
        filled[gap, m] = True
    return replace(markers, positions=positions, filled=filled)
