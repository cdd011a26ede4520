"""Every frame solved, with shape, marker placement and camera held, from the keyframes to those between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.rotations import slerp
from markerscope.solver.fit.converge import Settled, settle
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.problem import person_height
from markerscope.solver.fit.state import Observations, State, Surface, Weights
from markerscope.solver.fit.terms.markers import marker_residual

_STRIDES = (4, 2, 1)
"""Every so many frames are solved first; those between start from what these found."""
_WIDE = (0.02, 0.08)
"""m, spread and kernel of the first step, and of the comparison of two starts."""


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
) -> Settled:
    """Poses of all T frames, each iterated until it has settled (see ``converge``).

    Parameters
    ----------
    seen : all T frames
    keyframes : (N,) ascending frame numbers that ``fitted`` was solved at
    fitted : the keyframes' solution
    start : poses of all frames to begin with; None carries the keyframes over
    """
    count, person = len(seen.markers), person_height(seen)
    start = start or carried_over(body, seen, keyframes, fitted)
    rotations, trans = start.rotations.copy(), start.trans.copy()
    settled, solved = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    for stride in _STRIDES:
        todo = np.setdiff1d(np.union1d(np.arange(0, count, stride), count - 1), np.flatnonzero(solved))
        if not len(todo):
            continue
        guess, some = start.at(todo), seen.at(todo)
        if solved.any():
            known = np.flatnonzero(solved)
            between = replace(fitted, pose=Pose(rotations[known], trans[known], fitted.pose.betas))
            guess = _nearer(body, some, fitted, base, guess, carried_over(body, seen, known, between).at(todo))
        share = part_of(progress, solved.mean(), solved.mean() + len(todo) / count)
        widest = () if solved.any() else (_WIDE,)
        found = settle(body, some, landmarks, fitted, surface, base, guess, widest, share, person)
        rotations[todo], trans[todo], settled[todo] = found.pose.rotations, found.pose.trans, found.settled
        solved[todo] = True
    return Settled(Pose(rotations, trans, fitted.pose.betas), settled)


def _nearer(body: Body, seen: Observations, fitted: State, base: Weights, first: Pose, second: Pose) -> Pose:
    """Of two starts the one whose markers are nearer, frame by frame; the second where they are alike."""
    weights = replace(base, marker=_WIDE[0], marker_kernel=_WIDE[1])
    mine, other = (marker_cost(body, seen, fitted.placement, pose, weights) for pose in (first, second))
    chosen = mine < other
    rotations = np.where(chosen[:, None, None, None], first.rotations, second.rotations)
    return Pose(rotations, np.where(chosen[:, None], first.trans, second.trans), second.betas)


def marker_cost(body: Body, seen: Observations, placement: Points, pose: Pose, weights: Weights) -> np.ndarray:
    """(T,) robust cost of each frame's markers."""
    where = place_points(placement, forward(body, pose), pose.betas)
    present = np.isfinite(seen.markers).all(axis=2)
    target = np.where(present[..., None], seen.markers, 0.0)
    return np.asarray(marker_residual(where, target, present, weights)[2].sum(axis=1))


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
