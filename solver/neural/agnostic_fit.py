"""The network's poses as a start, and as what is usual, for the fit of every frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solver.body.model import Body
from solver.neural.agnostic_solve import Marked, Solved, completed
from solver.progress import Progress, silent
from solver.solve.bundle import FINE, descend
from solver.solve.kinematics import Points, Pose
from solver.solve.method import FitSettings, chosen_row, fitted_motion, state_of
from solver.solve.problem import Problem
from solver.solve.refine import every_frame, set_on_markers
from solver.solve.results import Candidate, FittedMotion, Localization, Orientation
from solver.solve.state import Observations, State, Weights


@dataclass(frozen=True)
class NetworkPoses:
    """What the network says of every frame, and of which of it markers tell.

    Attributes
    ----------
    chosen : row of the candidate whose places of the markers it was told
    rotations : (T, 24, 3, 3) lab frame; bones that no marker tells of as the video has them
    trans : (T, 3) m
    known : (24,) True for bones that markers tell of
    seen : (T,) False where fewer than 3 markers are seen
    gap : m, median distance of the markers from where these poses put them
    weights : which weights, in words
    tuned : steps of training on this session's layout
    """

    chosen: int
    rotations: np.ndarray
    trans: np.ndarray
    known: np.ndarray
    seen: np.ndarray
    gap: float
    weights: str
    tuned: int


@dataclass(frozen=True)
class NeuralFitSettings(FitSettings):
    """Which answer goes on to every frame, and how much the network's poses count beside the markers.

    Attributes
    ----------
    network_deg : degrees, spread of the network's joint rotations: what markers say more surely counts more
    settle : whether shape and places of the markers are solved once more, held by the network's poses instead of the
        video's
    """

    network_deg: float = 8.0
    settle: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        super().__post_init__()
        FitSettings(video_share=self.network_deg)


def marked(body: Body, chosen: Candidate) -> Marked:
    """What a network is told of a candidate: where its markers sit."""
    points = Points(chosen.rest, chosen.dirs, chosen.weights)
    return Marked(points.shaped(chosen.betas), points.weights, body.joints(chosen.betas))


def with_video(body: Body, seen: Observations, chosen: Candidate, solved: Solved, known: np.ndarray) -> Pose:
    """The network's poses; bones that no marker tells of as the video has them; set on the markers.

    Parameters
    ----------
    seen : all T frames, the used markers
    known : (24,) True for bones that markers tell of
    """
    video = seen.prior.copy()
    video[:, 0] = chosen.camera.R_lab_cam @ video[:, 0]
    pose = Pose(completed(solved, known, video), solved.trans, chosen.betas)
    return set_on_markers(body, seen, Points(chosen.rest, chosen.dirs, chosen.weights), pose)


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
    used = replace(seen, markers=seen.markers[:, found.markers])
    frames = found.many if chosen.refined else found.few
    state, surface = state_of(chosen, used)
    usual = poses.rotations.copy()
    usual[:, 0] = state.camera.R_lab_cam.T @ usual[:, 0]
    # The network knows nothing of a bias: what the video had of it does not belong to these poses.
    state = State(state.pose, state.placement, state.camera)
    given = replace(used, prior=usual, tracked=poses.seen)
    weights = _weights(settings)
    if settings.settle:
        problem = Problem(body, given.at(frames), landmarks)
        state, surface, _ = descend(problem, state, surface, FINE[-1:], weights)
    start = set_on_markers(body, used, state.placement, Pose(poses.rotations, poses.trans, state.pose.betas))
    pose = every_frame(body, given, landmarks, frames, state, surface, weights, progress, start)
    return fitted_motion(body, seen, found, ranked, settings, state, pose, time)


def _weights(settings: NeuralFitSettings) -> Weights:
    """The camera is held: the network's root was brought into its frame."""
    return replace(
        settings.weights(),
        prior_deg=settings.network_deg,
        root_deg=settings.network_deg,
        anatomical=0.03,
        free_bias=False,
        free_camera=False,
    )
