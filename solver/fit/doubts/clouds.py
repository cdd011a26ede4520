"""Markers that form several clouds: two people, or a person and a thing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.solver.clustering.affinity import affinity
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence, named, plural

NEAR_M, APART_M = 0.38, 0.42
"""Neighbouring markers of one body are within the first of each other, in a pinch within the second."""
_TOGETHER_NEAR_M, _TOGETHER_M = 0.10, 0.05
"""They also keep their distance: it varies by less than this, the less the further they are apart."""
ALONE_M, _SPARSE_ALONE_M, _SPARSE = 0.5, 0.7, 16
"""A few markers (a raised hand's) belong to the cloud that is this near; the second where there are few in all."""
COVERED_M = 0.2
"""A cloud belongs to the body that comes this near to it (root mean square) while it covers another cloud, too."""
FEWEST = 3
WHOLE = 8
"""From so many markers on a cloud may be a person to be solved."""
_SHARE = 1 / 3
"""One with fewer markers than this share of the largest cloud's is not solved instead of that one, unless asked for."""
_FRAMES = 200
_FEW = 4.0


def clouds(positions: np.ndarray) -> np.ndarray:
    """The cloud of each marker (M,), the one with the most markers first; -1 for those that belong to none.

    Single linkage: two markers are linked that are within 0.38 m of each other (median over time), their distance
    varying by at most 100 mm (standard deviation), or within 0.42 m, varying by at most 50 mm. What is then too small
    to be a person (fewer than eight markers) goes to the nearest cloud if that is within 0.5 m (0.7 m where there are
    fewer than sixteen markers in all). Clouds of fewer than three markers count as none.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    """
    from scipy.sparse.csgraph import connected_components

    count = positions.shape[1]
    if count < 2 * FEWEST:
        return np.zeros(count, dtype=int)
    pairs = affinity(positions, _FRAMES)
    distance = _median_distance(positions)
    with np.errstate(invalid="ignore"):
        linked = (distance < NEAR_M) & (pairs.deviation < _TOGETHER_NEAR_M)
        linked |= (distance < APART_M) & (pairs.deviation < _TOGETHER_M)
    found = connected_components(linked.astype(np.int8), directed=False)[1]
    found = _gathered(found, distance, ALONE_M if count >= _SPARSE else _SPARSE_ALONE_M)
    sizes = np.bincount(found)
    order = np.argsort(-sizes, kind="stable")
    rank = np.full(len(sizes), -1)
    large = [c for c in order if sizes[c] >= FEWEST]
    rank[large] = np.arange(len(large))
    cloud: np.ndarray = rank[found]
    return cloud


def _gathered(found: np.ndarray, distance: np.ndarray, near: float) -> np.ndarray:
    """The clouds (M,) with each that is too small to be a person joined to the nearest one within ``near`` m."""
    found = found.copy()
    while True:
        sizes = np.bincount(found)
        best = (near, -1, -1)
        for small in np.flatnonzero((sizes > 0) & (sizes < WHOLE)):
            own = found == small
            apart = np.where(own, np.inf, distance[own].min(axis=0))
            nearest = int(apart.argmin())
            best = min(best, (float(apart[nearest]), int(small), int(found[nearest])))
        if best[1] < 0:
            return found
        found[found == best[1]] = best[2]


def _median_distance(positions: np.ndarray) -> np.ndarray:
    """(M, M) m; infinite for pairs never seen together."""
    frames = np.unique(np.linspace(0, len(positions) - 1, min(len(positions), 60)).round().astype(int))
    some = positions[frames]
    apart = np.linalg.norm(some[:, :, None] - some[:, None], axis=3)
    seen = np.isfinite(apart).any(axis=0)
    apart[:, ~seen] = np.inf
    median: np.ndarray = np.nanmedian(apart, axis=0)
    return median


def taken_cloud(cloud: np.ndarray, asked: int | None, cost: Callable[[np.ndarray], float]) -> int:
    """Number of the cloud to solve: the one asked for, else of those that may be people the one nearest to the video.

    Parameters
    ----------
    cloud : (M,) as ``clouds`` gives them
    asked : counted from 1
    cost : m^2, how far some markers (their columns) stay from the video's body, laid over them as well as it goes

    Raises
    ------
    InputError : there is no such cloud
    """
    sizes = np.bincount(cloud[cloud >= 0], minlength=1)
    if asked is not None:
        if asked > len(sizes):
            raise InputError(
                f"cloud {asked} was asked for, the markers form {len(sizes)}",
                "part_of_cloud (--part-of-cloud)",
                "choose one that is there, or leave it out",
            )
        return asked - 1
    people = np.flatnonzero(sizes >= max(WHOLE, _SHARE * sizes.max(initial=0)))
    if len(people) < 2:
        return 0
    # few markers come near to any body: the fewer, the less their distance says
    costs = [cost(np.flatnonzero(cloud == c)) * (1 + _FEW / np.sqrt(sizes[c])) ** 2 for c in people]
    return int(people[np.argmin(costs)])


def one_body(cloud: np.ndarray, cost: Callable[[np.ndarray], float]) -> np.ndarray:
    """The clouds (M,) with those joined that the video's body covers together: trunk and feet, an arm and a leg.

    Parameters
    ----------
    cloud : (M,) as ``clouds`` gives them
    cost : m^2, mean squared distance of some markers (their columns) from the video's body, laid over them as well as
        it goes
    """
    main = taken_cloud(cloud, None, cost)
    for other in range(int(cloud.max(initial=0)) + 1):
        own, more = np.flatnonzero(cloud == main), np.flatnonzero(cloud == other)
        if other == main or not len(own):
            continue
        both = np.concatenate([own, more])
        square = (cost(both) * len(both) - cost(own) * len(own)) / len(more)
        if square < COVERED_M**2:
            cloud = np.where(cloud == other, main, cloud)
    sizes = np.bincount(cloud[cloud >= 0], minlength=1)
    order = np.argsort(-sizes, kind="stable")
    rank = np.argsort(order)
    return np.where(cloud >= 0, rank[cloud], -1)


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
        f"The markers form {len(sizes)} clouds that keep apart ({counts}): {what}. Cloud {seen.taken + 1} was solved"
        f"{' (the one that moves most like the video, or that you chose)' if people > 1 else ''}, "
        f"the other {plural(len(others), 'marker')} were left out ({named(seen.labels, others)}). "
        "To solve another, choose it as part_of_cloud (--part-of-cloud).",
        tuple(int(m) for m in others),
        float(len(sizes)),
        1.0,
    )
