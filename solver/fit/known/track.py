"""A known person followed through a trial of unlabelled markers: found in single frames, told apart by what the whole
trial says, and carried from there to frames before and after.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.converge import settle
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.fit.known.find import Found, answers
from markerscope.solver.fit.labelled.solve import NO_VIDEO, observed
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.refine import set_on_markers
from markerscope.solver.fit.state import Camera, State, Surface

LOST_M = 0.04
"""A place without a marker, or further from it than this, counts as this far off."""
_LOOKS, _AGREE, _ENOUGH_LOOKS = 12, 3, 5
_ALIKE = 0.8
_RIVALS = 2
_FAR_BEHIND, _FEW = 2.0, 12
_ROUNDS = 2
_OVERLAP = 2
"""Frames in which two pieces of one track may both be seen."""
_WIDE = ((0.10, 1.0), (0.05, 0.5), (0.03, 0.2), (0.02, 0.08))
_JOINT_DEG, _ROOT_DEG = 30.0, 60.0
_FEWEST = 3
_LEAST_SHARE = 0.3


@dataclass(frozen=True)
class Track:
    """One way in which a known person moves through a trial.

    Attributes
    ----------
    place : (M,) which of the person's markers each column of the trial is, -1 where it is none; one that broke off has
        several columns
    frames : (N,) ascending keyframes
    rotations, trans : (N, 24, 3, 3), (N, 3) m, pose in the keyframes, root in the internal lab frame
    cost : m, what a marker is off on average over the keyframes, at most ``LOST_M``
    looks : how many of the frames that were looked at alone gave this answer
    """

    place: np.ndarray
    frames: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    cost: float
    looks: int


@dataclass(frozen=True)
class Tracked:
    """What was made of a trial.

    Attributes
    ----------
    tracks : the different answers, the cheapest first; at least one
    looked : frames that were looked at alone
    """

    tracks: tuple[Track, ...]
    looked: int


def follow(
    body: Body,
    known: KnownBody,
    markers: np.ndarray,
    keyframes: int = 40,
    progress: Progress = silent,
    reach: float = LOST_M,
) -> Tracked:
    """The known person in a trial.

    Parameters
    ----------
    body : the one that ``known`` was fitted with
    markers : (T, M, 3) m, internal lab frame, z up, NaN = lost; unlabelled
    keyframes : how many frames the answers are compared on
    reach : m, how far a marker may be from its place and still be told; more where places are known roughly

    Raises
    ------
    InputError : in no frame are enough of the person's markers
    """
    looks = _spread_looks(markers)
    if not len(looks):
        raise InputError("no frame shows enough markers to find a person by", "the markers", "record more of them")
    seen: list[tuple[int, Found]] = []
    for i, frame in enumerate(_outwards(looks)):
        progress(0.6 * i / len(looks), f"looking for the person in frame {frame}")
        seen += [(int(frame), answer) for answer in answers(body, known, markers[frame])]
        looked = i + 1
        if looked >= _ENOUGH_LOOKS and _settled(seen):
            break
    groups = _grouped(seen)
    tracks = []
    best = groups[0][0][1].cost
    for i, group in enumerate(groups[: _RIVALS + 1]):
        share = part_of(progress, 0.6 + 0.4 * i / (_RIVALS + 1), 0.6 + 0.4 * (i + 1) / (_RIVALS + 1))
        # What is far behind in single frames is followed in a few alone, to say how far.
        count = keyframes if group[0][1].cost < _FAR_BEHIND * best else _FEW
        tracks.append(_carried(body, known, markers, group, count, share, reach))
    tracks.sort(key=lambda track: track.cost)
    different = [tracks[0], *(t for t in tracks[1:] if not _same_places(t.place, tracks[0].place))]
    return Tracked(tuple(different), looked)


def _spread_looks(markers: np.ndarray) -> np.ndarray:
    """Frames spread over those with most markers in sight."""
    count = np.isfinite(markers).all(axis=2).sum(axis=1)
    good = np.flatnonzero(count >= max(_FEWEST, 0.9 * count.max(initial=0)))
    if not len(good):
        return good
    return np.unique(good[np.linspace(0, len(good) - 1, min(_LOOKS, len(good))).round().astype(int)])


def _outwards(frames: np.ndarray) -> np.ndarray:
    """The same frames in an order in which any first few are spread over all (van der Corput)."""
    keys = []
    for i in range(len(frames)):
        value, base = 0.0, 0.5
        while i:
            value, base, i = value + base * (i & 1), base / 2, i >> 1
        keys.append(value)
    return frames[np.argsort(keys, kind="stable")]


def _settled(seen: list[tuple[int, Found]]) -> bool:
    """Whether enough frames agree on an answer that is far ahead of every other."""
    groups = _grouped(seen)
    best = min(found.cost for _, found in groups[0])
    near = {frame for frame, found in groups[0] if found.cost < 1.5 * best}
    return len(near) >= _AGREE and all(min(f.cost for _, f in other) > 2 * best for other in groups[1:])


def _grouped(seen: list[tuple[int, Found]]) -> list[list[tuple[int, Found]]]:
    """Answers of single frames that name the columns alike, together; the cheapest of each first, the groups too."""
    groups: list[list[tuple[int, Found]]] = []
    for one in sorted(seen, key=lambda item: item[1].cost):
        for group in groups:
            if _alike(group[0][1].match, one[1].match):
                group.append(one)
                break
        else:
            groups.append([one])
    return groups


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    both = (one >= 0) & (other >= 0)
    return bool(both.sum() >= _FEWEST and (one[both] == other[both]).mean() >= _ALIKE)


def _same_places(one: np.ndarray, other: np.ndarray) -> bool:
    both = (one >= 0) & (other >= 0)
    return bool(both.sum() >= _FEWEST and (one[both] == other[both]).mean() >= _ALIKE)


def _carried(
    body: Body,
    known: KnownBody,
    markers: np.ndarray,
    group: list[tuple[int, Found]],
    keyframes: int,
    progress: Progress,
    reach: float,
) -> Track:
    """An answer of single frames carried to keyframes of the whole trial, the columns told by all of them."""
    best = group[0][1]
    place = np.full(markers.shape[1], -1)
    place[best.match[best.match >= 0]] = np.flatnonzero(best.match >= 0)
    poses: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for frame, found in group:
        if found.cost < 2 * best.cost:
            poses.setdefault(frame, (found.rotations, found.trans))
    at = np.array(sorted(poses))
    pose = Pose(np.stack([poses[f][0] for f in at]), np.stack([poses[f][1] for f in at]), known.betas)
    for round_ in range(_ROUNDS):
        progress(round_ / _ROUNDS, "following the person")
        frames = _keyframes(markers, place, keyframes)
        nearest = np.abs(frames[:, None] - at).argmin(axis=1)
        pose = solved(body, known, markers[frames], place, pose.at(nearest))
        at = frames
        where = place_points(known.placement, forward(body, pose), known.betas)
        place = told(where, markers[frames], markers, reach if round_ == _ROUNDS - 1 else LOST_M)
    # Once more with the columns as they are told now.
    pose = solved(body, known, markers[at], place, pose)
    where = place_points(known.placement, forward(body, pose), known.betas)
    return Track(
        place, at, pose.rotations, pose.trans, cost_of(where, markers[at], place), len({frame for frame, _ in group})
    )


def _keyframes(markers: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """Ascending frames spread over those with most of the person's markers; and some of every column seen seldom."""
    present = np.isfinite(markers).all(axis=2)
    mine = present[:, place >= 0].sum(axis=1) if (place >= 0).any() else present.sum(axis=1)
    good = np.flatnonzero(mine >= max(_FEWEST, 0.8 * np.median(mine)))
    good = good if len(good) else np.flatnonzero(mine == mine.max())
    frames = np.unique(good[np.linspace(0, len(good) - 1, min(count, len(good))).round().astype(int)])
    seldom = np.flatnonzero(present[frames].sum(axis=0) < _FEWEST)
    more = [np.flatnonzero(present[:, m])[[0, -1]] for m in seldom if present[:, m].sum() >= _FEWEST]
    middle = [np.array([ends.mean().astype(int)]) for ends in more]
    sighted = [f for f in np.concatenate([frames, *middle]).astype(int) if mine[f] >= _FEWEST]
    return np.unique(sighted) if sighted else frames


def labelled_observations(markers: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The person's columns (U') and their positions (N, U', 3)."""
    used = np.flatnonzero(place >= 0)
    return used, markers[:, used]


def solved(body: Body, known: KnownBody, markers: np.ndarray, place: np.ndarray, start: Pose) -> Pose:
    """The person's poses in some frames (N, M, 3), the columns known, from far or near."""
    used, mine = labelled_observations(markers, place)
    if len(used) < _FEWEST:
        return start
    placement = known.placement.take(place[used])
    seen = replace(observed(mine, start), tracked=np.ones(len(mine), bool))
    start = set_on_markers(body, seen, placement, start)
    held = replace(NO_VIDEO, prior_deg=_JOINT_DEG, root_deg=_ROOT_DEG, anatomical=0.1)
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0)
    none = Points.none(body.shape_count)
    state = State(start, placement, camera)
    surface = surface_of(body, placement, known.betas)
    return settle(body, seen, none, state, surface, held, start, _WIDE).pose


def surface_of(body: Body, placement: Points, betas: np.ndarray) -> Surface:
    """The skin below each place."""
    return Skin(body, betas).attach(placement.shaped(betas))[1]


def told(where: np.ndarray, seen: np.ndarray, whole: np.ndarray, reach: float = LOST_M) -> np.ndarray:
    """(M,) which place each column is.

    One to one at first; what is left over then joins a place whose columns are seen at other times.

    Parameters
    ----------
    where : (N, U, 3) m, the places in the keyframes
    seen : (N, M, 3) m, the columns in the keyframes
    whole : (T, M, 3) the columns in all frames
    reach : m, how far a column may be from its place
    """
    present = np.isfinite(whole).all(axis=2)
    off = np.full((seen.shape[1], where.shape[1]), np.inf)
    for m in range(seen.shape[1]):
        rows = np.isfinite(seen[:, m]).all(axis=1)
        if rows.any():
            off[m] = np.median(np.linalg.norm(where[rows] - seen[rows, None, m], axis=2), axis=0)
    # A column seen throughout says more than a piece of a track.
    share = np.maximum(present.mean(axis=0), 1e-3)[:, None]
    gain = share * (np.minimum(off, reach) ** 2 - reach**2)
    rows, columns = linear_sum_assignment(gain)
    place = np.full(seen.shape[1], -1)
    near = off[rows, columns] < reach
    place[rows[near]] = columns[near]
    for m in np.argsort(off.min(axis=1), kind="stable"):
        u = int(off[m].argmin())
        if place[m] >= 0 or off[m, u] >= LOST_M:
            continue
        if (present[:, place == u].any(axis=1) & present[:, m]).sum() <= _OVERLAP:
            place[m] = u
    return place


def cost_of(where: np.ndarray, seen: np.ndarray, place: np.ndarray) -> float:
    """m, what a place is off on average; one without a marker in sight counts only where none is left over for it."""
    total, count = 0.0, 0
    for u in range(where.shape[1]):
        columns = np.flatnonzero(place == u)
        if not len(columns):
            total, count = total + LOST_M * len(where), count + len(where)
            continue
        off = np.linalg.norm(seen[:, columns] - where[:, [u]], axis=2)
        rows = np.isfinite(off).any(axis=1)
        total += float(np.minimum(np.nanmin(off[rows], axis=1), LOST_M).sum()) if rows.any() else 0.0
        count += int(rows.sum())
    return total / max(count, 1)
