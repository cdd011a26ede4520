"""The published method's answer as a motion of every frame."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import kabsch, slerp
from markerscope.solver.fit.bundle import locate_camera
from markerscope.solver.fit.confidence import chosen_by_hand
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.published.results import BodyState, PaperLocalization, PaperSolve
from markerscope.solver.fit.published.sequence import sequence_of
from markerscope.solver.fit.published.settings import STEEPNESS, PaperFitSettings
from markerscope.solver.fit.published.solve import refine
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.fit.state import Observations, State, Weights


def motion_of(
    body: Body,
    seen: Observations,
    time: np.ndarray,
    found: PaperLocalization,
    solved: PaperSolve,
    ranked: Orientation,
    settings: PaperFitSettings | None = None,
    progress: Progress = silent,
) -> FittedMotion:
    """The best yaw, or the one pinned, carried from the frames in use to all T.

    Parameters
    ----------
    seen, time : all T frames, s
    ranked : of the same solve
    """
    pinned = None if settings is None else settings.candidate
    row = 0 if pinned is None else pinned
    yaws = len(solved.yaws)
    if not 0 <= row < yaws:
        raise InputError(
            f"is number {candidate_number(row)}, which is not there",
            "the pinned candidate",
            f"pin one of 1 to {yaws} (in session.toml, candidate = 0 to {yaws - 1})",
        )
    chosen = ranked.candidates[row]
    vertex, state = solved.vertex, solved.refined.body
    if chosen.hypothesis != solved.chosen:
        sequence = sequence_of(body, seen, found.frames, found.markers, len(state.betas))
        vertex, stage = refine(sequence, solved.yaws[chosen.hypothesis], solved.settings, progress)
        state = stage.body
    confidence, warnings = ranked.confidence, ranked.warnings
    if pinned is not None:
        confidence, warnings = chosen_by_hand(ranked, row, STEEPNESS)
    at = time[found.frames]
    rotations = slerp(state.rotations, at, time)
    trans = np.stack([np.interp(time, at, state.trans[:, k]) for k in range(3)], axis=1)
    return fitted_motion(
        body,
        seen.markers,
        time,
        Pose(rotations, trans, full_shape(body, state.betas)),
        found.markers,
        vertex,
        solved.settings.offset,
        camera=chosen.camera,
        chosen=row,
        confidence=confidence,
        warnings=warnings,
    )


def fitted_motion(
    body: Body,
    markers: np.ndarray,
    time: np.ndarray,
    pose: Pose,
    used: np.ndarray,
    vertex: np.ndarray,
    offset: float,
    *,
    camera: CameraResult,
    chosen: int,
    confidence: float,
    warnings: tuple[str, ...],
) -> FittedMotion:
    """A motion whose markers (T, M, 3) m stand ``offset`` m off the vertices of those that were used (U,)."""
    placement, _ = Skin(body, pose.betas).on_vertices(vertex, offset)
    return motion_from(
        body,
        markers,
        time,
        pose,
        used,
        placement,
        (body.weights[vertex].argmax(axis=1), vertex),
        camera=camera,
        chosen=chosen,
        confidence=confidence,
        warnings=warnings,
    )


def full_shape(body: Body, betas: np.ndarray) -> np.ndarray:
    """All shape coefficients of the body, those that were not free zero."""
    return np.concatenate([betas, np.zeros(body.shape_count - len(betas))])


def camera_of(body: Body, used: Observations, landmarks: Points, state: BodyState) -> CameraResult:
    """A camera that sees the fitted body as the video saw it; the method itself has none.

    Its turn is the mean of those from the video's root to the fitted one; it stands where the landmarks want it.
    """
    seen_axes, lab_axes = (r.swapaxes(1, 2).reshape(-1, 3) for r in (used.prior[:, 0], state.rotations[:, 0]))
    turn = kabsch(seen_axes, lab_axes)
    problem = Problem(body, used, landmarks)
    pose = Pose(state.rotations, state.trans, full_shape(body, state.betas))
    camera = locate_camera(problem, pose, turn, Weights())
    none = Points.none(body.shape_count)
    position = camera.centre - camera.R_lab_cam @ camera.shift
    miss = problem.reprojection(State(pose, none, camera))
    return CameraResult(camera.R_lab_cam, position, camera.focal, used.image_size, miss)
