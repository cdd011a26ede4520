"""Mocap solving (section 3.5): stages 1 to 5."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Found, Progress, part_of, silent, tell
from markerscope.solver.fit.published.descent import minimise
from markerscope.solver.fit.published.energies import (
    marker_term,
    one_way_chamfer,
    pose_term,
    shape_term,
    summed_distances,
)
from markerscope.solver.fit.published.results import BodyState, FitStage, PaperLocalization, PaperSolve, YawFit
from markerscope.solver.fit.published.sequence import Sequence, mesh_vertices, sequence_of
from markerscope.solver.fit.published.settings import PaperSolveSettings
from markerscope.solver.fit.published.turns import about_vertical, from_six, to_six, turned
from markerscope.solver.fit.state import Observations

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

_VERTICES_AT_ONCE = 1 << 21


def solve_paper(
    body: Body,
    seen: Observations,
    found: PaperLocalization,
    settings: PaperSolveSettings,
    video_betas: np.ndarray | None = None,
    progress: Progress = silent,
) -> PaperSolve:
    """Stages 2 to 4 from every yaw, and stage 5 from the best.

    Parameters
    ----------
    body : to be fitted
    seen : all T frames
    found : the frames and markers in use, and where to start
    video_betas : shape by the video, if it is this body's; zeros else
    """
    sequence = sequence_of(body, seen, found.frames, found.markers, settings.betas, video_betas)
    yaws = []
    for i in range(settings.yaws):
        share = part_of(progress, i / (settings.yaws + 1), (i + 1) / (settings.yaws + 1))
        fit = fit_yaw(sequence, found, 360.0 * i / settings.yaws, settings, share)
        yaws.append(fit)
        tell(progress, Found("yaw", i, {"start_deg": fit.start_deg, "one_way": fit.one_way, "of": settings.yaws}))
    chosen = int(np.argmin([fit.one_way for fit in yaws]))
    share = part_of(progress, settings.yaws / (settings.yaws + 1), 1.0)
    vertex, refined = refine(sequence, yaws[chosen], settings, share)
    return PaperSolve(tuple(yaws), chosen, vertex, refined, settings)


def refine(
    sequence: Sequence, yaw: YawFit, settings: PaperSolveSettings, progress: Progress = silent
) -> tuple[np.ndarray, FitStage]:
    """Stage 5: stages 3 and 4 once more, the pose held to stage 4's. The vertex of each marker (U,), and the body."""
    body = yaw.markers.body
    vertex = nearest_on_average(sequence, body)
    return vertex, fit_markers(sequence, body, vertex, body.rotations, settings, progress, "refining the best yaw")


def fit_yaw(
    sequence: Sequence, found: PaperLocalization, start_deg: float, settings: PaperSolveSettings, progress: Progress
) -> YawFit:
    """Stages 2, 3 and 4 from one yaw beyond the localization's (stage 1)."""
    text = f"yaw {start_deg:.0f} degrees"
    video = sequence.rotations.numpy()
    pose = fit_pose(sequence, found, start_deg, settings, part_of(progress, 0.0, 0.8), f"{text}: fitting the pose")
    vertex = nearest_on_average(sequence, pose.body)
    share = part_of(progress, 0.8, 1.0)
    markers = fit_markers(sequence, pose.body, vertex, video, settings, share, f"{text}: inverse kinematics")
    one_way = chamfer_of(sequence, markers.body, mesh_vertices(sequence.body, settings.mesh))
    return YawFit(start_deg, pose, vertex, markers, one_way)


def fit_pose(
    sequence: Sequence,
    found: PaperLocalization,
    start_deg: float,
    settings: PaperSolveSettings,
    progress: Progress,
    text: str,
) -> FitStage:
    """Stage 2: equation 4 over one yaw a frame, pose, translation and shape; any vertex of the body may be nearest."""
    import torch

    vertices = torch.as_tensor(mesh_vertices(sequence.body, settings.mesh))
    yaw = sequence.markers.new_full((len(sequence.markers),), np.radians(found.yaw_deg + start_deg)).requires_grad_()
    trans, betas = (torch.tensor(value).requires_grad_() for value in (found.trans, found.betas))
    six = to_six(sequence.rotations).requires_grad_()

    def rotations() -> Tensor:
        return turned(about_vertical(yaw) @ sequence.rotations[:, 0], from_six(six))

    def terms() -> dict[str, Tensor]:
        now = rotations()
        nearest = one_way_chamfer(sequence, now, betas, trans, vertices)
        return {
            "markers": settings.pose_chamfer * nearest,
            "shape": settings.pose_shape * shape_term(betas, sequence.betas),
            "pose": settings.pose_pose * pose_term(now, sequence.rotations),
        }

    state = _state_of(rotations, trans, betas)
    descent = minimise(
        terms,
        [yaw, trans, betas, six],
        state,
        lr=settings.pose_lr,
        iterations=settings.iterations,
        progress=progress,
        text=text,
    )
    return FitStage(state(), descent)


def fit_markers(
    sequence: Sequence,
    start: BodyState,
    vertex: np.ndarray,
    reference: np.ndarray,
    settings: PaperSolveSettings,
    progress: Progress,
    text: str,
) -> FitStage:
    """Stage 4, and again in stage 5: equation 7 over pose, root rotation, translation and shape.

    Parameters
    ----------
    vertex : (U,) of each marker
    reference : (N, 24, 3, 3) that the pose is held to: the video's in stage 4, stage 4's in stage 5
    """
    import torch

    index = torch.as_tensor(vertex)
    target = torch.as_tensor(reference)
    trans, betas = (torch.tensor(value).requires_grad_() for value in (start.trans, start.betas))
    six = to_six(torch.as_tensor(start.rotations)).requires_grad_()

    def terms() -> dict[str, Tensor]:
        now = from_six(six)
        points = sequence.posed(now, betas, trans, index)
        near = marker_term(points, sequence.markers, sequence.seen, settings.offset)
        return {
            "markers": settings.marker_marker * near,
            "shape": settings.marker_shape * shape_term(betas, sequence.betas),
            "pose": settings.marker_pose * pose_term(now, target),
        }

    state = _state_of(lambda: from_six(six), trans, betas)
    descent = minimise(
        terms,
        [six, trans, betas],
        state,
        lr=settings.marker_lr,
        iterations=settings.iterations,
        progress=progress,
        text=text,
    )
    return FitStage(state(), descent)


def nearest_on_average(sequence: Sequence, state: BodyState, among: np.ndarray | None = None) -> np.ndarray:
    """Stage 3: the vertex (U,) that is nearest to each marker on average (equation 6), of all or ``among`` some.

    Frames in which the video lost the person are left out (appendix D), unless a marker is seen in no others.
    """
    import torch

    rotations, betas, trans = (torch.as_tensor(v).float() for v in (state.rotations, state.betas, state.trans))
    use = sequence.seen & sequence.tracked[:, None]
    use = torch.where(use.any(dim=0), use, sequence.seen)
    among = np.arange(len(sequence.body.template)) if among is None else among
    index = torch.as_tensor(among)
    step = max(1, _VERTICES_AT_ONCE // len(among))
    total: Any = 0.0
    with torch.no_grad():
        for first in range(0, len(trans), step):
            part = slice(first, first + step)
            posed = sequence.posed(rotations[part], betas, trans[part], index)
            total = total + summed_distances(posed, sequence.markers[part], use[part])
    nearest: np.ndarray = among[total.argmin(dim=1).numpy()]
    return nearest


def chamfer_of(sequence: Sequence, state: BodyState, vertices: np.ndarray) -> float:
    """m^2, one-way Chamfer distance of the markers to the body (equation 1)."""
    import torch

    rotations, betas, trans, index = map(torch.as_tensor, (state.rotations, state.betas, state.trans, vertices))
    with torch.no_grad():
        return float(one_way_chamfer(sequence, rotations, betas, trans, index))


def _state_of(rotations: Callable[[], Tensor], trans: Tensor, betas: Tensor) -> Callable[[], BodyState]:
    import torch

    def state() -> BodyState:
        with torch.no_grad():
            return BodyState(rotations().numpy().copy(), trans.numpy().copy(), betas.numpy().copy())

    return state
