"""The curves of the usual page of gait: pelvis and foot against the direction of progression, joints between segments.

Names, sequences and signs of pelvis, hip, knee, ankle and trunk are those of the convention ``plugin-gait``. Its
progression frame is the lab, turned in quarter turns; here it is the way that the pelvis goes, so that a walk across
the lab reads the same as one along it. The foot progression angle is that of the line from heel to toe on the floor
against that way, toes in positive, as Plug-in Gait counts it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from markerscope.solver.angles.angles import AngleSettings, conventions, read_angles
from markerscope.solver.body.anatomy import SEGMENT_JOINT, segment_frames
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.cycles.curve import Curve
from markerscope.solver.events.feet import Feet
from markerscope.solver.events.steps import heading

NAMES = {
    "PelvisAnglesX": "pelvic_tilt",
    "PelvisAnglesY": "pelvic_obliquity",
    "PelvisAnglesZ": "pelvic_rotation",
    "HipAnglesX": "hip_flexion",
    "HipAnglesY": "hip_adduction",
    "HipAnglesZ": "hip_rotation",
    "KneeAnglesX": "knee_flexion",
    "KneeAnglesY": "knee_varus",
    "KneeAnglesZ": "knee_rotation",
    "AnkleAnglesX": "ankle_dorsiflexion",
    "AnkleAnglesY": "ankle_inversion",
    "AnkleAnglesZ": "ankle_rotation",
    "SpineAnglesX": "trunk_flexion",
    "SpineAnglesY": "trunk_bending",
    "SpineAnglesZ": "trunk_rotation",
}
FOOT = "foot_progression"
_STRAIGHT = 0.95
_LEAST_WAY_M = 0.8
_SIDES = {"R": "right", "L": "left"}


def progression(feet: Feet) -> tuple[np.ndarray, str]:
    """(T, 2) unit vectors of the way that somebody goes, and in words how it was taken.

    Where the way is straight, one direction for all of it: from where the pelvis was at first to where it came.
    """
    ahead = heading(feet.pelvis, list(feet.sides.values()), feet.rate)
    known = np.isfinite(feet.pelvis[:, :2]).all(axis=1)
    path = feet.pelvis[known, :2]
    if len(path) > 2:
        way = path[-1] - path[0]
        length = float(np.linalg.norm(way))
        steps = max(1, round(0.5 * feet.rate))  # a sway from side to side is no way
        walked = float(np.linalg.norm(np.diff(path[::steps], axis=0), axis=1).sum())
        if length > _LEAST_WAY_M and length > _STRAIGHT * walked:
            return np.broadcast_to(way / length, ahead.shape).copy(), "one direction, the way of the pelvis"
    return ahead, "the way of the pelvis over a second, or where the feet point while it stays in place"


def gait_curves(
    time: np.ndarray,
    turn: np.ndarray,
    landmarks: Mapping[str, np.ndarray],
    rest: np.ndarray,
    ahead: np.ndarray,
) -> tuple[Curve, ...]:
    """Curves of both sides in degrees.

    Parameters
    ----------
    time : (T,) s
    turn : (T, 24, 3, 3) rotations of all joints in the lab, z up
    landmarks, rest : of the shaped body at rest, m
    ahead : (T, 2) the direction of progression
    """
    convention = conventions()["plugin-gait"]
    frames = segment_frames(
        landmarks, rest, **{name: convention[name] for name in ("pelvis", "thorax", "upper_arm", "forearm")}
    )
    segments = {name: turn[:, INDEX[SEGMENT_JOINT[name]]] @ frame for name, frame in frames.items()}
    if np.nanmean(np.einsum("tk,tk->t", segments["pelvis"][:, :2, 0], ahead)) < 0:
        ahead = -ahead  # who walks backwards is read as facing
    back = _about_vertical(ahead)
    segments = {name: back @ frame for name, frame in segments.items()}
    found = read_angles(time, segments, AngleSettings("plugin-gait"))
    curves = []
    for i, column in enumerate(found.names):
        name = NAMES.get(column[1:])
        if name is None:
            continue
        values = np.where(found.singular[:, i], np.nan, found.degrees[:, i])
        curves.append(Curve(name, _SIDES[column[0]], "degrees", time, values, column, found.positive[i]))
    for letter, side in _SIDES.items():
        along = segments[f"{side}_foot"][:, :2, 0]
        turned = np.degrees(np.arctan2(along[:, 1], along[:, 0]))
        values = turned if side == "right" else -turned
        curves.append(Curve(FOOT, side, "degrees", time, values, f"{letter}FootProgressAnglesZ", "toes in"))
    return tuple(curves)


def _about_vertical(ahead: np.ndarray) -> np.ndarray:
    """(T, 3, 3) turns the direction of progression onto the x axis."""
    out = np.zeros((len(ahead), 3, 3))
    out[:, 0, 0] = out[:, 1, 1] = ahead[:, 0]
    out[:, 0, 1], out[:, 1, 0] = ahead[:, 1], -ahead[:, 1]
    out[:, 2, 2] = 1
    return out
