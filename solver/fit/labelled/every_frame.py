"""The second stage: the pose of every frame, shape and placement held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import slerp
from markerscope.solver.fit.converge import FINAL, Settled, settle
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.refine import carried_over, marker_cost, set_on_markers
from markerscope.solver.fit.state import Observations, State, Surface, Weights

_WIDEST = ((0.10, 1.0), (0.05, 0.5), (0.03, 0.2), (0.02, 0.08))
"""m, spread and kernel of the first steps: keyframes are seconds apart, so a limb may start far from where it is."""
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
) -> Settled:
    """Poses of all T frames, each iterated until it has settled (see ``markerscope.solver.fit.converge``).

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
    found = _solved(body, seen, carried_over(body, seen, keyframes, fitted), fitted, surface, held, progress)
    pose, settled = found.pose, found.settled
    cost = _cost(body, seen, pose, fitted, held)
    poor = sighted & (cost > _POOR * np.median(cost[sighted]))
    good = frames[sighted & ~poor]
    if poor.any() and len(good):
        chosen, some = frames[poor], seen.at(poor)
        start = set_on_markers(body, some, fitted.placement, pose.at(_nearest(good, chosen)))
        again = _solved(body, some, start, fitted, surface, held)
        better = _cost(body, some, again.pose, fitted, held) < cost[poor]
        pose.rotations[chosen[better]] = again.pose.rotations[better]
        pose.trans[chosen[better]] = again.pose.trans[better]
        settled[chosen[better]] = again.settled[better]
    return Settled(_bridged(pose, sighted), settled | ~sighted)


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
) -> Settled:
    """Every frame on its own, the kernel narrowing; where no marker decides, joints stay as they start."""
    landmarks = Points.none(body.shape_count)
    seen = replace(seen, prior=start.rotations, tracked=np.ones(len(seen.markers), bool))
    return settle(body, seen, landmarks, fitted, surface, held, start, _WIDEST, progress)


def _cost(body: Body, seen: Observations, pose: Pose, fitted: State, held: Weights) -> np.ndarray:
    """(T,) mean robust marker cost of each frame."""
    count = np.isfinite(seen.markers).all(axis=2).sum(axis=1)
    weights = replace(held, marker=FINAL[0], marker_kernel=FINAL[1])
    return marker_cost(body, seen, fitted.placement, pose, weights) / np.maximum(count, 1)
