"""Every trajectory, frame by frame, its name of a marker set: without names, a video or a pose to begin with."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.markerset.assign import NOBODY, Pieces, assign, margins, pieces_of
from markerscope.solver.markerset.fragments import Fragments, cut_up
from markerscope.solver.markerset.held import follow, interpolated, reshape, where
from markerscope.solver.markerset.marker_set import FEWEST, MarkerSet
from markerscope.solver.markerset.search import Seen, only, search

_HZ = 25.0
_SAME_M = 0.010
"""Someone whose markers are this near in the best frames is the person the set was learnt on."""
_GATES_M = (0.20, 0.15, 0.12, 0.10)
_WIDE_M = 0.30
_SAME_GATE_M = 0.06
_FOLLOWED_M = (0.10, 0.06, 0.045, 0.04)
_FOLLOWED_OTHER_M = (0.10, 0.10, 0.09, 0.08)
_HARDLY = 0.95
"""What a sample without a name costs while the person's shape is not known yet, so that all find one."""
_STRAY_M = 0.020
_PLATE_STRAY_M = 0.040
_GOOD = 1.8
"""Frames that cost up to so many times the best are begun with."""
_LOOKED_AT = 60
_SURE = 0.95
_SIGMA_M = 0.012
_NOBODY_SIGMAS = 3.0
_SECONDS = 0.5


@dataclass(frozen=True, eq=False)
class Labelled:
    """Names of trajectories.

    Attributes
    ----------
    names : U names of the set
    name : (T, N) number of the name of each sample, -1 for nobody's or not seen
    probability : (T, N) that it is right, NaN where there is none
    pose : of all T frames
    placement : (U) where the markers sit on the body
    same_person : whether the shape and places of the set fit as they are
    notes : what to know, one sentence each
    """

    names: tuple[str, ...]
    name: np.ndarray
    probability: np.ndarray
    pose: Pose
    placement: Points
    same_person: bool
    notes: tuple[str, ...] = ()


def label(body: Body, marker_set: MarkerSet, markers: Markers, progress: Progress = silent) -> Labelled:
    """Find the set's markers among trajectories.

    The person is found in some frames, the names are given to whole fragments, the body follows them through all
    frames, and tells in turn which name each fragment suits; until nothing changes.

    Parameters
    ----------
    body : the embedded one
    markers : whose own names are not looked at

    Raises
    ------
    InputError : no person with these markers is found
    """
    points, betas, bones = marker_set.points(body), marker_set.shape(body), marker_set.bones
    positions = markers.positions
    progress(0.0, "looking for the person")
    seen = search(body, points, betas, bones, positions, part_of(progress, 0.0, 0.5))
    if not seen:
        raise InputError(
            f"at no time are {FEWEST} markers in sight", markers.source or "the markers", "give another trial"
        )
    same = marker_set.origin == "learnt" and _off(seen) <= _SAME_M
    begun = [one for one in seen if one.cost <= _GOOD * seen[0].cost] if same else seen[: max(4, len(seen) // 2)]
    begun = sorted(begun, key=lambda one: one.frame)
    fragments = cut_up(positions, markers.rate)
    work = _Work(body, marker_set, points, positions, fragments, same)
    frames = np.array([one.frame for one in begun])
    pose = Pose(np.stack([one.found.rotations for one in begun]), np.stack([one.found.trans for one in begun]), betas)
    names, pose, placement, _ = begin(work, begun, pose, frames)
    stride = max(1, round(markers.rate / _HZ))
    every = np.unique(np.append(np.arange(0, len(positions), stride), len(positions) - 1))
    every = np.union1d(every, frames)
    keys = np.searchsorted(every, frames)
    for i, gate in enumerate(_FOLLOWED_M if same else _FOLLOWED_OTHER_M):
        share = part_of(progress, 0.5 + 0.11 * i, 0.61 + 0.11 * i)
        share(0.0, "following the person")
        followed = follow(body, placement, work.named(names, every), keys, pose, share)
        if not same:
            some = np.unique(np.linspace(0, len(every) - 1, 24).astype(int))
            at = followed.at(some)
            fitted, placement = reshape(body, points, work.stray, work.named(names, every[some]), at, True)
            followed = replace(followed, betas=fitted.betas)
            keys, pose = some, fitted
        else:
            keys, pose = np.arange(len(every)), followed
        full = interpolated(followed, every.astype(float), np.arange(len(positions), dtype=float))
        model = where(body, placement, full)
        cost = work.cost(model, np.arange(len(positions)), gate)
        before, names = names, work.assigned(cost)
        if i and (before == names).all():
            break
    progress(0.97, "weighing the names")
    probability = work.probability(full, names, markers.rate)
    sample = fragments.of_sample(positions.shape[:2])
    there = sample >= 0
    name = np.where(there, names[sample], -1)
    sure = np.where(there & (name >= 0), probability[sample], np.nan)
    return Labelled(marker_set.names, name, sure, full, placement, same, ())


def begin(work: _Work, seen: list[Seen], pose: Pose, frames: np.ndarray) -> tuple[np.ndarray, Pose, Points, float]:
    """Names, poses of the frames, and places, from the frames that the person was found in; of someone whose shape is
    not known by several ways, the cheapest.
    """
    if work.same:
        return _relaxed(work, seen, pose, frames, (_SAME_GATE_M,))
    best = sorted(seen, key=lambda one: one.cost)
    wide = (_WIDE_M, *_GATES_M)
    ways = ((seen, _GATES_M), (seen, wide), (best[: max(2, len(best) // 2)], wide), (best[:1], wide))
    return min((_relaxed(work, chosen, pose, frames, gates) for chosen, gates in ways), key=lambda one: one[3])


def _relaxed(
    work: _Work, seen: list[Seen], pose: Pose, frames: np.ndarray, gates: tuple[float, ...]
) -> tuple[np.ndarray, Pose, Points, float]:
    """One way from votes to names, and what it costs a sample."""
    placement = work.points
    names = work.voted(seen)
    for gate in gates:
        named = work.named(names, frames)
        if work.same:
            pose = follow(work.body, placement, named, np.arange(len(frames)), pose)
        else:
            pose, placement = reshape(work.body, work.points, work.stray, named, pose, gate == gates[-1])
        cost = work.cost(where(work.body, placement, pose), frames, gate)
        names = work.assigned(cost, _HARDLY)
    length = work.fragments.length
    there = np.isin(np.arange(len(length)), work.sample[frames])
    each = np.where(names >= 0, cost[np.arange(len(cost)), np.maximum(names, 0)], 1.0)
    away = np.linalg.norm(placement.rest - work.points.rest, axis=1) / work.stray
    worth = float((each * length)[there].sum() / length[there].sum()) + 0.05 * float(np.minimum(away**2, 9).mean())
    return names, pose, placement, worth


def _off(seen: list[Seen]) -> float:
    """m, what a matched marker is off in the better half of the frames."""
    return float(np.median([one.found.cost for one in seen[: max(1, len(seen) // 2)]]))


class _Work:
    """What all rounds share."""

    def __init__(
        self, body: Body, marker_set: MarkerSet, points: Points, positions: np.ndarray, fragments: Fragments, same: bool
    ) -> None:
        self.body, self.set, self.points, self.same = body, marker_set, points, same
        self.positions, self.fragments = positions, fragments
        self.count = len(marker_set.markers)
        self.sample = fragments.of_sample(positions.shape[:2])
        plates = np.array([bool(marker.plate) for marker in marker_set.markers])
        self.stray = np.maximum(np.where(plates, _PLATE_STRAY_M, _STRAY_M) / 2, marker_set.spreads)
        self.pieces: Pieces | None = None
        self.piece_names = np.zeros(0, int)

    def voted(self, begun: list[Seen]) -> np.ndarray:
        """(F,) names of fragments, as the frames have them that the person was found in."""
        votes = np.zeros((len(self.fragments), self.count))
        for one in begun:
            match = only(one, self.count)
            for u in np.flatnonzero(match >= 0):
                votes[self.sample[one.frame, match[u]], u] += 1.0 / (0.01 + one.cost)
        most = votes.sum(axis=1, keepdims=True)
        return self.assigned(1.0 - votes / np.maximum(most, 1e-9))

    def named(self, names: np.ndarray, frames: np.ndarray) -> np.ndarray:
        """(W, U, 3) m of each name in some frames."""
        out = np.full((len(frames), self.count, 3), np.nan)
        sample = self.sample[frames]
        name = np.where(sample >= 0, names[sample], -1)
        row, column = np.nonzero(name >= 0)
        out[row, name[row, column]] = self.positions[frames][row, column]
        return out

    def cost(self, model: np.ndarray, frames: np.ndarray, gate: float) -> np.ndarray:
        """(F, U) mean squared distance of each fragment's samples from each name's place, over that of the gate, at
        most 1. Fragments that are in none of the frames: 1.
        """
        total, count = np.zeros((len(self.fragments), self.count)), np.zeros(len(self.fragments))
        looked = self._looked(frames)
        for i, frame in enumerate(frames):
            columns = looked[i]
            if not len(columns):
                continue
            f = self.sample[frame, columns]
            off = self.positions[frame, columns, None] - model[i]
            total[f] += np.minimum(np.einsum("nuk,nuk->nu", off, off) / gate**2, 1.0)
            count[f] += 1
        return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], 1.0)

    def _looked(self, frames: np.ndarray) -> list[np.ndarray]:
        """The columns of each frame that are looked at: up to ``_LOOKED_AT`` frames of a fragment, evenly."""
        sample = self.sample[frames]
        chosen = sample >= 0
        if len(frames) > _LOOKED_AT:
            stride = np.maximum(1, self.fragments.length // _LOOKED_AT)
            since = frames[:, None] - self.fragments.first[np.maximum(sample, 0)]
            chosen &= since % stride[np.maximum(sample, 0)] == 0
        return [np.flatnonzero(row) for row in chosen]

    def assigned(self, cost: np.ndarray, nobody: float = NOBODY) -> np.ndarray:
        """(F,) names."""
        self.pieces = pieces_of(self.fragments, cost, nobody)
        self.piece_names = assign(self.pieces, nobody)
        return self.piece_names[self.pieces.of_fragment]

    def probability(self, pose: Pose, names: np.ndarray, rate: float) -> np.ndarray:
        """(F,) that each fragment's name is right: by how much dearer the best answer is in which it is another."""
        assert self.pieces is not None
        model = where(self.body, self.points, pose)
        sigma = _SIGMA_M if self.same else 2 * _SIGMA_M
        gate = _NOBODY_SIGMAS * sigma
        cost = self.cost(model, np.arange(len(self.positions)), gate)
        total = np.zeros((len(self.pieces), self.count))
        np.add.at(total, self.pieces.of_fragment, cost * self.fragments.length[:, None])
        mean = total / np.maximum(self.pieces.samples, 1)[:, None]
        weight = np.minimum(1 + self.pieces.samples / rate / _SECONDS, 3.0)
        evidence = weight[:, None] * mean * _NOBODY_SIGMAS**2 / 2
        margin = margins(self.pieces, self.piece_names, evidence, weight * _NOBODY_SIGMAS**2 / 2)
        return (1 / (1 + np.exp(-np.minimum(margin, 50.0))))[self.pieces.of_fragment]
