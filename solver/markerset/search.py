"""The person of a marker set found in some frames of trajectories without names, whatever part of the set they hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.skeleton import PARENTS
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.fit.known.find import Found, find, promising
from markerscope.solver.markerset.marker_set import FEWEST
from markerscope.solver.markerset.poses import search_poses

KEYFRAMES = 12
_TRIAL_FRAMES = 2
_WHOLE_SHARE = 0.8
"""A file with more of a set's markers than this is taken for all of it."""
_PARTS_KEPT = 10
_MOST_OVER = 1.5
_REACH_M = 0.04
_MANY, _CLEAR_M, _CLEAR, _ENOUGH_CLEAR = 30, 0.008, 1.5, 4
"""Markers, m, times the next different answer, frames: so sure, no more are looked at. Few markers hold loosely."""
_ABSENT = 0.35
"""What a place without a point costs, beside a point without a place."""


@dataclass(frozen=True, eq=False)
class Seen:
    """The person in one frame.

    Attributes
    ----------
    frame : its number
    found : the body, and which point each of the markers searched for is
    part : (P,) numbers of these markers among the set's
    cost : m, what a point and a place are off on average, those left over counted in full
    """

    frame: int
    found: Found
    part: np.ndarray
    cost: float


def search(
    body: Body, points: Points, betas: np.ndarray, bones: np.ndarray, positions: np.ndarray, progress: Progress = silent
) -> list[Seen]:
    """The person in up to ``KEYFRAMES`` frames, the surest first.

    Parameters
    ----------
    points : (U) the set's markers on the body
    bones : (U,) joint of each
    positions : (T, N, 3) m, internal lab frame, NaN = lost
    """
    frames = _keyframes(positions)
    if not len(frames):
        return []
    typical = float(np.median(np.isfinite(positions[frames]).all(axis=2).sum(axis=1)))
    whole = np.arange(len(bones))
    parts = [whole]
    if typical < _WHOLE_SHARE * len(bones):
        some = frames[np.linspace(0, len(frames) - 1, _TRIAL_FRAMES).astype(int)]
        parts += _likely_parts(body, points, betas, bones, positions[some], typical)
    if len(parts) > 1:
        parts = _best_parts(body, points, betas, parts, positions, frames, progress)
    seen: list[Seen] = []
    for i, frame in enumerate(frames[_spread_order(len(frames))]):
        progress(i / len(frames), "looking for the person")
        tries = [_seen(body, points, betas, part, positions[frame], int(frame)) for part in parts]
        seen.append(min(tries, key=lambda one: one.cost))
        if (
            len(bones) >= _MANY
            and sum(one.cost < _CLEAR_M and one.found.next_cost > _CLEAR * one.cost for one in seen) >= _ENOUGH_CLEAR
        ):
            break
    return sorted(seen, key=lambda one: one.cost)


def _spread_order(count: int) -> np.ndarray:
    """0 to count - 1, so that those that come first are spread over all."""
    order = sorted(range(count), key=lambda i: f"{i:016b}"[::-1])
    return np.array(order, int)


def _known(points: Points, betas: np.ndarray, part: np.ndarray) -> KnownBody:
    return KnownBody(betas, points.take(part), part, search_poses())


def _seen(body: Body, points: Points, betas: np.ndarray, part: np.ndarray, cloud: np.ndarray, frame: int) -> Seen:
    found = find(body, _known(points, betas, part), cloud)
    return Seen(frame, found, part, _explained(found, int(np.isfinite(cloud).all(axis=1).sum())))


def _explained(found: Found, count: int) -> float:
    """M a point and a place, both ways."""
    matched = found.match >= 0
    off = float(np.nansum(found.residual))
    over = _REACH_M * (count - int(matched.sum())) + _ABSENT * _REACH_M * int((~matched).sum())
    return (off + over) / max(count + _ABSENT * int((~matched).sum()), 1)


def _likely_parts(
    body: Body, points: Points, betas: np.ndarray, bones: np.ndarray, clouds: np.ndarray, typical: float
) -> list[np.ndarray]:
    """Connected parts of the set with about as many markers as there are points, the most promising by a rigid look."""
    ranked = []
    for part in connected_parts(bones, max(FEWEST, round(0.75 * typical)), round(_MOST_OVER * typical)):
        known = _known(points, betas, part)
        cost = 0.0
        for cloud in clouds:
            there = cloud[np.isfinite(cloud).all(axis=1)]
            if len(there) >= FEWEST:
                cost += promising(body, known, there)[0][0]
        ranked.append((cost, len(part), part))
    ranked.sort(key=lambda one: (one[0], one[1]))
    return [part for _, _, part in ranked[: 3 * _PARTS_KEPT]]


def _best_parts(
    body: Body,
    points: Points,
    betas: np.ndarray,
    parts: list[np.ndarray],
    positions: np.ndarray,
    frames: np.ndarray,
    progress: Progress,
) -> list[np.ndarray]:
    """Those of the parts that explain a frame best."""
    frame = int(frames[len(frames) // 2])
    costs = []
    for i, part in enumerate(parts):
        progress(0.0, f"looking for a part of the set, {i + 1} of {len(parts)}")
        costs.append(_seen(body, points, betas, part, positions[frame], frame).cost)
    order = np.argsort(costs, kind="stable")
    return [parts[i] for i in order[:3] if costs[i] <= 1.3 * costs[order[0]]]


def connected_parts(bones: np.ndarray, least: int, most: int) -> list[np.ndarray]:
    """Every connected part of the bones that carry markers, as numbers of its markers: so many of them."""
    carrying = sorted(set(bones.tolist()))
    near: dict[int, set[int]] = {bone: set() for bone in carrying}
    for bone in carrying:  # bones without markers between two are passed over
        up = int(PARENTS[bone])
        while up >= 0 and up not in near:
            up = int(PARENTS[up])
        if up >= 0:
            near[bone].add(up)
            near[up].add(bone)
    count = {bone: int((bones == bone).sum()) for bone in carrying}
    level = {frozenset([bone]) for bone in carrying}
    found: set[frozenset[int]] = set()
    while level:
        level = {part for part in level if sum(count[bone] for bone in part) <= most}
        found |= {part for part in level if sum(count[bone] for bone in part) >= least}
        level = {part | {other} for part in level for bone in part for other in near[bone] - part}
    return [np.flatnonzero(np.isin(bones, sorted(part))) for part in sorted(found, key=sorted)]


def _keyframes(positions: np.ndarray) -> np.ndarray:
    """Frames evenly spread over those in which most points are seen."""
    seen = np.isfinite(positions).all(axis=2).sum(axis=1)
    if not len(seen) or seen.max() < FEWEST:
        return np.zeros(0, int)
    good = np.flatnonzero(seen >= 0.85 * seen.max())
    return np.unique(good[np.linspace(0, len(good) - 1, min(KEYFRAMES, len(good))).round().astype(int)])


def only(seen: Seen, count: int) -> np.ndarray:
    """(U,) the frame's point of each of the set's markers, -1 where none is."""
    match = np.full(count, -1)
    match[seen.part] = seen.found.match
    return match
