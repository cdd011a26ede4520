"""Bone lengths as extra shape coefficients, for any body in SMPL layout.

Shape components learnt from a population tie limb lengths together; a real subject's do not obey exactly. Each mode
here lengthens one kind of bone, on both sides alike, by a few per cent per unit coefficient.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, descendants


@dataclass(frozen=True)
class BoneMode:
    """One way bones may differ from the learnt shapes: which bones (joint, child) stretch, and how much a unit is."""

    name: str
    bones: tuple[tuple[str, str], ...]
    share: float


def _both(joint: str, child: str) -> tuple[tuple[str, str], ...]:
    return tuple((f"{side}_{joint}" if joint != "pelvis" else joint, f"{side}_{child}") for side in ("left", "right"))


MODES = (
    BoneMode("thigh", _both("hip", "knee"), 0.03),
    BoneMode("shank", _both("knee", "ankle"), 0.03),
    BoneMode("foot", _both("ankle", "foot"), 0.03),
    BoneMode("upper_arm", _both("shoulder", "elbow"), 0.05),
    BoneMode("forearm", _both("elbow", "wrist"), 0.05),
    BoneMode("trunk", (("pelvis", "spine1"), ("spine1", "spine2"), ("spine2", "spine3")), 0.03),
    BoneMode("shoulder_width", _both("collar", "shoulder"), 0.04),
    BoneMode("hip_width", _both("pelvis", "hip"), 0.05),
)
"""Spreads are a few per cent: what a 10-component shape space leaves of adult segment-length variation."""


@lru_cache(maxsize=4)
def with_bone_lengths(body: Body) -> Body:
    """The same body with the coefficients of ``MODES`` appended to its betas."""
    vertex_modes, joint_modes = zip(*(_mode(body, mode) for mode in MODES), strict=True)
    return replace(
        body,
        shape_dirs=np.concatenate([body.shape_dirs, np.stack(vertex_modes, -1)], axis=2),
        joint_dirs=np.concatenate([body.joint_dirs, np.stack(joint_modes, -1)], axis=2),
        _torch={},
    )


def load_body(path: str | Path | None = None) -> Body:
    """The body of a file, or the embedded one, with free bone lengths: what every solve fits and every export poses.

    Raises
    ------
    InputError : the file cannot be read, or holds no body
    """
    return with_bone_lengths(Body.load(path))


def _mode(body: Body, mode: BoneMode) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) and (24, 3) m moved by a unit of one mode."""
    vertices, joints = np.zeros_like(body.template), np.zeros_like(body.joint_template)
    for joint_name, child_name in mode.bones:
        joint, child = INDEX[joint_name], INDEX[child_name]
        bone = body.joint_template[child] - body.joint_template[joint]
        stretch = mode.share * bone
        moved = descendants()[child]
        joints[moved] += stretch
        # Skin of the bone itself is stretched along it; skin beyond its far end moves whole.
        along = np.clip((body.template - body.joint_template[joint]) @ bone / (bone @ bone), 0, 1)
        vertices += body.weights[:, moved].sum(1)[:, None] * stretch
        if joint_name != "pelvis":
            vertices += (body.weights[:, joint] * along)[:, None] * stretch
    return vertices, joints
