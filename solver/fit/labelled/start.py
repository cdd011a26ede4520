"""A start for the pose of every frame from labelled markers alone: the relaxed body set rigidly on them."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import kabsch, slerp
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points

_UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""Turns the rest body (y up, facing +z) upright in the lab (z up)."""
_ENOUGH = 3


def rigid_starts(body: Body, placement: Points, markers: np.ndarray, betas: np.ndarray) -> tuple[Pose, ...]:
    """Two guesses at the pose of all T frames: turned freely onto the markers, and turned about the vertical alone.

    An arm raised overhead turns a relaxed body upside down where only the arm has markers; a person who lies down is
    not upright. The fit decides between the two.

    Parameters
    ----------
    placement : (U) markers on the body
    markers : (T, U, 3) m, NaN = lost
    """
    frames = len(markers)
    relaxed = Pose(anatomical.mean_pose()[None].copy(), np.zeros((1, 3)), betas)
    model = place_points(placement, forward(body, relaxed), betas)[0]
    root = body.joints(betas)[0]
    present = np.isfinite(markers).all(axis=2)
    usable = np.flatnonzero(present.sum(axis=1) >= min(_ENOUGH, present.sum(axis=1).max()))
    share = present[usable] / present[usable].sum(axis=1, keepdims=True)
    seen = np.where(present[..., None], markers, 0.0)[usable]
    model_middle = share @ model
    middle = np.einsum("tu,tuk->tk", share, seen)
    source, target = model - model_middle[:, None], seen - middle[:, None]
    free = kabsch(source, target, share)
    upright = source @ _UPRIGHT.T
    dot = np.einsum("tu,tuk,tuk->t", share, upright[..., :2], target[..., :2])
    cross = np.einsum("tu,tu->t", share, upright[..., 0] * target[..., 1] - upright[..., 1] * target[..., 0])
    yaw = _steady(np.arctan2(cross, dot), np.hypot(cross, dot))
    turned = _about_vertical(yaw) @ _UPRIGHT
    every = np.arange(frames, dtype=float)
    poses = []
    for turn in (free, turned):
        # the root joint is where the body turns, and the relaxed pose leaves it at its place of rest
        trans = middle - np.einsum("tab,tb->ta", turn, model_middle - root) - root
        rotations = np.repeat(relaxed.rotations, frames, axis=0)
        rotations[:, 0] = slerp(turn[:, None], usable.astype(float), every)[:, 0]
        shift = np.stack([np.interp(every, usable, trans[:, k]) for k in range(3)], axis=1)
        poses.append(Pose(rotations, shift, betas))
    return tuple(poses)


def _steady(yaw: np.ndarray, trust: np.ndarray, reach: int = 10) -> np.ndarray:
    """Headings averaged over neighbouring frames by how well each is seen: a limb hanging straight tells little."""
    window = np.ones(2 * reach + 1)
    sums = [np.convolve(trust * wave, window, "full")[reach : reach + len(yaw)] for wave in (np.cos(yaw), np.sin(yaw))]
    return np.arctan2(sums[1], sums[0])


def _about_vertical(yaw: np.ndarray) -> np.ndarray:
    """(T) rad to (T, 3, 3)."""
    c, s, o, i = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw), np.ones_like(yaw)
    return np.stack([np.stack([c, -s, o], -1), np.stack([s, c, o], -1), np.stack([o, o, i], -1)], axis=-2)
