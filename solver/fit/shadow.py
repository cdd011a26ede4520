"""Landmarks for a pose prior that came without a video: the body's own points, seen from straight ahead."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.fit.kinematics import Pose, forward, place_points
from markerscope.solver.fit.lift import landmark_points

_PX_PER_M = 500.0


def landmarks_of_prior(prior: PosePrior, body: Body) -> Landmarks:
    """What synchronisation can compare with the markers where there are poses but no video.

    The root stays where it is, so only the limbs' movement about it shows; the view is orthographic.
    """
    points, column = landmark_points(body)
    count = len(prior.time)
    pose = Pose(prior.rotations, np.zeros((count, 3)), np.zeros(body.shape_count))
    world = np.full((count, len(LANDMARKS), 3), np.nan)
    world[:, column] = place_points(points, forward(body, pose), pose.betas)
    visibility = np.isfinite(world[..., 0]) * prior.tracked[:, None].astype(float)
    image = world[..., :2] * _PX_PER_M
    image[~prior.tracked] = world[~prior.tracked] = np.nan
    return Landmarks(image, world, visibility, prior.tracked, prior.time, np.arange(count), (1000, 1000), prior.source)
