"""Ridge regression on the neighbours, in a frame that rides with them: the default."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.cleaning.fill.blend import STRAIN, blend, drift, ends_of, throughout
from markerscope.solver.cleaning.fill.frames import centred, local_frames
from markerscope.solver.cleaning.fill.neighbours import Neighbours, neighbours_of
from markerscope.solver.cleaning.fill.rigid import FEWEST, FLOOR_M, rigid_part
from markerscope.solver.cleaning.fill.spline import spline_part
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, Gap, gaps_to_fill, together

_FEWEST_FRAMES = 30
"""Frames that a regression needs; with fewer the rigid body is surer."""
_MOST_FRAMES = 500
_ROUNDS = 3
"""Gaps are filled from neighbours that have gaps themselves: each round starts from the last one's filling."""
_NOISE_M = 0.0015
"""Noise of a neighbour that is seen: the ridge."""
_FILLED_M = 0.01
"""Noise of a neighbour that is filled itself."""
_FILLED_WEIGHT = 0.3
"""Weight of a frame for the regression if all neighbours are filled in it."""
_FOLDS = 4
_ABOUT = 30
"""Frames on either side of a gap that tell how well the method does there, all of them, learnt from or not."""


@dataclass(frozen=True, eq=False)
class _Scene:
    """The recording as far as it is filled.

    Attributes
    ----------
    positions : (T, M, 3) m, the filling of the round before put in
    present, known : (T, M) where it was measured, and where it is measured or filled
    """

    positions: np.ndarray
    present: np.ndarray
    known: np.ndarray
    near: Neighbours


@dataclass(frozen=True, eq=False)
class _Local:
    """A marker among one group of neighbours, in the frame that rides with them.

    Attributes
    ----------
    group : (K,) the neighbours
    frames : (N,) frames of the recording looked at, rising
    R_lab_local, centre : (N, 3, 3) and (N, 3) m, the frame
    features : (N, 3K) m, the neighbours in it
    target : (N, 3) m, the marker in it
    seen : rows in which it was measured
    train : rows of these from which the relation is learnt
    weight : of these, sums to 1
    """

    group: np.ndarray
    frames: np.ndarray
    R_lab_local: np.ndarray
    centre: np.ndarray
    features: np.ndarray
    target: np.ndarray
    seen: np.ndarray
    train: np.ndarray
    weight: np.ndarray


Parts = dict[Gap, tuple[Fill, np.ndarray]]


def fill_regression(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """Each gap by the best that the data allow: regression, else a rigid body, else a spline.

    Regression works on neighbours that may be filled themselves, so it is done in rounds, from the rigid filling on.
    """
    present = np.isfinite(positions).all(axis=2)
    near = neighbours_of(positions)
    gaps = gaps_to_fill(present, rate, replace(settings, only=None))  # a wanted one may be filled from the others
    start: Parts = {}
    for gap in gaps:
        part = rigid_part(positions, present, near, gap, settings.neighbours) or spline_part(positions, present, gap)
        if part is not None:
            start[gap] = part
    parts = start
    for left in reversed(range(_ROUNDS)):
        whole = positions.copy()
        for gap, (_, values) in parts.items():
            whole[gap.first : gap.last + 1, gap.marker] = values
        scene = _Scene(whole, present, np.isfinite(whole).all(axis=2), near)
        parts = start | _round(scene, gaps, settings.neighbours, judged=not left)
    wanted = [part for gap, part in parts.items() if settings.only in (None, gap)]
    return together(positions, wanted, settings)


def _round(scene: _Scene, gaps: list[Gap], most: int, judged: bool) -> Parts:
    """Every gap that regression can fill; those with the same neighbours share their learning.

    Only the last round is ``judged``: the errors of the others, half of the work, would be looked at by nobody.
    """
    alike = defaultdict(list)
    seen = scene.present.sum(axis=1)
    for gap in gaps:
        if seen[gap.first : gap.last + 1].min() < FEWEST:
            continue  # neighbours that are all filled themselves know nothing
        group = scene.near.nearest(gap.marker, throughout(scene.known, gap), most)
        alike[gap.marker, tuple(group)].append(gap)
    found: Parts = {}
    for (marker, others), members in alike.items():
        local = _local(scene, marker, np.array(others), members) if len(others) >= FEWEST else None
        if local is not None:
            found |= _predicted(scene, local, marker, members, judged)
    return found


def _local(scene: _Scene, marker: int, group: np.ndarray, gaps: list[Gap]) -> _Local | None:
    """The marker in the frame of its neighbours; None where too few frames show it with them."""
    complete = np.asarray(scene.known[:, group].all(axis=1))
    train = np.flatnonzero(complete & scene.present[:, marker])
    if len(train) < _FEWEST_FRAMES:
        return None
    if len(train) > _MOST_FRAMES:
        train = train[np.linspace(0, len(train) - 1, _MOST_FRAMES).round().astype(np.intp)]
    needed = np.zeros(len(complete), dtype=bool)
    needed[train] = True
    for gap in gaps:
        needed[max(gap.first - _ABOUT, 0) : gap.last + 1 + _ABOUT] = True
    frames = np.flatnonzero(needed & complete)
    rows = np.searchsorted(frames, train)
    points, seen = scene.positions[frames][:, group], scene.present[frames][:, group]
    weights = 1 / (scene.near.spread[marker, group] + FLOOR_M) ** 2
    reference = centred(points[rows[np.argmax(seen[rows].sum(axis=1))]], weights)
    R_lab_local, centre = local_frames(points, reference, weights)
    features = ((points - centre[:, None]) @ R_lab_local).reshape(len(frames), -1)
    target = np.einsum("nji,nj->ni", R_lab_local, scene.positions[frames, marker] - centre)
    weight = _FILLED_WEIGHT + (1 - _FILLED_WEIGHT) * seen[rows].mean(axis=1) ** 2
    measured = np.flatnonzero(scene.present[frames, marker])
    return _Local(group, frames, R_lab_local, centre, features, target, measured, rows, weight / weight.sum())


def _predicted(scene: _Scene, local: _Local, marker: int, gaps: list[Gap], judged: bool) -> Parts:
    """The gaps filled; where ``judged``, each with the error that the same gap would have had elsewhere, else NaN."""
    X, Y = local.features[local.train], local.target[local.train]
    mean_x, mean_y = local.weight @ X, local.weight @ Y
    X, Y = X - mean_x, Y - mean_y
    weighted = X * local.weight[:, None]
    gram, cross = weighted.T @ X, weighted.T @ Y
    tried = local.features[local.seen] - mean_x, local.target[local.seen] - mean_y
    rows = np.searchsorted(local.seen, local.train)
    residual = _held_out(X, Y, local.weight, gram, cross, tried, rows) if judged else None
    found: Parts = {}
    for gap in gaps:
        span = np.arange(gap.first, gap.last + 1)
        lost = 1 - scene.present[span][:, local.group].mean(axis=0)
        # A neighbour that is filled itself is believed less: errors in the variables are what a ridge stands for.
        ridge = np.repeat(_NOISE_M**2 + (_FILLED_M * lost) ** 2, 3)
        inverse = np.linalg.inv(gram + np.diag(ridge))
        slope = inverse @ cross
        ends = ends_of(gap, scene.present[:, marker] & scene.known[:, local.group].all(axis=1))
        rows, at_ends = np.searchsorted(local.frames, span), np.searchsorted(local.frames, ends)
        around = local.features[np.concatenate([rows, at_ends])] - mean_x
        guess = around @ slope + mean_y
        inside = guess[: len(span)] + blend(gap, ends, local.target[at_ends] - guess[len(span) :])
        values = np.einsum("nij,nj->ni", local.R_lab_local[rows], inside) + local.centre[rows]
        error = np.nan
        if residual is not None:
            error = drift(local.frames[local.seen], residual, gap, ends, STRAIN) * (1 + float(lost.mean()))
            error *= _beyond(around[: len(span)], inverse, gram)
        found[gap] = Fill(marker, gap.first, gap.last, "regression", 0.0, error), values
    return found


def _beyond(features: np.ndarray, inverse: np.ndarray, gram: np.ndarray) -> float:
    """How many times surer the frames are that were learnt from: rises where the neighbours are in new places."""
    usual = float((inverse * gram).sum())  # both are symmetric
    leverage = ((features @ inverse) * features).sum(axis=1)
    return float(np.sqrt(max(1.0, leverage.mean() / max(usual, 1e-12))))


def _held_out(
    X: np.ndarray,
    Y: np.ndarray,
    weight: np.ndarray,
    gram: np.ndarray,
    cross: np.ndarray,
    tried: tuple[np.ndarray, np.ndarray],
    train: np.ndarray,
) -> np.ndarray:
    """(S, 3) m, what is left of each tried row by the regression on the folds it is not in; folds are spans of time.

    Parameters
    ----------
    X, Y, weight : what is learnt from, and gram, cross of it
    tried : features and target of S rows, those learnt from among them
    train : which of the S those are
    """
    left = np.empty_like(tried[1])
    folds = np.array_split(np.arange(len(X)), _FOLDS)
    starts = [0, *(train[fold[0]] for fold in folds[1:]), len(left)]
    for k, fold in enumerate(folds):
        weighted = X[fold] * weight[fold, None]
        ridge = _NOISE_M**2 * (1 - weight[fold].sum()) * np.eye(len(gram))
        slope = np.linalg.solve(gram - weighted.T @ X[fold] + ridge, cross - weighted.T @ Y[fold])
        span = slice(starts[k], starts[k + 1])
        left[span] = tried[1][span] - tried[0][span] @ slope
    return left
