"""Palpable bony landmarks and the points that BlazePose sees, picked by geometry on the mean body in the A-pose.

The mesh has no bones to palpate, so heights come from anthropometric surveys as fractions of stature (US Army
ANSUR 1988 and 2012; Winter, Biomechanics and Motor Control of Human Movement) where the surface shows no landmark,
and from the surface itself where it does (malleoli, epicondyles, heel, lips, eyelids). Every point is kept as a mean
of vertices, so that it follows the shape.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.skeleton import INDEX
from tools.bake_body.joint_centres import PELVIS_DEPTH, PELVIS_WIDTH
from tools.bake_body.picker import Landmark, Picker, mean

HEIGHTS = {
    "c7": 0.865,  # cervicale
    "t8": 0.750,
    "sternum_ij": 0.812,  # suprasternale
    "sternum_px": 0.700,
    "knee": 0.285,  # femoral epicondyles, at mid-patella
    "ankle_medial": 0.050,
    "ankle_lateral": 0.043,
    "calcaneus": 0.016,
    "heel": 0.006,
    "iliac_crest": 0.609,  # iliocristale
    "scapular_spine": 0.822,  # third thoracic vertebra: three eighths of the way from c7 to t8
}
"""Landmark heights as fractions of stature."""
SPINES_WIDTH = 0.053
"""Distance between the posterior superior iliac spines over stature."""
PELVIC_TILT = np.radians(10.0)
"""Forward tilt, in quiet standing, of the plane through the four iliac spines."""
SCAPULAR_SPINE_ASIDE = 0.049
"""Root of the scapula's spine from the midline, over stature: 83 mm of 1.70 m in Rajagopal et al. (2016)."""
CLAVICLE_ASIDE = 0.03
"""The inner third of the clavicle, over stature: 50 mm beside the midline. Its end at the sternum hardly moves."""
TIBIAL_TUBEROSITY, FIBULA_HEAD = 0.15, 0.14
"""How far below the knee's centre, over the length of the shank: 60 and 56 mm of 400 in Rajagopal et al. (2016)."""
FIBULA_BEHIND = np.radians(34)
"""Direction of the fibula's head from the shank's axis, behind lateral (the same)."""
BIACROMIAL = 0.2245
"""Distance between the acromia over stature."""
WRIST_BEYOND_RIG = 0.008
"""m on the mean body, from the rig's wrist to the line of the styloids, just past the narrowest forearm; this leaves
0.11 of stature for the hand."""
EAR_BELOW_EYE = 0.03
"""m on the mean body, from the eyes down to the middle of the ears."""
UP, FRONT, LEFT = np.eye(3)[[1, 2, 0]]


@dataclass(frozen=True)
class Mannequin:
    """The mean body in the A-pose: mesh, rig, and which joint each vertex goes with (its largest weight)."""

    picker: Picker
    bones: dict[str, np.ndarray]
    joints: np.ndarray
    dominant: np.ndarray
    inner: np.ndarray
    twin: np.ndarray

    @property
    def floor(self) -> float:
        """The height of the soles, m."""
        return float(self.picker.vertices[:, 1].min())

    @property
    def stature(self) -> float:
        """From soles to the top of the head, m."""
        return float(np.ptp(self.picker.vertices[:, 1]))

    def height(self, fraction: float) -> float:
        """The height of a fraction of stature, m in the mesh's axes."""
        return self.floor + fraction * self.stature

    def skin(self, *joints: str) -> np.ndarray:
        """(V,) bool: outer skin that moves with these joints."""
        return np.isin(self.dominant, [INDEX[name] for name in joints]) & ~self.inner

    def part(self, *joints: str) -> np.ndarray:
        """(F,) bool: faces of outer skin that move with these joints."""
        return self.skin(*joints)[self.picker.faces].all(axis=1)


def pick(body: Mannequin) -> dict[str, Landmark]:
    """Every landmark that is a point of the skin, by name, both sides."""
    left = _pelvis(body) | _leg(body) | _foot(body) | _arm(body) | _hand(body) | _face(body)
    found = _midline(body)
    for name, landmark in left.items():
        found[name.format(side="left")] = landmark
        found[name.format(side="right")] = landmark.mirrored(body.twin)
    spines = found["left_psis"].of(body.picker.vertices)
    trunk = body.part("pelvis", "spine1", "spine2")
    found["sacrum"] = body.picker.surface(np.array([0, spines[1], spines[2] / 2]), -FRONT, trunk)
    return found


def _midline(body: Mannequin) -> dict[str, Landmark]:
    trunk = body.part("pelvis", "spine1", "spine2", "spine3", "neck", "left_collar", "right_collar")
    head = body.skin("head")
    vertices = body.picker.vertices
    found = {}
    for name, direction in (("c7", -FRONT), ("t8", -FRONT), ("sternum_ij", FRONT), ("sternum_px", FRONT)):
        found[name] = body.picker.surface(np.array([0, body.height(HEIGHTS[name]), 0.02]), direction, trunk)
    for name, direction in (("head_top", UP), ("bp_nose", FRONT)):
        middle = head & (np.abs(vertices[:, 0]) < 1e-3)
        highest = np.argmax(np.where(middle, vertices @ direction, -np.inf))
        found[name] = Landmark((int(highest),), (1.0,))
    return found


def _pelvis(body: Mannequin) -> dict[str, Landmark]:
    """Iliac spines such that the hip joint centre predicted from them lies at the height of the rig's."""
    trunk = body.part("pelvis", "spine1", "spine2", "left_hip", "right_hip")
    width, hip = PELVIS_WIDTH * body.stature, body.joints[INDEX["left_hip"]]
    depth = PELVIS_DEPTH * body.stature
    behind = 0.24 * depth + 0.0099
    drop = (0.30 * width + 0.0109) * np.cos(PELVIC_TILT) - behind * np.sin(PELVIC_TILT)
    height = hip[1] + drop
    asis = body.picker.surface(np.array([width / 2, height, hip[2]]), FRONT, trunk)
    across = SPINES_WIDTH * body.stature / 2
    psis = body.picker.surface(np.array([across, height + depth * np.tan(PELVIC_TILT), 0]), -FRONT, trunk)
    crest = body.picker.surface(np.array([0, body.height(HEIGHTS["iliac_crest"]), 0]), LEFT, trunk)
    return {"{side}_asis": asis, "{side}_psis": psis, "{side}_iliac_crest": crest}


def _leg(body: Mannequin) -> dict[str, Landmark]:
    hip, knee, ankle = (body.joints[INDEX[f"left_{name}"]] for name in ("hip", "knee", "ankle"))
    limb = body.part("left_hip", "left_knee")
    height = body.height(HEIGHTS["knee"])
    along = (ankle - knee) / (ankle[1] - knee[1])
    middle = knee + (height - knee[1]) * along
    axis = (ankle - hip) / np.linalg.norm(ankle - hip)
    across = LEFT - axis * (axis @ LEFT)
    middle = _centred(body, middle, FRONT, limb)
    found = {
        "{side}_knee_lateral": body.picker.surface(middle, across, limb),
        "{side}_knee_medial": body.picker.surface(middle, -across, limb),
    }
    lower = body.part("left_knee", "left_ankle")
    shank = (ankle - knee) / np.linalg.norm(ankle - knee)
    outward = across - shank * (shank @ across)
    outward /= np.linalg.norm(outward)
    below = knee + (ankle - knee) * np.array([[TIBIAL_TUBEROSITY], [FIBULA_HEAD]])
    found["{side}_tibial_tuberosity"] = body.picker.surface(below[0], _unit(np.cross(shank, outward)), limb)
    aside = np.cos(FIBULA_BEHIND) * outward - np.sin(FIBULA_BEHIND) * np.cross(shank, outward)
    found["{side}_fibula_head"] = body.picker.surface(below[1], aside, limb)
    for name, direction, shift in (("medial", -LEFT, 0.009), ("lateral", LEFT, -0.009)):
        origin = np.array([ankle[0], body.height(HEIGHTS[f"ankle_{name}"]), ankle[2] + shift])
        found[f"{{side}}_ankle_{name}"] = body.picker.surface(origin, direction, lower)
    return found


def _centred(body: Mannequin, point: np.ndarray, direction: np.ndarray, part: np.ndarray) -> np.ndarray:
    """A point moved along a direction to the middle of the limb's depth."""
    ends = [body.picker.surface(point, sign * direction, part).of(body.picker.vertices) for sign in (1, -1)]
    return (ends[0] + ends[1]) / 2


def _foot(body: Mannequin) -> dict[str, Landmark]:
    foot = body.part("left_ankle", "left_foot")
    toes = [body.bones[f"toe{i}-1.L"] for i in range(1, 6)]
    ankle = body.joints[INDEX["left_ankle"]]

    def heel(height: str) -> Landmark:
        return body.picker.surface(np.array([ankle[0], body.height(HEIGHTS[height]), ankle[2]]), -FRONT, foot)

    tips = [body.picker.surface(toes[i] - 0.012 * UP, FRONT, foot) for i in (0, 1)]
    return {
        "{side}_calcaneus": heel("calcaneus"),
        "bp_{side}_heel": heel("heel"),
        "{side}_toe": body.picker.surface(toes[1], UP, foot),
        "{side}_toe_plantar": body.picker.surface(toes[1], -UP, foot),
        "{side}_meta1": body.picker.surface(toes[0], -LEFT, foot),
        "{side}_meta5": body.picker.surface(toes[4], LEFT, foot),
        "bp_{side}_foot_index": mean(*tips),
    }


def _arm(body: Mannequin) -> dict[str, Landmark]:
    shoulder, elbow, wrist = (body.joints[INDEX[f"left_{name}"]] for name in ("shoulder", "elbow", "wrist"))
    girdle = body.part("left_collar", "left_shoulder", "spine3")
    above = np.array([BIACROMIAL * body.stature / 2, shoulder[1], shoulder[2] - 0.005])
    found = {"{side}_acromion": body.picker.surface(above, UP, girdle)}
    trunk = body.part("spine3", "neck", "left_collar", "left_shoulder")
    clavicle = np.array([CLAVICLE_ASIDE * body.stature, body.height(HEIGHTS["sternum_ij"]), 0.02])
    found["{side}_clavicle_inner"] = body.picker.surface(clavicle, FRONT, trunk)
    spine = np.array([SCAPULAR_SPINE_ASIDE * body.stature, body.height(HEIGHTS["scapular_spine"]), 0])
    found["{side}_scapular_spine"] = body.picker.surface(spine, -FRONT, trunk)

    limb = body.part("left_shoulder", "left_elbow", "left_wrist")
    upper, fore = _unit(elbow - shoulder), _unit(wrist - elbow)
    medial = _unit(np.cross(upper, fore))  # the rest pose bends the elbow, which shows its axis
    middle = _centred(body, elbow, _unit(upper - fore), limb)
    found["{side}_elbow_lateral"] = body.picker.surface(middle, -medial, limb)
    found["{side}_elbow_medial"] = body.picker.surface(middle, medial, limb)
    found["{side}_olecranon"] = body.picker.surface(middle, _unit(upper - fore), limb)

    radial = body.bones["finger2-1.L"] - body.bones["finger5-1.L"]
    radial = _unit(radial - fore * (fore @ radial))
    middle = wrist + WRIST_BEYOND_RIG * _unit(body.bones["finger3-1.L"] - wrist)
    middle = _centred(body, middle, np.cross(fore, radial), limb)
    found["{side}_wrist_radius"] = body.picker.surface(middle, radial, limb)
    found["{side}_wrist_ulna"] = body.picker.surface(middle, -radial, limb)
    return found


def _hand(body: Mannequin) -> dict[str, Landmark]:
    wrist, third = body.joints[INDEX["left_wrist"]], body.bones["finger3-1.L"]
    skin = body.skin("left_wrist", "left_hand")
    radial = body.bones["finger2-1.L"] - body.bones["finger5-1.L"]
    dorsal = _unit(np.cross(radial, third - wrist))
    palm = body.part("left_wrist", "left_hand")

    def knuckle(finger: int) -> Landmark:
        return body.picker.surface(body.bones[f"finger{finger}-1.L"], dorsal, palm)

    found = {
        **{f"{{side}}_hand_meta{i}": knuckle(i) for i in (2, 3, 5)},
        "{side}_hand_meta3_palmar": body.picker.surface(third, -dorsal, palm),
    }
    for name, bone in (("index", "finger2-1.L"), ("pinky", "finger5-1.L"), ("thumb", "finger1-2.L")):
        found[f"bp_{{side}}_{name}"] = body.picker.around(body.bones[bone], skin)
    return found


def _face(body: Mannequin) -> dict[str, Landmark]:
    """Eyes and mouth from the rims of their cavities, the ear in front of its canal."""
    vertices, faces = body.picker.vertices, body.picker.faces
    head = body.skin("head", "neck")
    inside = body.inner[faces].all(axis=1)
    rim = np.intersect1d(faces[inside], faces[~inside & ~body.inner[faces].all(axis=1)])
    eye_height = body.bones["eye.L"][1]
    eyelid = rim[(vertices[rim, 1] > eye_height - 0.02) & (vertices[rim, 0] > 0.005)]
    lips = rim[(vertices[rim, 1] < eye_height - 0.03) & (vertices[rim, 0] > 0.005)]
    ends = [Landmark((int(eyelid[pick(vertices[eyelid, 0])]),), (1.0,)) for pick in (np.argmin, np.argmax)]
    centre = vertices[eyelid].mean(axis=0)
    # The ear lies between brow and nose; further down the neck's flare may be as wide.
    beside = head & (np.abs(vertices[:, 1] - (eye_height - EAR_BELOW_EYE)) < EAR_BELOW_EYE)
    outer = beside & (vertices[:, 0] > 0.9 * vertices[beside, 0].max())
    ear = vertices[outer]
    tragus = np.array([0.07, ear[:, 1].mean(), ear[:, 2].max()])
    return {
        "bp_{side}_eye_inner": ends[0],
        "bp_{side}_eye": body.picker.nearest(centre + 0.004 * FRONT, head),
        "bp_{side}_eye_outer": ends[1],
        "bp_{side}_ear": body.picker.nearest(tragus, head),
        "bp_mouth_{side}": Landmark((int(lips[np.argmax(vertices[lips, 0])]),), (1.0,)),
    }


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)
