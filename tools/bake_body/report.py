"""What the bake prints: how far joints were moved and how well ten numbers describe a body."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import INDEX
from tools.bake_body.shape_space import ShapeSpace

MOVED = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle", "foot", "hand")
"""Joints whose centres are anatomical, not the rig's."""


def report_joints(rigged: np.ndarray, joints: np.ndarray) -> None:
    """Anatomical less rigged centres, (N, 24, 3) m each."""
    print("joint centre, corrected less rig's, mean over the sample in mm (outward, up, forward; A-pose):")
    for name in MOVED:
        moved = (joints - rigged)[:, INDEX[f"left_{name}"]] * 1000
        mean, spread = moved.mean(axis=0), np.linalg.norm(moved.std(axis=0))
        print(f"  {name:9s}" + " ".join(f"{m:+6.1f}" for m in mean) + f"   sd {spread:.1f}")


def report_shapes(stature: np.ndarray, space: ShapeSpace, count: int) -> None:
    """Sample size, variance explained and residuals; the first ``count`` points of the space are skin."""
    spread = f"mean {stature.mean():.3f}, sd {stature.std():.3f}"
    print(f"{len(stature)} adults, stature {stature.min():.2f} to {stature.max():.2f} m, {spread}")
    shares = " ".join(f"{100 * share:.2f}" for share in space.explained)
    print(f"variance explained by 1..{len(space.explained)} components: {shares} %")
    for what, part in (("skin", space.residual[:, :count]), ("joints", space.residual[:, count:])):
        mean, high, most = 1000 * part.mean(), 1000 * np.percentile(part, 95), 1000 * part.max()
        print(f"residual of {what}: mean {mean:.2f}, 95 % {high:.2f}, max {most:.1f} mm")
