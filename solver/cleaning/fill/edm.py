"""Euclidean distance matrices interpolated through the gap (Pan et al. 2023, section 3.1)."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import ends_of
from markerscope.solver.cleaning.fill.frames import nearest_rotations
from markerscope.solver.cleaning.fill.neighbours import neighbours_of
from markerscope.solver.cleaning.fill.rigid import FEWEST, rigid_part
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, Gap, gaps_to_fill, together

NEIGHBOURS = 6
_FLAT_M = 0.01
"""Neighbours that stray less from a plane (root mean square) do not tell left from right: that is noise of theirs."""
_TRIALS = 40
_INSIDE = (0.25, 0.5, 0.75)
_TO_LOOK_FOR = 4
"""Times as many frames looked at as are tried."""


def fill_edm(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """As published: squared distances to 6 neighbours, linear from end to end; then multidimensional scaling.

    Neighbours are those of least distance variance among the markers seen throughout the gap and at its ends. Distances
    do not know left from right. Neighbours off one plane tell it; where they are flat, as three always are, the ends of
    the gap do, and where these contradict each other the gap is filled as a rigid body.
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
        columns = np.array([gap.marker, *group])
        share = np.zeros(len(span)) if len(ends) == 1 else (span - ends[0]) / (ends[1] - ends[0])
        first, last = (np.repeat(positions[end][None, columns], len(span), axis=0) for end in (ends[0], ends[-1]))
        values, sure = placed(first, last, share, positions[span][:, group])
        if not sure.all():
            part = rigid_part(positions, present, near, gap, NEIGHBOURS)
            if part is not None:
                parts.append(part)
            continue
        error = _expected(positions[:, columns], gap, len(ends))
        parts.append((Fill(gap.marker, gap.first, gap.last, "edm", 0.0, error), values))
    return together(positions, parts, settings)


def placed(first: np.ndarray, last: np.ndarray, share: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The marker, (N, 3) m, and (N,) False where it cannot be told on which side of its neighbours it is.

    Parameters
    ----------
    first, last : (N, K+1, 3) m, marker and K neighbours at both ends
    share : (N,) of the way from the first to the last
    others : (N, K, 3) m, the neighbours between
    """
    weight = share[:, None, None]
    squared = (1 - weight) * _squared_distances(first) + weight * _squared_distances(last)
    kept, mirrored, flat = both_from_distances(squared, others)
    by_ends = [_carried(end, others) for end in (first, last)]
    nearer = [np.linalg.norm(mirrored - end, axis=1) < np.linalg.norm(kept - end, axis=1) for end in by_ends]
    side = np.where(share < 0.5, *nearer)
    # A marker in the neighbours' plane is on both sides.
    apart = np.linalg.norm(mirrored - kept, axis=1) > 2 * _FLAT_M
    sure = ~flat | ~apart | (nearer[0] == nearer[1])
    return np.where((flat & side)[:, None], mirrored, kept), sure


def both_from_distances(squared: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The first of K+1 points, (N, 3) m, from all squared distances and the K others, and its image.

    Parameters
    ----------
    squared : (N, K+1, K+1) m^2
    others : (N, K, 3) m

    Returns
    -------
    best, other : the one that fits the others better, and its image in the plane that they are nearest to
    flat : (N,) True where the others lie in that plane, so that the choice is noise
    """
    size = squared.shape[1]
    centring = np.eye(size) - 1.0 / size
    value, vector = np.linalg.eigh(-0.5 * centring @ squared @ centring)
    points = vector[..., -3:] * np.sqrt(np.maximum(value[:, None, -3:], 0.0))  # (2): known up to a rigid motion
    mean_local, mean = points[:, 1:].mean(axis=1), others.mean(axis=1)
    cross = np.einsum("nki,nkj->nij", others - mean[:, None], points[:, 1:] - mean_local[:, None])
    u, spread, vt = np.linalg.svd(cross)  # scaling does not know left from right: reflections are allowed
    place = np.einsum("nij,nj->ni", u @ vt, points[:, 0] - mean_local)
    normal = u[..., 2]  # the direction in which the others spread least
    mirrored = place - 2 * np.einsum("ni,ni->n", place, normal)[:, None] * normal
    flat = np.sqrt(spread[:, 2] / (size - 1)) < _FLAT_M
    return place + mean, mirrored + mean, flat


def _carried(end: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(N, 3) m, where the marker of an end (N, K+1, 3) is if it rides rigidly with its neighbours (N, K, 3)."""
    before, now = end[:, 1:].mean(axis=1), others.mean(axis=1)
    cross = np.einsum("nki,nkj->nij", others - now[:, None], end[:, 1:] - before[:, None])
    return np.asarray(np.einsum("nij,nj->ni", nearest_rotations(cross), end[:, 0] - before) + now)


def _expected(points: np.ndarray, gap: Gap, ends: int) -> float:
    """Mean error, m, over gaps of this length, tried out where marker and neighbours (T, K+1, 3) are seen.

    Where they are never seen for so long: what half the length leaves, and as much again. Infinite where nothing can be
    tried.
    """
    seen = np.isfinite(points).all(axis=(1, 2))
    length, times = gap.length, 1
    while length >= 1:
        lag = length + (ends == 2)
        inside = np.unique(np.clip(np.round(lag * np.array(_INSIDE)), 1, max(1, lag - (ends == 2)))).astype(np.intp)
        starts = np.flatnonzero(seen[: max(0, len(seen) - lag)] & seen[lag:])
        for k in inside:
            starts = starts[seen[starts + k]]
        if len(starts):
            starts = starts[np.argsort(np.abs(starts + lag / 2 - (gap.first + gap.last) / 2), kind="stable")]
            starts = starts[: _TO_LOOK_FOR * _TRIALS : _TO_LOOK_FOR if len(starts) > _TRIALS else 1]
            start, offset = np.repeat(starts, len(inside)), np.tile(inside, len(starts))
            share = offset / lag if ends == 2 else np.zeros(len(offset))
            stop = start + lag if ends == 2 else start
            guess, _ = placed(points[start], points[stop], share, points[start + offset, 1:])
            return times * float(np.linalg.norm(guess - points[start + offset, 0], axis=1).mean())
        length, times = length // 2, times * 2
    return np.inf


def _squared_distances(points: np.ndarray) -> np.ndarray:
    """(N, K, K) m^2 of (N, K, 3) m."""
    apart = points[:, :, None] - points[:, None]
    return np.asarray(np.einsum("nijk,nijk->nij", apart, apart))
