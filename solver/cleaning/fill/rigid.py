"""A rigid body made of the neighbours, those that keep their distance counting most."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import STRAIN, blend, drift, ends_of, throughout
from markerscope.solver.cleaning.fill.frames import centred, local_frames
from markerscope.solver.cleaning.fill.neighbours import Neighbours, neighbours_of
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, Gap, gaps_to_fill, together

FLOOR_M = 0.001
"""Added to the spread of a distance: noise is never smaller, and none shall count for all."""
FEWEST = 3
"""Neighbours that give a frame."""
_NEAR = 60
"""Frames, those nearest to the gap, that tell where the marker sits among its neighbours."""


def fill_rigid(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """The marker's mean place in the frame of its neighbours, weighted 1 / (spread + 1 mm)^2, meeting both ends."""
    present = np.isfinite(positions).all(axis=2)
    near = neighbours_of(positions)
    parts = []
    for gap in gaps_to_fill(present, rate, settings):
        part = rigid_part(positions, present, near, gap, settings.neighbours)
        if part is not None:
            parts.append(part)
    return together(positions, parts, settings)


def rigid_part(
    positions: np.ndarray, present: np.ndarray, near: Neighbours, gap: Gap, most: int
) -> tuple[Fill, np.ndarray] | None:
    """The fill of one gap and its (L, 3) m; None where fewer than three neighbours are seen throughout it."""
    span = np.arange(gap.first, gap.last + 1)
    group = near.nearest(gap.marker, throughout(present, gap), most)
    if len(group) < FEWEST:
        return None
    both = present[:, group].all(axis=1) & present[:, gap.marker]
    known = np.flatnonzero(both)
    if len(known) == 0:
        return None
    if len(known) > _NEAR:
        away = np.maximum(gap.first - known, known - gap.last)
        known = np.sort(known[np.argsort(away, kind="stable")[:_NEAR]])
    weights = 1 / (near.spread[gap.marker, group] + FLOOR_M) ** 2
    frames = np.concatenate([known, span])
    points = positions[frames][:, group]
    R_lab_local, centre = local_frames(points, centred(points[0], weights), weights)
    local = np.einsum("nji,nj->ni", R_lab_local[: len(known)], positions[known, gap.marker] - centre[: len(known)])
    residual = local - local.mean(axis=0)
    ends = ends_of(gap, both)
    inside = local.mean(axis=0) + blend(gap, ends, residual[np.searchsorted(known, ends)])
    values = np.einsum("nij,nj->ni", R_lab_local[len(known) :], inside) + centre[len(known) :]
    error = drift(known, residual, gap, ends, STRAIN)
    return Fill(gap.marker, gap.first, gap.last, "rigid", 0.0, error), values
