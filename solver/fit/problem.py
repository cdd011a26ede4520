"""The least-squares problem of a fit: what a guess costs, and the Gauss-Newton step that improves it.

Unknown per frame: a right-hand turn of every free joint and the translation. Shared by all frames: shape, the camera,
and where each marker sits on the rest body.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.state import FREE, Observations, State, Surface, Unknowns, Weights
from markerscope.solver.fit.terms.height import Height
from markerscope.solver.fit.terms.image import ImageLandmarks
from markerscope.solver.fit.terms.markers import Markers
from markerscope.solver.fit.terms.posture import Posture
from markerscope.solver.fit.terms.shape import Shape
from markerscope.solver.fit.terms.term import Energies, Estimate, Term
from markerscope.solver.fit.terms.video_pose import VideoPose

_LARGEST_TURN = 0.5
_LARGEST_MOVE_M = 0.5
_LARGEST_SLIDE_M = 0.05


class Problem:
    """One set of observations on one body.

    Parameters
    ----------
    body : with the shape coefficients that are to be found
    seen : the observations
    landmarks : (L) rest points of the body that the video's landmarks show
    person : px, height of the person in the image; of these observations where not given. Who solves a recording in
        parts gives that of the whole, or what a landmark counts would depend on the parts
    """

    def __init__(self, body: Body, seen: Observations, landmarks: Points, person: float | None = None) -> None:
        self.body, self.seen, self.landmarks = body, seen, landmarks
        self.present = np.isfinite(seen.markers).all(axis=2)
        self.target = np.where(self.present[..., None], seen.markers, 0.0)
        self.in_image = np.isfinite(seen.image).all(axis=2) & seen.tracked[:, None]
        self.pixels = np.where(self.in_image[..., None], seen.image, 0.0)
        self.person = person_height(seen) if person is None else person
        self.unknowns = Unknowns.of(body.shape_count, self.present.shape[1])
        self.terms: tuple[Term, ...] = (*self._observed(), *seen.further)

    def _observed(self) -> tuple[Term, ...]:
        """The terms that every fit has."""
        seen, usual = self.seen, np.zeros(self.body.shape_count)
        told = 0 if seen.shape is None else len(seen.shape)
        if seen.shape is not None:
            usual[:told] = seen.shape
        visible = np.where(self.in_image, seen.visibility, 0.0)
        any_seen = bool(self.in_image.any())
        return (
            Markers(self.target, self.present),
            ImageLandmarks(self.landmarks, self.pixels, visible, any_seen, self.person, seen.image_size),
            VideoPose(seen.prior, seen.tracked),
            Posture(),
            Shape(usual, told),
            Height(),
        )

    def energies(self, state: State, weights: Weights, surface: Surface) -> Energies:
        """What the state costs, per frame."""
        at = self._estimate(state, weights, surface)
        found: dict[str, float] = {}
        for term in self.terms:
            found[term.name] = found.get(term.name, 0.0) + term.energy(at)
        return Energies(found)

    def step(self, state: State, weights: Weights, surface: Surface, damping: float) -> State:
        """One damped Gauss-Newton step of everything that is free."""
        sums = self.linearised(state, weights, surface)
        return self._moved(state, *sums.solve(self.free(weights), damping))

    def frame_step(self, state: State, weights: Weights, surface: Surface, damping: float) -> np.ndarray:
        """(F, 69) rad and m: the step of each frame on its own, with all that they share held."""
        by_frame, _ = self.linearised(state, weights, surface).solve(np.zeros(0, dtype=np.intp), damping)
        return by_frame

    def linearised(self, state: State, weights: Weights, surface: Surface) -> NormalEquations:
        """The normal equations at a state; their slope is half that of the cost summed over frames."""
        sums = NormalEquations(len(self.target), self.unknowns.size)
        at = self._estimate(state, weights, surface)
        for term in self.terms:
            term.add_to(sums, at)
        return sums.gathered()

    def reprojection(self, state: State) -> float:
        """Median distance in px of the landmarks from where the body puts them; NaN where there are none."""
        if not self.in_image.any():
            return float("nan")
        points = place_points(self.landmarks, forward(self.body, state.pose), state.pose.betas)
        gap = state.camera.project(points, self.seen.image_size) - self.pixels
        return float(np.median(np.linalg.norm(gap, axis=2)[self.in_image]))

    def _estimate(self, state: State, weights: Weights, surface: Surface) -> Estimate:
        return Estimate(self.body, state, forward(self.body, state.pose), surface, weights, self.unknowns)

    def free(self, weights: Weights) -> np.ndarray:
        """Indices of the shared unknowns that these weights let move."""
        free = np.zeros(self.unknowns.size, dtype=bool)
        free[self.unknowns.shape] = weights.free_shape
        free[self.unknowns.camera] = weights.free_camera
        if not self.in_image.any():
            free[self.unknowns.camera.start + 3 : self.unknowns.camera.stop] = False
        free[self.unknowns.bias.start + 3 : self.unknowns.bias.stop] = weights.free_bias
        free[self.unknowns.placement] = weights.free_placement
        return np.flatnonzero(free)

    @staticmethod
    def turned(pose: Pose, by_frame: np.ndarray) -> Pose:
        """The poses after a step (F, 69) of each frame."""
        turns = by_frame[:, :-3].reshape(len(by_frame), len(FREE), 3).clip(-_LARGEST_TURN, _LARGEST_TURN)
        rotations = pose.rotations.copy()
        rotations[:, FREE] = rotations[:, FREE] @ exp_so3(turns)
        trans = pose.trans + by_frame[:, -3:].clip(-_LARGEST_MOVE_M, _LARGEST_MOVE_M)
        return replace(pose, rotations=rotations, trans=trans)

    def _moved(self, state: State, by_frame: np.ndarray, shared: np.ndarray) -> State:
        """The state after a step, no part of which goes further than the linearisation can be trusted."""
        pose = self.turned(state.pose, by_frame)
        betas = state.pose.betas + shared[self.unknowns.shape].clip(-1, 1)
        slide = shared[self.unknowns.placement].clip(-_LARGEST_SLIDE_M, _LARGEST_SLIDE_M).reshape(-1, 3)
        turn, shift, zoom = np.split(shared[self.unknowns.camera], [3, 6])
        return State(
            replace(pose, betas=betas),
            replace(state.placement, rest=state.placement.rest + slide),
            replace(
                state.camera,
                R_lab_cam=exp_so3(turn.clip(-_LARGEST_TURN, _LARGEST_TURN)) @ state.camera.R_lab_cam,
                shift=state.camera.shift + shift,
                focal=float(state.camera.focal * np.exp(zoom[0].clip(-0.2, 0.2))),
            ),
            state.bias @ exp_so3(shared[self.unknowns.bias].reshape(-1, 3).clip(-_LARGEST_TURN, _LARGEST_TURN)),
        )


def person_height(seen: Observations) -> float:
    """How tall the person stands in the landmarks, px, median over frames, at least 50.

    The extent changes as a person crouches; how well the network sees them does not.
    """
    there = np.isfinite(seen.image).all(axis=2) & seen.tracked[:, None]
    if not there.any():
        return 50.0
    low = np.where(there[..., None], seen.image, np.inf).min(axis=1)
    high = np.where(there[..., None], seen.image, -np.inf).max(axis=1)
    size = np.linalg.norm((high - low)[np.isfinite(high - low).all(axis=1)], axis=1)
    return max(float(np.median(size)), 50.0)
