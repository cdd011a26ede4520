"""A named fit: the body on markers of known names, shape and places held near to what the marker set says."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import slerp
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.labelled.every_frame import every_frame
from markerscope.solver.fit.labelled.solve import NO_VIDEO, observed
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import Camera, State, Surface, Weights
from markerscope.solver.fit.terms.term import Estimate

_JOINT_DEG, _ROOT_DEG = 30.0, 60.0
_ANATOMICAL = 0.1
_STEPS = ((0.06, 0.30, False, 6), (0.03, 0.12, False, 6), (0.02, 0.08, True, 6))
"""m, spread and kernel of the markers; whether places are free; how often."""


@dataclass(frozen=True, eq=False)
class Held:
    """The term of the energy by which a marker is away from its place only so far, in any direction; once and not in
    every frame.

    Attributes
    ----------
    places : (U) where each marker is said to sit
    spread : (U,) m
    """

    places: Points
    spread: np.ndarray
    name: str = "held"

    def of_frames(self, frames: np.ndarray | slice) -> Held:
        """See ``Evidence``."""
        return self

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        return float(((self._away(at) / self.spread[:, None]) ** 2).sum()) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        placement, information = at.unknowns.placement, self.spread**-2
        own = information[:, None, None] * np.eye(3)
        diagonal_blocks(sums.h_ss[None, placement, placement])[:, 0] += own
        sums.g_s[placement] += (information[:, None] * self._away(at)).ravel()

    def _away(self, at: Estimate) -> np.ndarray:
        """(U, 3) m."""
        return np.asarray(at.state.placement.rest - self.places.rest)


def weights_of() -> Weights:
    """What holds a body where its markers are all that is seen."""
    return replace(
        NO_VIDEO,
        prior_deg=_JOINT_DEG,
        root_deg=_ROOT_DEG,
        anatomical=_ANATOMICAL,
        offset=0.0,
        offset_spread=1.0,  # the places hold the markers, not their height over the skin
        slide=1.0,
    )


def reshape(
    body: Body,
    anchors: Points,
    spread: np.ndarray,
    named: np.ndarray,
    start: Pose,
    free_placement: bool,
) -> tuple[Pose, Points]:
    """Shape, then places, from some frames: a person of whom the set knows no more than the places' names.

    Parameters
    ----------
    anchors, spread : (U) the set's places, and m, how far each may be from there
    named : (K, U, 3) m, NaN = lost
    start : poses of the K frames
    """
    seen = replace(observed(named, start), tracked=np.ones(len(named), bool), further=(Held(anchors, spread),))
    problem = Problem(body, seen, Points.none(body.shape_count))
    state = State(start, anchors, Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0))
    surface = _no_surface(anchors)
    for marker, kernel, placed, steps in _STEPS:
        weights = replace(
            weights_of(), marker=marker, marker_kernel=kernel, free_shape=True,
            free_placement=placed and free_placement,
        )  # fmt: skip
        damping, cost = 1e-3, problem.energies(state, weights, surface).total
        for _ in range(steps):
            for _attempt in range(3):
                trial = problem.step(state, weights, surface, damping)
                after = problem.energies(trial, weights, surface).total
                if after < cost:
                    break
                damping *= 10
            else:
                break
            gain, state, cost, damping = (cost - after) / cost, trial, after, max(damping * 0.3, 1e-6)
            if gain < 1e-3:
                break
    return state.pose, state.placement


def follow(
    body: Body, placement: Points, named: np.ndarray, keyframes: np.ndarray, keyposes: Pose, progress: Progress = silent
) -> Pose:
    """The poses of all frames (W), from those of some.

    Parameters
    ----------
    named : (W, U, 3) m, NaN = lost
    keyframes : (K,) ascending, among the W
    """
    count = len(named)
    held = replace(weights_of(), free_shape=False, free_placement=False)
    between = interpolated(keyposes, keyframes.astype(float), np.arange(count, dtype=float))
    state = State(keyposes, placement, Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0))
    seen = observed(named, between)
    return every_frame(body, seen, keyframes, state, _no_surface(placement), held, progress).pose


def interpolated(pose: Pose, at: np.ndarray, wanted: np.ndarray) -> Pose:
    """Poses at other times than they were solved at."""
    if len(at) == 1:
        return pose.at(np.zeros(len(wanted), int))
    trans = np.stack([np.interp(wanted, at, pose.trans[:, k]) for k in range(3)], axis=1)
    return Pose(slerp(pose.rotations, at, wanted), trans, pose.betas)


def where(body: Body, placement: Points, pose: Pose) -> np.ndarray:
    """(F, U, 3) m, where the body has its markers."""
    return place_points(placement, forward(body, pose), pose.betas)


def _no_surface(points: Points) -> Surface:
    count = len(points.rest)
    return Surface(np.zeros((count, 3)), np.tile([0.0, 0, 1.0], (count, 1)))
