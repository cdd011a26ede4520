"""What the person of the embedded session wears: a colour for every vertex of the body."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX

SKIN, LIPS, HAIR, SHIRT = (214, 160, 130), (170, 92, 84), (60, 42, 32), (46, 92, 138)
SHORTS, SHOE, SOCK, WHITE, IRIS = (52, 52, 60), (200, 202, 205), (235, 235, 232), (238, 236, 232), (48, 34, 28)


def paint(body: Body, betas: np.ndarray) -> np.ndarray:
    """(V, 3) uint8 RGB."""
    skin, joints, marks = body.surface(betas), body.joints(betas), body.landmarks(betas)
    weights = body.weights
    colours = np.tile(np.array(SKIN, dtype=np.uint8), (len(skin), 1))

    def share(*bones: str) -> np.ndarray:
        return weights[:, [INDEX[bone] for bone in bones]].sum(axis=1)

    def near(mark: str, reach: float, squash: float = 1.0) -> np.ndarray:
        away = (skin - marks[mark]) * np.array([1.0, squash, 1.0])
        return np.linalg.norm(away, axis=1) < reach

    above_belt = share("pelvis", "spine1", "spine2", "spine3", "left_collar", "right_collar")
    above_belt = above_belt + share("left_shoulder", "right_shoulder")
    from_neck = np.linalg.norm((skin - joints[INDEX["neck"]] + np.array([0, 0.02, 0])) * np.array([1, 1.5, 1]), axis=1)
    sleeve = np.abs(skin[:, 0]) < np.abs(joints[INDEX["left_shoulder"], 0]) + 0.14
    colours[(above_belt > 0.5) & sleeve & (from_neck > 0.095) & (skin[:, 1] < joints[INDEX["neck"], 1])] = SHIRT
    hip, knee = joints[INDEX["left_hip"], 1], joints[INDEX["left_knee"], 1]
    legs = share("pelvis", "left_hip", "right_hip") > 0.5
    colours[legs & (skin[:, 1] < hip + 0.09) & (skin[:, 1] > knee + 0.14)] = SHORTS
    feet = share("left_ankle", "right_ankle", "left_foot", "right_foot") > 0.4
    ankle = joints[INDEX["left_ankle"], 1]
    shanks = share("left_knee", "right_knee") > 0.4
    colours[(feet | shanks) & (skin[:, 1] < ankle + 0.06)] = SOCK
    colours[feet & (skin[:, 1] < ankle + 0.01)] = SHOE

    head = share("head", "neck") > 0.6
    ear = 0.5 * (marks["bp_left_ear"] + marks["bp_right_ear"])
    eye = 0.5 * (marks["bp_left_eye"] + marks["bp_right_eye"])
    behind = (skin[:, 2] < ear[2] + 0.005) & (skin[:, 1] > ear[1] - 0.05)
    above = skin[:, 1] > eye[1] + 0.052 + 0.3 * np.maximum(0, ear[2] + 0.05 - skin[:, 2]) * -1
    colours[head & (behind | above)] = HAIR
    for side in ("left", "right"):
        colours[head & near(f"bp_{side}_eye", 0.015, 1.6)] = WHITE
        colours[head & near(f"bp_{side}_eye", 0.0075)] = IRIS
        brow = skin - marks[f"bp_{side}_eye"] - np.array([0, 0.020, 0])
        colours[head & (np.abs(brow[:, 0]) < 0.02) & (np.abs(brow[:, 1]) < 0.005) & (brow[:, 2] > -0.03)] = HAIR
    mouth = 0.5 * (marks["bp_mouth_left"] + marks["bp_mouth_right"])
    lips = skin - mouth
    colours[head & (np.hypot(lips[:, 0] / 0.026, lips[:, 1] / 0.010) < 1) & (lips[:, 2] > -0.03)] = LIPS
    return colours
