"""The relaxed pose and the usual ranges: what a person would say of them."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from markerscope.solver.fit.anatomical import mean_pose, spread


def test_arms_hang_elbows_and_knees_are_slightly_bent_the_way_they_bend() -> None:
    body = Body.load()
    _, joints = body.pose(mean_pose()[None], np.zeros(10), np.zeros((1, 3)), want_vertices=False)
    at = {name: joints[0, i] for name, i in INDEX.items()}  # x left, y up, z forward
    for side, left in (("left", 1), ("right", -1)):
        upper, fore = (
            at[f"{side}_elbow"] - at[f"{side}_shoulder"],
            at[f"{side}_wrist"] - at[f"{side}_elbow"],
        )
        assert upper[1] < -0.7 * np.linalg.norm(upper), "hanging"
        assert left * upper[0] > 0, "beside the trunk, not through it"
        bend = np.degrees(np.arccos(upper @ fore / np.linalg.norm(upper) / np.linalg.norm(fore)))
        assert bend == pytest.approx(30, abs=8)
        assert fore[2] > upper[2] + 0.05, "an elbow brings the hand forward"
        thigh, shank = at[f"{side}_knee"] - at[f"{side}_hip"], at[f"{side}_ankle"] - at[f"{side}_knee"]
        assert thigh[2] > 0.05, "thighs forward"
        assert shank[2] < thigh[2] - 0.1, "a knee brings the foot back"
        assert np.degrees(np.arctan2(-shank[2], -shank[1])) < 15, "and the shank stays near to upright"


def test_both_sides_are_alike_and_each_joint_turns_most_about_its_own_axis() -> None:
    mirror, vectors, ranges = mirror_index(), log_so3(mean_pose()), np.degrees(spread())
    np.testing.assert_allclose(vectors[mirror], vectors * [1, -1, -1], atol=1e-12)
    np.testing.assert_array_equal(ranges[mirror], ranges)
    main = {name: "xyz"[int(np.argmax(ranges[i]))] for i, name in enumerate(JOINTS)}
    for joint, axis in (("hip", "x"), ("knee", "x"), ("ankle", "x"), ("elbow", "y"), ("wrist", "z")):
        assert main[f"left_{joint}"] == axis, joint
    np.testing.assert_allclose(ranges[INDEX["left_knee"]], [60, 10, 4])
    assert ranges[0].min() > 1000, "which way a person faces is not a habit"
    assert ranges[1:].max() <= 70
