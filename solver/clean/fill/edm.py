"""Euclidean distance matrices interpolated through the gap (Pan et al. 2023, section 3.1)."""

from __future__ import annotations

import numpy as np

from solver.clean.fill.blend import ends_of
from solver.clean.fill.neighbours import neighbours_of
from solver.clean.fill.rigid import FEWEST, rigid_part
from solver.clean.gaps import Fill, Filled, FillSettings, gaps_to_fill, together

NEIGHBOURS = 6


def fill_edm(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """As published: squared distances to 6 neighbours, linear from end to end; then multidimensional scaling.

    Neighbours are those of least distance variance among the markers seen throughout the gap and at its ends.
    """
    present = np.isfinite(positions).all(axis=2)
    near = neighbours_of(positions)
    parts = []
    for gap in gaps_to_fill(present, rate, settings):
        ends = ends_of(gap, present[:, gap.marker])
        span = np.arange(gap.first, gap.last + 1)
        group = near.nearest(gap.marker, present[np.concatenate([span, ends])].all(axis=0), NEIGHBOURS)
        if len(ends) == 0 or len(group) < FEWEST:
            continue
        squared = _squared_distances(positions[ends][:, [gap.marker, *group]])
        share = np.zeros(len(span)) if len(ends) == 1 else (span - ends[0]) / (ends[1] - ends[0])
        between = (1 - share)[:, None, None] * squared[0] + share[:, None, None] * squared[-1]
        values = from_distances(between, positions[span][:, group])
        alike = rigid_part(positions, present, near, gap, NEIGHBOURS)  # leans on the same thing, and errs alike
        error = np.inf if alike is None else alike[0].error
        parts.append((Fill(gap.marker, gap.first, gap.last, "edm", 0.0, error), values))
    return together(positions, parts, settings)


def from_distances(squared: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The first of K+1 points, (N, 3) m, from all squared distances and the places of the K others.

    Parameters
    ----------
    squared : (N, K+1, K+1) m^2
    others : (N, K, 3) m
    """
    size = squared.shape[1]
    centring = np.eye(size) - 1.0 / size
    value, vector = np.linalg.eigh(-0.5 * centring @ squared @ centring)
    points = vector[..., -3:] * np.sqrt(np.maximum(value[:, None, -3:], 0.0))  # (2): known up to a rigid motion
    mean_local, mean = points[:, 1:].mean(axis=1), others.mean(axis=1)
    cross = np.einsum("nki,nkj->nij", others - mean[:, None], points[:, 1:] - mean_local[:, None])
    u, _, vt = np.linalg.svd(cross)  # scaling does not know left from right: reflections are allowed
    return np.asarray(np.einsum("nij,nj->ni", u @ vt, points[:, 0] - mean_local) + mean)


def _squared_distances(points: np.ndarray) -> np.ndarray:
    """(N, K, K) m^2 of (N, K, 3) m."""
    apart = points[:, :, None] - points[:, None]
    return np.asarray(np.einsum("nijk,nijk->nij", apart, apart))
