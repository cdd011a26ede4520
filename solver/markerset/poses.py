"""Poses in which a person is looked for, before anything is known of theirs: round figures, from no trial."""

from __future__ import annotations

from functools import cache

import numpy as np

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit import anatomical

_UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
_DEGREES: tuple[dict[str, tuple[float, float, float]], ...] = (
    # arms held out sideways, and forward
    {"left_shoulder": (0, 0, 0), "right_shoulder": (0, 0, 0)},
    {"left_shoulder": (0, -75, 0), "right_shoulder": (0, 75, 0), "left_elbow": (0, -20, 0), "right_elbow": (0, 20, 0)},
    # a deep squat, arms forward; sitting
    {
        "pelvis": (25, 0, 0),
        "left_hip": (-95, 0, 0), "right_hip": (-95, 0, 0), "left_knee": (105, 0, 0), "right_knee": (105, 0, 0),
        "left_ankle": (-30, 0, 0), "right_ankle": (-30, 0, 0),
        "left_shoulder": (0, -70, 0), "right_shoulder": (0, 70, 0),
    },
    {
        "left_hip": (-85, 0, 0), "right_hip": (-85, 0, 0), "left_knee": (90, 0, 0), "right_knee": (90, 0, 0),
    },
    # a step, either way
    {
        "left_hip": (-28, 0, 0), "right_hip": (12, 0, 0), "left_knee": (8, 0, 0), "right_knee": (20, 0, 0),
        "left_shoulder": (0, 15, -65), "right_shoulder": (0, 20, 65),
    },
    {
        "right_hip": (-28, 0, 0), "left_hip": (12, 0, 0), "right_knee": (8, 0, 0), "left_knee": (20, 0, 0),
        "left_shoulder": (0, -20, -65), "right_shoulder": (0, -15, 65),
    },
)  # fmt: skip
"""Rotation vectors of the joints that differ from the relaxed pose; +x bends the knees and hips backwards."""


@cache
def search_poses() -> np.ndarray:
    """(P, 24, 3, 3) parent-relative rotations, root upright in the internal lab frame (z up)."""
    poses = []
    for degrees in _DEGREES:
        pose = anatomical.mean_pose().copy()
        lean = exp_so3(np.radians(np.array(degrees.get("pelvis", (0, 0, 0)), dtype=float)))
        pose[0] = _UPRIGHT @ lean
        for joint, turn in degrees.items():
            if joint != "pelvis":
                pose[INDEX[joint]] = exp_so3(np.radians(np.array(turn, dtype=float)))
        poses.append(pose)
    return np.array(poses)
