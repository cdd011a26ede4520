"""The second stage: the pose of every frame, shape and placement held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.body.model import Body
from solver.parallel import spread
from solver.progress import Progress, silent
from solver.rotations import slerp
from solver.solve.kinematics import Points, Pose, forward, place_points
from solver.solve.problem import Problem
from solver.solve.refine import carried_over
from solver.solve.residuals import marker_residual
from solver.solve.state import Observations, State, Surface, Weights

_CHUNK = 128
_SPREADS = ((0.10, 1.0), (0.05, 0.5), (0.03, 0.2), (0.02, 0.08), (0.01, 0.04), (0.01, 0.04), (0.01, 0.04))
"""m, spread and kernel of each step: keyframes are seconds apart, so a limb may start far from where it is."""
_POOR = 3.0
_FEWEST = 3
_JOINT_DEG, _ROOT_DEG = 30.0, 60.0
"""How near a joint stays to where the frames around it have it: this decides only where no marker does."""


def every_frame(
    body: Body,
    seen: Observations,
    keyframes: np.ndarray,
    fitted: State,
    surface: Surface,
    held: Weights,
    progress: Progress = silent,
) -> Pose:
    """Poses of all T frames.

    Frames that end far worse than most start once more from the nearest frame that did not. Those with next to nothing
    in sight are filled in from the frames around them.

    Parameters
    ----------
    seen : all T frames
    keyframes : (N,) ascending frame numbers that ``fitted`` was solved at
    held : weights, with shape, placement and camera held
    """
    held = replace(held, prior_deg=_JOINT_DEG, root_deg=_ROOT_DEG)
    frames = np.arange(len(seen.markers))
    sighted = np.isfinite(seen.markers).all(axis=2).sum(axis=1) >= _FEWEST
    pose = _solved(body, seen, carried_over(body, seen, keyframes, fitted), fitted, surface, held, progress)
    cost = _cost(body, seen, pose, fitted, held)
    poor = sighted & (cost > _POOR * np.median(cost[sighted]))
    good = frames[sighted & ~poor]
    if poor.any() and len(good):
        chosen, some = frames[poor], seen.at(poor)
        start = _onto(body, some, pose.at(_nearest(good, chosen)), fitted)
        again = _solved(body, some, start, fitted, surface, held)
        better = _cost(body, some, again, fitted, held) < cost[poor]
        pose.rotations[chosen[better]], pose.trans[chosen[better]] = again.rotations[better], again.trans[better]
    return _bridged(pose, sighted)


def _nearest(sorted_values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """The nearest of some ascending values to each of those wanted."""
    right = np.clip(np.searchsorted(sorted_values, wanted), 0, len(sorted_values) - 1)
    left = np.maximum(right - 1, 0)
    nearer = wanted - sorted_values[left] <= sorted_values[right] - wanted
    return np.asarray(np.where(nearer, sorted_values[left], sorted_values[right]))


def _bridged(pose: Pose, sighted: np.ndarray) -> Pose:
    """Frames with next to nothing in sight, filled in between the others."""
    if sighted.all() or not sighted.any():
        return pose
    every, at = np.arange(len(sighted), dtype=float), np.flatnonzero(sighted).astype(float)
    trans = np.stack([np.interp(every, at, pose.trans[sighted, k]) for k in range(3)], axis=1)
    return Pose(slerp(pose.rotations[sighted], at, every), trans, pose.betas)


def _solved(
    body: Body,
    seen: Observations,
    start: Pose,
    fitted: State,
    surface: Surface,
    held: Weights,
    progress: Progress = silent,
) -> Pose:
    """A few Gauss-Newton steps on every frame, the kernel narrowing."""
    count = len(seen.markers)
    rotations, trans = start.rotations.copy(), start.trans.copy()
    landmarks = Points(np.zeros((0, 3)), np.zeros((0, 3, body.shape_count)), np.zeros((0, 24)))
    seen = replace(seen, prior=start.rotations, tracked=np.ones(count, bool))

    def solve(first: int) -> None:
        progress(first / count, "solving every frame")
        part = slice(first, min(first + _CHUNK, count))
        problem = Problem(body, seen.at(part), landmarks)
        state = replace(fitted, pose=start.at(part))
        for marker, kernel in _SPREADS:
            state = problem.step(state, replace(held, marker=marker, marker_kernel=kernel), surface, 1e-4)
        rotations[part], trans[part] = state.pose.rotations, state.pose.trans

    spread(solve, range(0, count, _CHUNK))
    return Pose(rotations, trans, fitted.pose.betas)


def _cost(body: Body, seen: Observations, pose: Pose, fitted: State, held: Weights) -> np.ndarray:
    """(T,) mean robust marker cost of each frame."""
    where = place_points(fitted.placement, forward(body, pose), pose.betas)
    present = np.isfinite(seen.markers).all(axis=2)
    target = np.where(present[..., None], seen.markers, 0.0)
    marker, kernel = _SPREADS[-1]
    cost = marker_residual(where, target, present, replace(held, marker=marker, marker_kernel=kernel))[2]
    return np.asarray(cost.sum(axis=1) / np.maximum(present.sum(axis=1), 1))


def _onto(body: Body, seen: Observations, pose: Pose, fitted: State) -> Pose:
    """The pose shifted onto each frame's markers."""
    placed = place_points(fitted.placement, forward(body, pose), pose.betas)
    present = np.isfinite(seen.markers).all(axis=2)
    gap = np.where(present[..., None], seen.markers - placed, 0.0).sum(1) / np.maximum(present.sum(1), 1)[:, None]
    return replace(pose, trans=pose.trans + gap)
