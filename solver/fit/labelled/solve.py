"""A labelled fit in two stages, as MoSh++ (Mahmood et al. 2019): shape and placement on keyframes, then every pose.

The residuals, the problem and its steps are those of the default method; there is no video, so the only prior of a pose
is how far joints commonly turn.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.converge import Settled
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.labelled.anchored import Anchors
from markerscope.solver.fit.labelled.every_frame import every_frame
from markerscope.solver.fit.labelled.places import FEWEST, Places, first_guess, places_of
from markerscope.solver.fit.labelled.settle import settle
from markerscope.solver.fit.labelled.start import rigid_starts
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights

NO_VIDEO = Weights(prior_deg=1e4, root_deg=1e4, free_camera=False, free_bias=False)
_REACH = (
    Phase(0.10, 1.0, 8, free_shape=False),
    Phase(0.04, 0.4, 8, free_shape=False),
)
"""Wide at first: names make sure that every marker pulls at the right place, however far off the start is."""
_SETTLE = Phase(0.04, 0.4, 4)
_PLACE = (
    Phase(0.03, 0.12, 4),
    Phase(0.02, 0.08, 4, free_placement=True),
    Phase(0.01, 0.04, 8, free_placement=True),
)
_ROUNDS = 3


@dataclass(frozen=True)
class LabelledSettings:
    """How a labelled fit is done.

    Attributes
    ----------
    keyframes : of the first stage, evenly spread (MoSh++ takes 12)
    offset_mm, offset_spread_mm : marker centre above the skin; the spread holds what the shapes miss of a real skin
    stray_mm : how far along the skin a marker may be from the vertex it is said to sit on
    shape : strength of the prior on the shape coefficients, per frame
    anatomical : strength of the prior on how far joints turn
    """

    keyframes: int = 16
    offset_mm: float = 9.5
    offset_spread_mm: float = 6.0
    stray_mm: float = 10.0
    shape: float = 1.0
    anatomical: float = 0.3

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        for name in ("keyframes", "offset_spread_mm", "stray_mm", "shape", "anatomical"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{value} is not possible", f"the setting {name}", "give a number above 0")

    def weights(self) -> Weights:
        """The same as weights of the fit."""
        return replace(
            NO_VIDEO,
            offset=self.offset_mm / 1000,
            offset_spread=self.offset_spread_mm / 1000,
            shape=self.shape,
            anatomical=self.anatomical,
        )


def solve_labelled(
    body: Body,
    markers: Markers,
    known: Mapping[str, str | int],
    settings: LabelledSettings | None = None,
    progress: Progress = silent,
) -> FittedMotion:
    """The body fitted to markers whose places are known.

    Parameters
    ----------
    body : with the shape coefficients that are to be found
    known : label -> vertex index, name of a joint (``left_knee``) or of its bone (``left_shank``); markers that it does
        not name are left out

    Raises
    ------
    InputError : the mapping does not fit the body or the recording, or too little is seen
    """
    settings = settings or LabelledSettings()
    weights = settings.weights()
    places = places_of(body, markers.labels, known)
    positions = markers.positions[:, places.markers]
    keyframes = _keyframes(positions, settings.keyframes, markers.source or "the markers")
    betas = np.zeros(body.shape_count)
    placement, surface = first_guess(body, betas, places, weights.offset)
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0)
    fits = []
    for i, start in enumerate(rigid_starts(body, placement, positions, betas)):
        part_of(progress, 0.25 * i, 0.25 * (i + 1))(0.0, "placing the markers")
        anchors = Anchors(placement, places.vertex >= 0, settings.stray_mm / 1000)
        seen = replace(observed(positions[keyframes], start.at(keyframes)), further=(anchors,))
        problem = Problem(body, seen, Points.none(body.shape_count))
        state = State(start.at(keyframes), placement, camera)
        fits.append((start, *_first_stage(problem, state, surface, places, weights)))
    start, state, surface, _ = min(fits, key=lambda fit: fit[3])
    second = replace(weights, free_shape=False, free_placement=False)
    share = part_of(progress, 0.5, 1.0)
    pose = every_frame(body, observed(positions, start), keyframes, state, surface, second, share)
    return _motion(body, markers, places, state, pose)


def observed(markers: np.ndarray, start: Pose) -> Observations:
    """Markers (N, U, 3) m with the start in the place of a video that says nothing."""
    frames = len(markers)
    return Observations(
        markers, start.rotations, np.zeros(frames, bool), np.zeros((frames, 0, 2)), np.zeros((frames, 0)), (0, 0)
    )


def _keyframes(positions: np.ndarray, count: int, where: str) -> np.ndarray:
    """Ascending frame numbers, evenly spread over those in which most of the markers are in sight."""
    seen = np.isfinite(positions).all(axis=2).sum(axis=1)
    if not len(seen) or seen.max() < FEWEST:
        raise InputError(
            f"at no time are {FEWEST} of the markers in sight whose places are known",
            where,
            "give the places of more markers, or clean the recording first",
        )
    good = np.flatnonzero(seen >= 0.8 * seen.max())
    return np.unique(good[np.linspace(0, len(good) - 1, min(count, len(good))).round().astype(int)])


def _first_stage(
    problem: Problem, state: State, surface: Surface, places: Places, weights: Weights
) -> tuple[State, Surface, float]:
    """Pose, then shape and placement, on the keyframes; and what the answer costs."""
    state, surface, _ = descend(problem, state, surface, _REACH, weights)
    if (places.vertex < 0).any():
        for _ in range(_ROUNDS):
            state, surface = settle(problem, state, surface, places, weights)
            state, surface, _ = descend(problem, state, surface, (_SETTLE,), weights)
    state, surface, _ = descend(problem, state, surface, _PLACE, weights)
    final = replace(weights, marker=_PLACE[-1].marker, marker_kernel=_PLACE[-1].kernel)
    return state, surface, problem.energies(state, final, surface).total


def _motion(body: Body, markers: Markers, places: Places, state: State, found: Settled) -> FittedMotion:
    pose = found.pose
    vertex = Skin(body, pose.betas).nearest_vertex(state.placement.shaped(pose.betas))
    return motion_from(
        body,
        markers.positions,
        markers.time,
        found,
        places.markers,
        state.placement,
        (places.bone, vertex),
        camera=CameraResult(np.eye(3), np.zeros(3), 1.0, (0, 0), float("nan")),
        warnings=places.notes,
    )
