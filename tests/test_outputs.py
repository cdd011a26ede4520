"""The names that markers get from the bones they sit on."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.report.outputs import labelled

FRAMES = 20
REACH = {"left_knee": (0.31, 0.05, 0.18), "right_hip": (0.02, 0.4)}
"""m from the joint, of each marker on its bone, in the order of the file."""


def fitted(shuffle: np.ndarray) -> tuple[Markers, FittedMotion, list[str]]:
    """Markers on two bones that swing about fixed joints, one that belongs to nobody, and the names to be given."""
    joints = np.zeros((FRAMES, 24, 3)) + np.arange(24)[:, None] * [0.1, 0.0, 0.05]
    swing = exp_so3(np.linspace(0, 1, FRAMES)[:, None] * np.array([0.3, 0.5, -0.2]))
    bone, placed, names = [], [], []
    for joint, reach in REACH.items():
        order = np.argsort(np.argsort(reach)) + 1
        for far, number in zip(reach, order, strict=True):
            bone.append(INDEX[joint])
            placed.append(joints[:, INDEX[joint]] + swing @ [far, 0, 0])
            names.append(f"{joint}:{number}")
    bone.append(-1)
    placed.append(np.full((FRAMES, 3), np.nan))
    names.append("unassigned_m9")
    where = np.stack(placed, axis=1)
    seen = np.where(np.isfinite(where), where, 7.0)
    labels = np.array(["m1", "m2", "m3", "m4", "m5", "m9"])
    markers = Markers(seen[:, shuffle], 50.0, tuple(labels[shuffle]))
    motion = FittedMotion(
        time=markers.time, rotations=np.tile(np.eye(3), (FRAMES, 24, 1, 1)), trans=np.zeros((FRAMES, 3)),
        betas=np.zeros(10), joints=joints, marker_joint=np.array(bone)[shuffle],
        marker_vertex=np.zeros(6, dtype=int), placed=where[:, shuffle], residual=np.zeros((FRAMES, 6)),
        camera=CameraResult(np.eye(3), np.zeros(3), 900.0, (640, 480), 4.0), chosen=0, confidence=0.9, warnings=(),
    )  # fmt: skip
    return markers, motion, [names[i] for i in shuffle]


@pytest.mark.parametrize("seed", range(4))
def test_markers_are_numbered_from_their_joint_outwards_whatever_the_files_order(seed: int) -> None:
    markers, motion, names = fitted(np.random.default_rng(seed).permutation(6))
    named = labelled(markers, motion)
    bones = {"left_knee": "left_shank", "right_hip": "right_thigh"}
    expected = tuple(name if ":" not in name else "{}_{}".format(bones[name.split(":")[0]], name.split(":")[1])
                     for name in names)  # fmt: skip
    assert named.labels == expected
    np.testing.assert_array_equal(named.positions, markers.positions)
