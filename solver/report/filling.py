"""Gaps of the labelled markers, filled by the fitted body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.core.markers import Markers


def filled_by_body(markers: Markers, placed: np.ndarray, turn: np.ndarray) -> Markers:
    """The same markers with their gaps filled from the fitted body, every filled sample flagged.

    In a gap the marker keeps to its place on the body; the distance it had from there before and after is carried
    through with the bone it sits on, linearly, so that the track stays continuous.

    Parameters
    ----------
    markers : T frames of M markers
    placed : (T, M, 3) m, where the fit says each marker is; NaN for markers that were not used
    turn : (T, M, 3, 3), rotation of the bone under each marker
    """
    positions, present = markers.positions.copy(), markers.present
    filled = np.zeros(present.shape, bool) if markers.filled is None else markers.filled.copy()
    for m in range(positions.shape[1]):
        known = np.isfinite(placed[:, m]).all(axis=1)
        gap, anchors = np.flatnonzero(~present[:, m] & known), np.flatnonzero(present[:, m] & known)
        if not len(gap) or not len(anchors):
            continue
        off = np.einsum("tji,tj->ti", turn[anchors, m], positions[anchors, m] - placed[anchors, m])
        carried = np.stack([np.interp(gap, anchors, off[:, k]) for k in range(3)], axis=1)
        positions[gap, m] = placed[gap, m] + np.einsum("tij,tj->ti", turn[gap, m], carried)
        filled[gap, m] = True
    return replace(markers, positions=positions, filled=filled)
