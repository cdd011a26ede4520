"""Joint angles of the fitted body, in the convention that the user's other programs speak."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np

from resources import resource
from solver.body.anatomy import SEGMENT_JOINT, segment_frames
from solver.body.skeleton import INDEX, PARENTS
from solver.markers import lab_rotation

Convention = Literal["opensim", "isb", "gait2392", "visual3d", "plugin-gait"]

_PAIRS = {
    "pelvis": ("", "pelvis"),
    "hip": ("pelvis", "thigh"),
    "knee": ("thigh", "shank"),
    "ankle": ("shank", "foot"),
    "trunk": ("pelvis", "thorax"),
    "shoulder": ("thorax", "upper_arm"),
    "elbow": ("upper_arm", "forearm"),
    "wrist": ("forearm", "hand"),
}
"""Proximal and distal segment of each joint; the pelvis is read in the lab."""
_MIDLINE = ("", "pelvis", "thorax")
_MIRROR = np.array([1.0, 1, -1])
_SINGULAR_DEG = 4.0


@dataclass(frozen=True)
class AngleSettings:
    """How angles are read off.

    Attributes
    ----------
    convention : names, sequences and signs
    """

    convention: Convention = "opensim"


@dataclass(frozen=True)
class JointAngles:
    """Joint angles over time.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    names : A column names
    degrees : (T, A), unwrapped over time
    singular : (T, A) True where the sequence cannot tell this angle from another: its value means nothing there
    convention, title : which convention, and what it is
    sequence : A, the intrinsic sequence that each angle is part of
    positive : A, what a positive value means
    zero_pose : what the angles are counted from
    """

    time: np.ndarray
    names: tuple[str, ...]
    degrees: np.ndarray
    singular: np.ndarray
    convention: str
    title: str
    sequence: tuple[str, ...]
    positive: tuple[str, ...]
    zero_pose: str


@cache
def conventions() -> dict[str, Any]:
    """Every convention, as ``resources/angle_conventions.toml`` has it."""
    return tomllib.loads(resource("angle_conventions.toml").read_text(encoding="utf-8"))


def joint_angles(
    time: np.ndarray, rotations: np.ndarray, landmarks: Mapping[str, np.ndarray], joints: np.ndarray,
    settings: AngleSettings,
) -> JointAngles:
    """Angles of a posed body.

    Parameters
    ----------
    time : (T,) s
    rotations : (T, 24, 3, 3) root in the internal lab frame, others relative to the parent
    landmarks, joints : of the shaped body at rest, m
    settings : which convention
    """
    convention = conventions()[settings.convention]
    frames = segment_frames(landmarks, joints, upright_trunk=convention["pelvis"] == "upright")
    turn = world_rotations(rotations)
    segments = {name: turn[:, INDEX[SEGMENT_JOINT[name]]] @ frame for name, frame in frames.items()}
    # The lab as OpenSim has it: X along the internal x, Y up.
    segments[""] = np.broadcast_to(lab_rotation("y").T, (len(turn), 3, 3))
    columns: list[tuple[str, np.ndarray, np.ndarray, str, str]] = []
    for joint, row in convention["joints"].items():
        for side in ("",) if set(_PAIRS[joint]) <= set(_MIDLINE) else ("right", "left"):
            near, far = (name if name in _MIDLINE else f"{side}_{name}" for name in _PAIRS[joint])
            relative = np.swapaxes(segments[near], -1, -2) @ segments[far]
            if side == "left" and convention["mirror"]:
                relative = _MIRROR[:, None] * relative * _MIRROR
            angles, singular = cardan(relative, row["sequence"])
            for k, name in enumerate(row["columns"]):
                if name:
                    named = name.format(s=side[:1], S=side[:1].upper())
                    columns.append((named, row["signs"][k] * angles[:, k], singular[:, k], row["sequence"], row["positive"][k]))
    names, values, flags, sequences, positive = zip(*columns, strict=True)
    return JointAngles(
        time=time,
        names=names,
        degrees=np.stack(values, axis=1),
        singular=np.stack(flags, axis=1),
        convention=settings.convention,
        title=convention["title"],
        sequence=sequences,
        positive=positive,
        zero_pose=convention["zero_pose"],
    )


def world_rotations(rotations: np.ndarray) -> np.ndarray:
    """(T, 24, 3, 3) rotation of every joint in the lab, from parent-relative ones."""
    turn = rotations.copy()
    for j in range(1, rotations.shape[1]):
        turn[:, j] = turn[:, PARENTS[j]] @ rotations[:, j]
    return turn


def cardan(rotations: np.ndarray, sequence: str) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsic angles (T, 3) in degrees, unwrapped over time, and (T, 3) True where they are not defined.

    For a sequence that begins and ends with the same axis the middle angle is taken as negative, as ISB does for the
    shoulder. Near a singularity the first and the third angle cannot be told apart; the middle one stays good.
    """
    import warnings

    from scipy.spatial.transform import Rotation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gimbal lock is flagged below
        angles = Rotation.from_matrix(rotations).as_euler(sequence, degrees=True)
    same = sequence[0] == sequence[2]
    if same:
        angles = np.stack([angles[:, 0] + 180, -angles[:, 1], angles[:, 2] + 180], axis=1)
    distance = np.abs(np.sin(np.radians(angles[:, 1]))) if same else np.abs(np.cos(np.radians(angles[:, 1])))
    lost = distance < np.sin(np.radians(_SINGULAR_DEG))
    singular = np.stack([lost, np.zeros_like(lost), lost], axis=1)
    good = ~lost
    for k in (0, 2):
        known = np.flatnonzero(good)
        if len(known):
            angles[known, k] = np.unwrap(angles[known, k], period=360)
            # the turn that starts nearest to zero
            angles[known, k] -= 360 * np.round(np.median(angles[known, k]) / 360)
    return angles, singular
