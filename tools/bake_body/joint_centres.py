"""Anatomical joint centres in place of the rig's, from landmarks and published regressions, body by body.

======== =====================================================================================================
hip      Harrington et al. 2007 (J Biomech 40:595), from the pelvis' place and tilt on the mesh and its average size
knee     midway between the femoral epicondyles (ISB, Wu et al. 2002)
ankle    10 mm below the point midway between the malleoli where they stand out most: there the ankle's axis passes,
         just below the tips of both (Isman and Inman 1969, Bull Prosthet Res 10-11:97). In the model of Rajagopal et
         al. 2016 (IEEE Trans Biomed Eng 63:2068) it is 11 mm below the middle of the malleolar markers and 14 below
         that of the bones; Winter (Biomechanics and Motor Control of Human Movement) has the ankle at 0.039 of
         stature, 13 mm below that middle
foot     midway between back and sole of the foot at the head of the second metatarsal
shoulder centre of rotation under the acromion. In the model of Rajagopal et al. 2016 it lies 33 mm below the top of
         the acromion's bone, 3 mm lateral of its edge and 14 mm in front of that; with 4 mm of skin this is 10 % of an
         average biacromial width of 380 mm down and 1 % outward. Forward it stays at 2 %, 8 mm, as the acromion's
         landmark lies above the middle of the bone. de Leva 1996 (J Biomech 29:1223) has 35 mm down
elbow    on the axis of flexion, which passes in front of and below the line through the humeral epicondyles: from
         midway between them 2.3 % of the upper arm's length to the front and as much down, 1.9 % to the medial side, as
         the elbow of Rajagopal et al. 2016 lies to the epicondyles of its humerus (6.5, 6.5, 5.4 of 280 mm). Stokdijk
         et al. 1999 (Clin Biomech 14:177) found it in front of the lateral epicondyle in ten arms, too
wrist    midway between the radial and ulnar styloids (ISB, Wu et al. 2005)
hand     head of the third metacarpal, two fifths of the way from the back of the hand to the palm
======== =====================================================================================================
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import INDEX
from tools.bake_body.picker import Landmark

PELVIS_WIDTH, PELVIS_DEPTH = 0.140, 0.092
"""Over stature: between the front iliac spines (237 mm at 1.69 m), and from their middle to that of the rear ones."""
MIDWAY = (
    ("knee", "knee_lateral", "knee_medial"),
    ("ankle", "ankle_lateral", "ankle_medial"),
    ("foot", "toe", "toe_plantar"),
    ("elbow", "elbow_lateral", "elbow_medial"),
    ("wrist", "wrist_radius", "wrist_ulna"),
    ("hand", "hand_meta3", "hand_meta3_palmar"),
)
"""Joints between two landmarks each."""
KNUCKLE = 0.4
"""How deep the head of the third metacarpal lies between back and palm of the hand, which is padded."""
SHOULDER = {"outward": 0.01, "down": 0.10, "forward": 0.02}
"""Shoulder from the acromion, over the biacromial width."""
ELBOW = {"forward": 0.023, "down": 0.023, "medial": 0.019}
"""Elbow from midway between the epicondyles, over the length of the upper arm."""
ANKLE_DOWN = 0.006
"""Ankle from midway between the malleoli, over stature: 10 mm."""


def correct(joints: np.ndarray, vertices: np.ndarray, landmarks: dict[str, Landmark]) -> np.ndarray:
    """(N, 24, 3) anatomical joint centres of bodies (N, V, 3) in the A-pose, y up, facing +z."""
    moved = joints.copy()
    at = {name: landmark.of(vertices) for name, landmark in landmarks.items()}
    stature = np.ptp(vertices[..., 1], axis=1)
    hips = hip_centres(at["left_asis"], at["right_asis"], at["left_psis"], at["right_psis"], stature)
    width = np.linalg.norm(at["left_acromion"] - at["right_acromion"], axis=-1)
    for i, (side, sign) in enumerate((("left", 1.0), ("right", -1.0))):
        moved[:, INDEX[f"{side}_hip"]] = hips[i]
        for joint, one, other in MIDWAY:
            share = KNUCKLE if joint == "hand" else 0.5
            start, end = at[f"{side}_{one}"], at[f"{side}_{other}"]
            moved[:, INDEX[f"{side}_{joint}"]] = start + share * (end - start)
        moved[:, INDEX[f"{side}_ankle"], 1] -= ANKLE_DOWN * stature
        offset = np.array([sign * SHOULDER["outward"], -SHOULDER["down"], SHOULDER["forward"]])
        moved[:, INDEX[f"{side}_shoulder"]] = at[f"{side}_acromion"] + width[:, None] * offset
        lateral = at[f"{side}_elbow_lateral"] - at[f"{side}_elbow_medial"]
        moved[:, INDEX[f"{side}_elbow"]] = elbow_centre(
            moved[:, INDEX[f"{side}_shoulder"]], moved[:, INDEX[f"{side}_elbow"]], lateral, sign
        )
    moved[:, 0] += (moved[:, [1, 2]] - joints[:, [1, 2]]).mean(axis=1) / 2
    return moved


def elbow_centre(shoulder: np.ndarray, middle: np.ndarray, lateral: np.ndarray, sign: float) -> np.ndarray:
    """(N, 3) m, from midway between the epicondyles; ``lateral`` points from the medial one, sign is 1 on the left."""
    length = np.linalg.norm(middle - shoulder, axis=-1, keepdims=True)
    down = (middle - shoulder) / length
    outward = _unit(lateral - down * np.sum(lateral * down, axis=-1, keepdims=True))
    forward = sign * np.cross(down, outward)
    return middle + length * (ELBOW["forward"] * forward + ELBOW["down"] * down - ELBOW["medial"] * outward)


def hip_centres(
    left_asis: np.ndarray, right_asis: np.ndarray, left_psis: np.ndarray, right_psis: np.ndarray, stature: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Left and right hip joint centres (N, 3) m by Harrington et al. (2007), from iliac spines (N, 3) m on the skin.

    The spines' skin says where the pelvis is and how it is turned; its size is taken from the stature (N,) m, since
    the span between points of the skin grows with fat: by 14 mm across and 35 mm in depth per standard deviation of
    the body mass index. Soft tissue is taken to be as thick in front as behind.
    """
    width, depth = PELVIS_WIDTH * stature[:, None], PELVIS_DEPTH * stature[:, None]
    front_middle, back_middle = (left_asis + right_asis) / 2, (left_psis + right_psis) / 2
    right = _unit(right_asis - left_asis)
    front = front_middle - back_middle
    front = _unit(front - right * np.sum(front * right, axis=-1, keepdims=True))
    up = np.cross(right, front)
    middle = (front_middle + back_middle) / 2
    middle = middle + front * (depth / 2 - 0.24 * depth - 0.0099) - up * (0.30 * width + 0.0109)
    aside = right * (0.33 * width + 0.0073)
    return middle - aside, middle + aside


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
