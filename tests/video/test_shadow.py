"""What poses without a video would have looked like."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.landmarks import LANDMARKS
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.fit.shadow import landmarks_of_prior


def test_a_raised_arm_goes_up_in_the_picture_and_lost_frames_show_nothing() -> None:
    frames = 5
    rotations = np.tile(np.eye(3), (frames, len(JOINTS), 1, 1))
    rotations[:, 0] = np.diag([1.0, -1, -1])  # upright and facing the camera
    lift = np.linspace(0, np.pi / 2, frames)
    rotations[:, INDEX["left_shoulder"]] = exp_so3(np.stack([0 * lift, 0 * lift, lift], axis=1))
    tracked = np.array([True, True, False, True, True])
    prior = PosePrior(rotations, tracked, np.arange(frames) / 25)
    seen = landmarks_of_prior(prior, Body.load())
    np.testing.assert_array_equal(seen.tracked, tracked)
    np.testing.assert_array_equal(seen.time, prior.time)
    assert np.isnan(seen.image[2]).all() and (seen.visibility[2] == 0).all()
    left, right = (seen.image[tracked, LANDMARKS.index(f"{side}_wrist")] for side in ("left", "right"))
    assert (np.diff(left[:, 1]) < -20).all(), "up is towards smaller y"
    np.testing.assert_allclose(np.diff(right, axis=0), 0, atol=1e-9)
    assert (left[:, 0] > right[:, 0]).all(), "who faces the camera has the left hand on its right"
