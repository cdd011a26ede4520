"""Anatomical segment frames of a shaped body: what turns a model's joint rotations into clinical angles.

The joints' own frames are all parallel in the rest pose and mean nothing to a clinician. Here each segment gets an ISB
frame (X anterior, Y proximal, Z to the subject's right; Wu et al. 2002, 2005) from bony landmarks and joint centres of
the shaped body at rest, once; its columns are written in the rest body's axes (x left, y up, z forward).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from markerscope.solver.core.skeleton import INDEX

UPRIGHT = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""The frame of a segment that stands square in the rest pose: X forward, Y up, Z right."""

_MIRROR = np.array([1.0, 1, -1])

MODEL_THORAX = {
    "c7": (-0.074, 0.414),
    "t8": (-0.097, 0.222),
    "sternum_ij": (0.026, 0.379),
    "sternum_px": (0.088, 0.200),
}
"""m forward and up in the torso of Rajagopal et al. (2016): spinous processes, jugular notch and end of the sternum,
read off the bones ``hat_spine`` and ``hat_ribs_scap``, and 10 mm of skin behind, 5 on the notch, 8 on the xiphoid."""

MODEL_HUMERUS = {
    "elbow": (0.013144, -0.286273, -0.009595),
    "elbow_lateral": (0.0106, -0.2800, 0.0243),
    "elbow_medial": (0.0027, -0.2796, -0.0327),
}
"""m forward, up and to the right of the shoulder in the right humerus of Rajagopal et al. (2016): its elbow, and the
epicondyles of its bone ``humerus_rv``. Their line points 8 degrees forward of the model's Z axis."""

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
    landmarks: Mapping[str, np.ndarray],
    joints: np.ndarray,
    *,
    pelvis: Literal["upright", "spines"],
    thorax: Literal["model", "isb"],
    upper_arm: Literal["model", "epicondyles"] = "epicondyles",
    forearm: Literal["wrist", "ulna"] = "wrist",
) -> dict[str, np.ndarray]:
    """Anatomical frame (3, 3) of every segment in the rest body's axes; columns X, Y, Z.

    Parameters
    ----------
    landmarks : (3,) m by name, shaped body at rest
    joints : (24, 3) m joint centres, likewise
    pelvis : as it stands in the rest pose, or in the plane of the iliac spines (ISB)
    thorax : as OpenSim's model has it on its bones, laid over C7, T8, jugular notch and xiphoid; or along the line
        between the middles of these (ISB)
    upper_arm : as OpenSim's model has it, or along the epicondyles (ISB)
    forearm : its long axis ends in the middle of the wrist, or at the ulnar styloid (ISB)
    """
    at = {name: joints[i] for name, i in INDEX.items()}
    frames = {
        "pelvis": UPRIGHT if pelvis == "upright" else _pelvis(landmarks),
        "thorax": _model_thorax(landmarks) if thorax == "model" else _thorax(landmarks),
    }
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
        arm = _along(at[f"{side}_shoulder"] - at[f"{side}_elbow"], elbow_axis)
        frames[f"{side}_upper_arm"] = arm @ _model_arm(side) if upper_arm == "model" else arm
        wrist_axis = across("wrist_radius", "wrist_ulna")
        far = landmarks[f"{side}_wrist_ulna"] if forearm == "ulna" else at[f"{side}_wrist"]
        frames[f"{side}_forearm"] = _along(at[f"{side}_elbow"] - far, wrist_axis)
        frames[f"{side}_hand"] = _along(at[f"{side}_wrist"] - at[f"{side}_hand"], wrist_axis)
    return frames


def _pelvis(landmarks: Mapping[str, np.ndarray]) -> np.ndarray:
    right = _unit(landmarks["right_asis"] - landmarks["left_asis"])
    front = (landmarks["left_asis"] + landmarks["right_asis"] - landmarks["left_psis"] - landmarks["right_psis"]) / 2
    front = _unit(front - right * (front @ right))
    return np.stack([front, np.cross(right, front), right], axis=1)


def _thorax(landmarks: Mapping[str, np.ndarray]) -> np.ndarray:
    high = (landmarks["sternum_ij"] + landmarks["c7"]) / 2
    low = (landmarks["sternum_px"] + landmarks["t8"]) / 2
    ahead = landmarks["sternum_ij"] - landmarks["c7"]
    return _along(high - low, np.cross(ahead, high - low))


def _model_thorax(landmarks: Mapping[str, np.ndarray]) -> np.ndarray:
    """Turned in the body's median plane by what lays the model's four points over the body's best (least squares)."""
    model = np.array(list(MODEL_THORAX.values()))
    body = np.stack([landmarks[name] @ UPRIGHT for name in MODEL_THORAX])[:, :2]
    (forward, up), (x, y) = (model - model.mean(axis=0)).T, (body - body.mean(axis=0)).T
    cos, sin = _unit(np.array([(forward * x + up * y).sum(), (forward * y - up * x).sum()]))
    return UPRIGHT @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def _model_arm(side: str) -> np.ndarray:
    """The model's humerus seen from the frame that its elbow and epicondyles make; mirrored on the left."""
    elbow, lateral, medial = (np.array(point) for point in MODEL_HUMERUS.values())
    seen = _along(-elbow, lateral - medial).T
    return seen if side == "right" else _MIRROR[:, None] * seen * _MIRROR


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
    return vector / np.sqrt(vector @ vector)  # a complex step goes through it, which no absolute value lets pass
