"""The network's poses as a start, and as what is usual, for the fit of every frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.fit.bundle import FINE, descend
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.method import chosen_row, fitted_motion, in_use, state_of
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.stage import to_landmarks
from markerscope.solver.fit.refine import every_frame, set_on_markers
from markerscope.solver.fit.results import Candidate, FittedMotion, Localization, Orientation
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.state import FREE, Observations, State, Weights
from markerscope.solver.neural.layout_free.agnostic_solve import Marked

_LEAST_DEG = 1.0


@dataclass(frozen=True)
class NetworkPoses:
    """What the network says of every frame, put together with what is known without it.

    Attributes
    ----------
    chosen : row of the candidate whose places of the markers it was told
    rotations : (T, 24, 3, 3) lab frame, the network's and the default fit's by how far each can be trusted
    trans : (T, 3) m
    share : (24,) how much of each joint is the network's, 0..1
    spread_deg : (24,) degrees, how far each joint is expected to be off
    seen : (T,) False where fewer than 3 markers are seen
    gap : m, median distance of the markers from where the network's own poses put them
    weights : which weights, in words
    tuned, default_deg : with which settings
    """

    chosen: int
    rotations: np.ndarray
    trans: np.ndarray
    share: np.ndarray
    spread_deg: np.ndarray
    seen: np.ndarray
    gap: float
    weights: str
    tuned: int
    default_deg: float


@dataclass(frozen=True)
class NeuralFitSettings(FitSettings):
    """Which answer goes on to every frame, and how much the network's poses count beside the markers.

    Attributes
    ----------
    looseness : times the expected error that the poses may give way to the markers
    settle : whether shape and places of the markers are solved once more, held by these poses instead of the video's
    """

    looseness: float = 1.0
    settle: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        super().__post_init__()
        if not (np.isfinite(self.looseness) and self.looseness > 0):
            raise InputError(f"{self.looseness} is not possible", "the setting looseness", "give a number above 0")


def marked(body: Body, chosen: Candidate) -> Marked:
    """What a network is told of a candidate: where its markers sit."""
    points = Points(chosen.rest, chosen.dirs, chosen.weights)
    return Marked(points.shaped(chosen.betas), points.weights, body.joints(chosen.betas))


def fit_from_network(
    body: Body,
    seen: Observations,
    landmarks: Points,
    found: Localization,
    ranked: Orientation,
    poses: NetworkPoses,
    time: np.ndarray,
    settings: NeuralFitSettings,
    progress: Progress = silent,
) -> FittedMotion:
    """The body in every frame, from the network's poses, which also stand for the video's.

    Parameters
    ----------
    poses : of the candidate that goes on
    """
    chosen = ranked.candidates[chosen_row(ranked, settings)]
    used = in_use(seen, found, ranked)
    frames = found.many if chosen.refined else found.few
    state, surface = state_of(chosen, used)
    usual = poses.rotations.copy()
    usual[:, 0] = state.camera.R_lab_cam.T @ usual[:, 0]
    # The network knows nothing of a bias: what the video had of it does not belong to these poses.
    state = State(state.pose, state.placement, state.camera)
    given = replace(used, prior=usual, tracked=poses.seen)
    weights = _weights(settings, poses.spread_deg)
    if settings.settle:
        problem = Problem(body, given.at(frames), landmarks)
        state, surface, _ = descend(problem, state, surface, FINE[-1:], weights)
    known = replace(given, markers=seen.markers)
    drawn = to_landmarks(body, known, landmarks, found.markers, frames, state, surface, weights, settings)
    state, surface = drawn.state, drawn.surface
    start = set_on_markers(body, used, state.placement, Pose(poses.rotations, poses.trans, state.pose.betas))
    pose = every_frame(body, given, landmarks, frames, state, surface, weights, progress, start)
    return replace(fitted_motion(body, seen, found, ranked, settings, state, pose, time), pull=drawn.pull)


def _weights(settings: NeuralFitSettings, spread_deg: np.ndarray) -> Weights:
    """Every joint held as tightly as it is known; the camera stays, the root was brought into its frame."""
    spread = np.maximum(settings.looseness * spread_deg[FREE], _LEAST_DEG)
    return replace(
        settings.weights(),
        prior_deg=spread,
        root_deg=float(spread[0]),
        anatomical=0.03,
        free_bias=False,
        free_camera=False,
    )
