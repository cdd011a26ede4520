"""Every frame solved, with shape, marker placement and camera held: a few Gauss-Newton steps from the keyframes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.body.model import Body
from solver.parallel import spread
from solver.progress import Progress, silent
from solver.rotations import slerp
from solver.solve.kinematics import Points, Pose, forward, place_points
from solver.solve.problem import Problem
from solver.solve.state import Observations, State, Surface, Weights

_CHUNK = 128
_SPREADS = (0.02, 0.01, 0.01, 0.01)


def every_frame(
    body: Body,
    seen: Observations,
    landmarks: Points,
    keyframes: np.ndarray,
    fitted: State,
    surface: Surface,
    base: Weights,
    progress: Progress = silent,
    start: Pose | None = None,
) -> Pose:
    """Poses of all T frames.

    Parameters
    ----------
    seen : all T frames
    keyframes : (N,) ascending frame numbers that ``fitted`` was solved at
    fitted : the keyframes' solution
    start : poses of all frames to begin with; None carries the keyframes over
    """
    frames = len(seen.markers)
    start = start or carried_over(body, seen, keyframes, fitted)
    held = replace(base, free_shape=False, free_placement=False, free_camera=False, free_bias=False)
    rotations, trans = start.rotations.copy(), start.trans.copy()

    def solve(first: int) -> None:
        progress(first / frames, "solving every frame")
        part = slice(first, min(first + _CHUNK, frames))
        problem = Problem(body, seen.at(part), landmarks)
        state = replace(fitted, pose=start.at(part))
        for spread_m in _SPREADS:
            weights = replace(held, marker=spread_m, marker_kernel=4 * spread_m)
            state = problem.step(state, weights, surface, 1e-4)
        rotations[part], trans[part] = state.pose.rotations, state.pose.trans

    spread(solve, range(0, frames, _CHUNK))
    return Pose(rotations, trans, fitted.pose.betas)


def carried_over(body: Body, seen: Observations, keyframes: np.ndarray, fitted: State) -> Pose:
    """A start for all frames: the video's pose with the keyframes' correction of it, set on each frame's markers.

    Parameters
    ----------
    seen : all T frames
    keyframes : (N,) ascending frame numbers that ``fitted`` was solved at
    """
    frames = np.arange(len(seen.markers), dtype=float)
    video = seen.prior.copy()
    video[:, 0] = fitted.camera.R_lab_cam @ video[:, 0]
    correction = np.swapaxes(video[keyframes], -1, -2) @ fitted.pose.rotations
    rotations = video @ slerp(correction, keyframes.astype(float), frames)
    steps = [np.interp(frames, keyframes, fitted.pose.trans[:, k]) for k in range(3)]
    return set_on_markers(body, seen, fitted.placement, Pose(rotations, np.stack(steps, 1), fitted.pose.betas))


def set_on_markers(body: Body, seen: Observations, placement: Points, pose: Pose) -> Pose:
    """The same poses, moved so that in each frame the markers are where they should be on average."""
    placed = place_points(placement, forward(body, pose), pose.betas)
    present = np.isfinite(seen.markers).all(axis=2)
    gap = np.where(present[..., None], seen.markers - placed, 0.0).sum(1) / np.maximum(present.sum(1), 1)[:, None]
    return replace(pose, trans=pose.trans + gap)
