"""A solved pose and its markers as the result of a fit, whatever method they came from."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.fit.converge import TOLERANCE_DEG, Settled
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.results import FittedMotion


def motion_from(
    body: Body,
    markers: np.ndarray,
    time: np.ndarray,
    pose: Pose | Settled,
    used: np.ndarray,
    placement: Points,
    sites: tuple[np.ndarray, np.ndarray],
    *,
    camera: CameraResult,
    chosen: int = 0,
    confidence: float = 1.0,
    warnings: Iterable[str] = (),
) -> FittedMotion:
    """The result of a fit.

    Parameters
    ----------
    markers : (T, M, 3) m, NaN = lost, all of the recording
    time : (T,) s
    pose : of all T frames, with whether each has settled where it was iterated until then
    used : (U,) those of the markers that were fitted
    placement : of these on the rest body
    sites : (U,) the bone and (U,) the vertex each of them is said to sit on
    camera, chosen, confidence, warnings : as in the result
    """
    count, settled = markers.shape[1], None
    if isinstance(pose, Settled):
        warnings = (*warnings, *pose.notes())
        settled, pose = pose.settled, pose.pose
    links = forward(body, pose)
    placed = np.full((len(time), count, 3), np.nan)
    placed[:, used] = place_points(placement, links, pose.betas)
    joint, vertex = np.full(count, -1), np.full(count, -1)
    joint[used], vertex[used] = sites
    return FittedMotion(
        time=time,
        rotations=pose.rotations,
        trans=pose.trans,
        betas=pose.betas,
        joints=links.place,
        marker_joint=joint,
        marker_vertex=vertex,
        placed=placed,
        residual=np.linalg.norm(markers - placed, axis=2),
        camera=camera,
        chosen=chosen,
        confidence=confidence,
        warnings=tuple(warnings),
        settled_deg=np.nan if settled is None else TOLERANCE_DEG,
        settled=settled,
    )
