"""How far joints turn in people: a weak prior for what neither markers nor video say.

Spreads are round figures from common ranges of motion (knee and elbow are hinges, the spine shares its bend over
three joints), in the rest body's axes: x to the subject's left, y up, z forward. They are not learnt from any trial.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS

_DEGREES = {
    "pelvis": (1e4, 1e4, 1e4),
    "hip": (45, 18, 18),
    "knee": (60, 10, 4),
    "ankle": (22, 12, 12),
    "foot": (10, 4, 4),
    "spine1": (14, 8, 8),
    "spine2": (14, 8, 8),
    "spine3": (14, 8, 8),
    "neck": (18, 18, 14),
    "head": (14, 16, 12),
    "collar": (5, 10, 10),
    "shoulder": (50, 50, 50),
    "elbow": (30, 70, 8),
    "wrist": (10, 15, 22),
    "hand": (5, 5, 5),
}
_MEAN = {  # rotation vectors, degrees: arms hang, knees and elbows rest slightly bent
    "left_shoulder": (0, 0, -55),
    "right_shoulder": (0, 0, 55),
    "left_knee": (20, 0, 0),
    "right_knee": (20, 0, 0),
    "left_hip": (-15, 0, 0),
    "right_hip": (-15, 0, 0),
    "left_elbow": (0, -30, 0),
    "right_elbow": (0, 30, 0),
}


@cache
def spread() -> np.ndarray:
    """(24, 3) rad, how far each joint commonly turns from ``mean_pose`` about each axis."""
    kinds = [name.removeprefix("left_").removeprefix("right_") for name in JOINTS]
    return np.radians(np.array([_DEGREES[kind] for kind in kinds], dtype=float))


@cache
def mean_pose() -> np.ndarray:
    """(24, 3, 3) a relaxed standing pose."""
    vectors = np.zeros((len(JOINTS), 3))
    for name, vector in _MEAN.items():
        vectors[INDEX[name]] = np.radians(vector)
    return exp_so3(vectors)
