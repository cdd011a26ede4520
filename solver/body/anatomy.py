"""Anatomical segment frames of a shaped body: what turns a model's joint rotations into clinical angles.

The joints' own frames are all parallel in the rest pose and mean nothing to a clinician. Here each segment gets an ISB
frame (X anterior, Y proximal, Z to the subject's right; Wu et al. 2002, 2005) from bony landmarks and joint centres of
the shaped body at rest, once; its columns are written in the rest body's axes (x left, y up, z forward).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from solver.body.skeleton import INDEX

UPRIGHT = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""The frame of a segment that stands square in the rest pose: X forward, Y up, Z right."""

SEGMENT_JOINT = {
    "pelvis": "pelvis",
    "thorax": "spine3",
    **{
        f"{side}_{segment}": f"{side}_{joint}"
        for side in ("left", "right")
        for segment, joint in {
            "thigh": "hip",
            "shank": "knee",
            "foot": "ankle",
            "upper_arm": "shoulder",
            "forearm": "elbow",
            "hand": "wrist",
        }.items()
    },
}
"""The joint whose rotation each segment follows."""


def segment_frames(
    landmarks: Mapping[str, np.ndarray], joints: np.ndarray, *, upright_trunk: bool, ulnar_forearm: bool = False
) -> dict[str, np.ndarray]:
    """Anatomical frame (3, 3) of every segment in the rest body's axes; columns X, Y, Z.

    Parameters
    ----------
    landmarks : (3,) m by name, shaped body at rest
    joints : (24, 3) m joint centres, likewise
    upright_trunk : take pelvis and thorax as they stand in the rest pose; else from iliac spines and from sternum and
        spine, as ISB says
    ulnar_forearm : let the forearm's long axis end at the ulnar styloid, as ISB says, not in the middle of the wrist
    """
    at = {name: joints[i] for name, i in INDEX.items()}
    frames = {"pelvis": UPRIGHT, "thorax": UPRIGHT} if upright_trunk else _trunk(landmarks)
    for side in ("left", "right"):

        def across(lateral: str, medial: str, side: str = side) -> np.ndarray:
            """From the medial to the lateral landmark on the right, the other way on the left: to the right."""
            axis = landmarks[f"{side}_{lateral}"] - landmarks[f"{side}_{medial}"]
            return axis if side == "right" else -axis

        knee_axis = across("knee_lateral", "knee_medial")
        frames[f"{side}_thigh"] = _along(at[f"{side}_hip"] - at[f"{side}_knee"], knee_axis)
        # The shank takes the knee's axis too: tibial torsion is not counted as a turn of knee and ankle.
        frames[f"{side}_shank"] = _along(at[f"{side}_knee"] - at[f"{side}_ankle"], knee_axis)
        frames[f"{side}_foot"] = _foot(landmarks[f"{side}_toe"] - landmarks[f"{side}_calcaneus"])
        elbow_axis = across("elbow_lateral", "elbow_medial")
        frames[f"{side}_upper_arm"] = _along(at[f"{side}_shoulder"] - at[f"{side}_elbow"], elbow_axis)
        wrist_axis = across("wrist_radius", "wrist_ulna")
        far = landmarks[f"{side}_wrist_ulna"] if ulnar_forearm else at[f"{side}_wrist"]
        frames[f"{side}_forearm"] = _along(at[f"{side}_elbow"] - far, wrist_axis)
        frames[f"{side}_hand"] = _along(at[f"{side}_wrist"] - at[f"{side}_hand"], wrist_axis)
    return frames


def _trunk(landmarks: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    right = _unit(landmarks["right_asis"] - landmarks["left_asis"])
    front = (landmarks["left_asis"] + landmarks["right_asis"] - landmarks["left_psis"] - landmarks["right_psis"]) / 2
    front = _unit(front - right * (front @ right))
    pelvis = np.stack([front, np.cross(right, front), right], axis=1)
    high = (landmarks["sternum_ij"] + landmarks["c7"]) / 2
    low = (landmarks["sternum_px"] + landmarks["t8"]) / 2
    ahead = landmarks["sternum_ij"] - landmarks["c7"]
    return {"pelvis": pelvis, "thorax": _along(high - low, np.cross(ahead, high - low))}


def _along(proximal: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Y along the segment, Z as near to ``right`` as that leaves."""
    y = _unit(proximal)
    z = _unit(right - y * (right @ y))
    return np.stack([np.cross(y, z), y, z], axis=1)


def _foot(forward: np.ndarray) -> np.ndarray:
    """X from heel to second toe along the sole, Y square to the sole, which stands flat in the rest pose."""
    up = np.array([0.0, 1, 0])
    x = _unit(forward - up * (forward @ up))
    return np.stack([x, up, np.cross(x, up)], axis=1)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
