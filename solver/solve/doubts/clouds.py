"""Markers that form several clouds: two people, or a person and a thing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solver.affinity import affinity
from solver.solve.doubts.doubt import Doubt, Evidence, named, plural

APART_M = 0.5
"""Markers of one body have another one nearer than this."""
_NEAR_M = 0.35
_TOGETHER_M = 0.05
"""Between the two, markers of one body also keep their distance."""
FEWEST = 3
WHOLE = 8
"""From so many markers on a cloud may be a person to be solved."""
_FRAMES = 200


def clouds(positions: np.ndarray) -> np.ndarray:
    """The cloud of each marker (M,), the one with the most markers first; -1 for those that belong to none.

    Single linkage: two markers are linked that are 0.35 m apart (median over time), or 0.5 m if their distance also
    stays within 50 mm (standard deviation). Clouds of fewer than three markers count as none.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count = positions.shape[1]
    if count < 2 * FEWEST:
        return np.zeros(count, dtype=int)
    pairs = affinity(positions, _FRAMES)
    distance = _median_distance(positions)
    with np.errstate(invalid="ignore"):
        linked = (distance < _NEAR_M) | ((distance < APART_M) & (pairs.deviation < _TOGETHER_M))
    found = connected_components(csr_matrix(linked), directed=False)[1]
    sizes = np.bincount(found)
    order = np.argsort(-sizes, kind="stable")
    rank = np.full(len(sizes), -1)
    large = [c for c in order if sizes[c] >= FEWEST]
    rank[large] = np.arange(len(large))
    cloud: np.ndarray = rank[found]
    return cloud


def _median_distance(positions: np.ndarray) -> np.ndarray:
    """(M, M) m; infinite for pairs never seen together."""
    frames = np.unique(np.linspace(0, len(positions) - 1, min(len(positions), 60)).round().astype(int))
    some = positions[frames]
    apart = np.linalg.norm(some[:, :, None] - some[:, None], axis=3)
    seen = np.isfinite(apart).any(axis=0)
    apart[:, ~seen] = np.inf
    median: np.ndarray = np.nanmedian(apart, axis=0)
    return median


def taken_cloud(cloud: np.ndarray, asked: int | None, match: Callable[[np.ndarray], float] | None) -> int:
    """Number of the cloud to solve: the one asked for, else the one that moves as the video does, else the largest.

    Parameters
    ----------
    cloud : (M,) as ``clouds`` gives them
    asked : counted from 1; one that is not there is left unheard
    match : nats by which markers (their columns) move as the video does
    """
    sizes = np.bincount(cloud[cloud >= 0])
    if asked is not None and 1 <= asked <= len(sizes):
        return asked - 1
    people = np.flatnonzero(sizes >= WHOLE)
    if match is None or len(people) < 2:
        return 0
    return int(people[np.argmax([match(np.flatnonzero(cloud == c)) for c in people])])


def several(seen: Evidence) -> Doubt | None:
    """Say that there are several clouds, which one was solved, and how to choose another."""
    sizes = np.bincount(seen.cloud[seen.cloud >= 0])
    if len(sizes) < 2:
        return None
    others = np.flatnonzero((seen.cloud >= 0) & (seen.cloud != seen.taken))
    people = int((sizes >= WHOLE).sum())
    counts = ", ".join(f"cloud {c + 1} has {plural(int(n), 'marker')}" for c, n in enumerate(sizes))
    what = "two or more people, it seems" if people > 1 else "a second person's markers or those of a thing, it seems"
    return Doubt(
        "several clouds",
        f"The markers form {len(sizes)} clouds that keep apart ({counts}): {what}. Cloud {seen.taken + 1} was solved, "
        f"{'which moves most like the video; ' if people > 1 else ''}"
        f"the other {plural(len(others), 'marker')} were left out ({named(seen.labels, others)}). "
        "To solve another, choose it as part_of_cloud (--part-of-cloud).",
        tuple(int(m) for m in others),
        float(len(sizes)),
        1.0,
    )
