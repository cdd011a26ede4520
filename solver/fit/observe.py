"""Markers, the video's pose and its landmarks brought onto the markers' clock."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import slerp
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.lift import landmark_points
from markerscope.solver.fit.state import Observations

_LONGEST_BRIDGE_S = 0.1
"""Landmarks further apart than this are not interpolated between."""


def observe(
    markers: Markers, prior: PosePrior, landmarks: Landmarks | None, body: Body, offset: float, rate_ratio: float
) -> tuple[Observations, Points]:
    """What a fit is given.

    Parameters
    ----------
    offset, rate_ratio : marker time = rate_ratio * video time + offset, s

    Returns
    -------
    Observations of all T frames, and the (L) body points that the landmarks show
    """
    wanted = (markers.time - offset) / rate_ratio
    rotations, tracked = on_clock(prior, markers.time, offset, rate_ratio)
    if landmarks is None:
        none = np.zeros((len(wanted), 0))
        points = Points.none(body.shape_count)
        image = none[..., None].repeat(2, -1)
        return Observations(markers.positions, rotations, tracked, image, none, (0, 0), _shape(prior, body)), points
    points, column = landmark_points(body)
    seen = _covered(landmarks.time, landmarks.tracked, wanted)
    used = landmarks.tracked
    image = _at(landmarks.time[used], landmarks.image[used][:, column], wanted)
    visibility = np.clip(_at(landmarks.time[used], landmarks.visibility[used][:, column], wanted), 0, 1)
    image[~seen] = np.nan
    size, shape = landmarks.image_size, _shape(prior, body)
    return Observations(markers.positions, rotations, tracked, image, visibility, size, shape), points


def _shape(prior: PosePrior, body: Body) -> np.ndarray | None:
    """The video's shape coefficients that the body has too; None where they belong to another kind of body."""
    if prior.betas is None or not prior.kind or prior.kind != body.kind:
        return None
    return prior.betas[: body.betas_count]


def on_clock(prior: PosePrior, time: np.ndarray, offset: float, rate_ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """The video's poses (T, 24, 3, 3) at times of the markers' clock, and where they were tracked (T,)."""
    wanted = (time - offset) / rate_ratio
    return slerp(prior.rotations, prior.time, wanted), _covered(prior.time, prior.tracked, wanted)


def _covered(times: np.ndarray, tracked: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(T,) True where both neighbouring video frames are tracked and near."""
    right = np.clip(np.searchsorted(times, wanted), 0, len(times) - 1)
    left = np.clip(right - 1, 0, None)
    left = np.where(np.abs(times[right] - wanted) < 1e-6, right, left)
    near = np.minimum(np.abs(times[left] - wanted), np.abs(times[right] - wanted)) <= _LONGEST_BRIDGE_S
    return tracked[left] & tracked[right] & near


def _at(times: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Linear interpolation over time of (F, ...) values."""
    flat = values.reshape(len(values), -1)
    return np.stack([np.interp(wanted, times, column) for column in flat.T], axis=1).reshape(
        len(wanted), *values.shape[1:]
    )
