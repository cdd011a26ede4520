"""Any recorded skeleton motion onto the 24 joints: directions of bones are kept, whatever the source's rest pose.

Rest poses of motion files differ (T-pose, arms down, all bones along one axis), so nothing is taken from them. A limb
follows the direction of the source's bone in the lab. Its twist follows the source's own rotation, up to a constant
that makes the hinge about which the source really bends its knee or elbow the hinge of ours.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3, kabsch, log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.io.motion import SkeletonMotion
from markerscope.solver.synth.motion import Motion, at_rate

_ALIASES = {
    "hip": ("lfemur", "leftupleg", "leftupperleg", "upperlegl", "leftthigh", "thighl", "lthigh", "lefthip", "lhip"),
    "knee": ("ltibia", "leftleg", "leftlowerleg", "lowerlegl", "leftshin", "shinl", "lshin", "leftknee", "lknee",
             "leftcalf", "calfl", "lcalf"),
    "ankle": ("leftankle", "lankle", "anklel", "lfoot", "leftfoot", "footl"),
    "toe": ("ltoes", "lefttoebase", "lefttoe", "lefttoes", "toesl", "toel", "ltoe", "leftfoot", "toebasel"),
    "shoulder": ("lhumerus", "leftarm", "leftupperarm", "upperarml", "lupperarm", "lupperarm", "leftshoulder",
                 "lshoulder"),
    "elbow": ("lradius", "leftforearm", "leftlowerarm", "lowerarml", "forearml", "lforearm", "leftelbow", "lelbow"),
    "wrist": ("lhand", "leftwrist", "wristl", "lefthand", "handl", "lwrist"),
}  # fmt: skip
"""Spellings of the left joint, without punctuation, in the order in which they are looked for."""
_HEAD = ("head", "headtop")
_REQUIRED = ("hip", "knee", "ankle", "shoulder", "elbow")
_SMALL_BEND = 0.05  # weight of the body's own axes against a hinge that was never bent
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class _Source:
    """The joints of a motion that ours follow.

    Attributes
    ----------
    joint : index by slot: ``left_hip`` ..., ``hips``, ``chest``, ``neck`` and, where there are, ``head``, toes, wrists
    turns : (T, J, 3, 3) and ``places`` (T, J, 3) m, ``ends`` (T, J, 3) m, in the lab
    """

    joint: dict[str, int]
    turns: np.ndarray
    places: np.ndarray
    ends: np.ndarray

    def place(self, slot: str) -> np.ndarray:
        """(T, 3) m."""
        return self.places[:, self.joint[slot]]

    def turn(self, slot: str) -> np.ndarray:
        """(T, 3, 3)."""
        return self.turns[:, self.joint[slot]]

    def middle(self, slot: str) -> np.ndarray:
        """(T, 3) m between the left and the right joint."""
        return 0.5 * (self.place(f"left_{slot}") + self.place(f"right_{slot}"))


def retarget(source: SkeletonMotion, body: Body, betas: np.ndarray, *, rate: float | None = None) -> Motion:
    """Move a body as a recorded skeleton moved.

    Parameters
    ----------
    source : BVH or ASF/AMC motion, any names that are in common use
    body, betas : who is to move; the path is scaled by the length of the legs, the soles stay near the floor z = 0
    rate : Hz of the result, None for the source's

    Raises
    ------
    InputError : the skeleton lacks a limb, or its names are not known
    """
    joint = match_joints(source)
    turns = source.global_rotations()
    places = source.joint_positions()
    ends = places + np.einsum("tjab,jb->tja", turns, source.ends)
    given = _Source(joint, turns, places, ends)
    rest = body.joints(betas)
    world = _world(given, rest)
    local = np.tile(np.eye(3), (len(turns), len(JOINTS), 1, 1))
    local[:, 0] = world["pelvis"]
    bend = log_so3(_between(world["pelvis"], world["chest"]))
    for name in ("spine1", "spine2", "spine3"):
        local[:, INDEX[name]] = exp_so3(bend / 3)
    nod = log_so3(_between(world["chest"], world["head"]))
    for name in ("neck", "head"):
        local[:, INDEX[name]] = exp_so3(nod / 2)
    for side in ("left", "right"):
        local[:, INDEX[f"{side}_collar"]] = _between(world["chest"], world[f"{side}_collar"])
        for limb, start in ((("hip", "knee", "ankle"), "pelvis"), (("shoulder", "elbow", "wrist"), f"{side}_collar")):
            before = world[start]
            for name in limb:
                local[:, INDEX[f"{side}_{name}"]] = _between(before, world[f"{side}_{name}"])
                before = world[f"{side}_{name}"]
    motion = Motion(local, _path(given, local, body, betas, rest), source.rate)
    return motion if rate is None else at_rate(motion, rate)


def match_joints(source: SkeletonMotion) -> dict[str, int]:
    """Index of the joint for each of our slots, by name; trunk joints by where the limbs branch off."""
    known = {_plain(name): i for i, name in reversed(list(enumerate(source.names)))}
    found: dict[str, int] = {}
    for slot, spellings in _ALIASES.items():
        for side in ("left", "right"):
            taken = set(found.values())
            for spelling in spellings:
                at = known.get(spelling if side == "left" else _mirrored(spelling))
                if at is not None and at not in taken:
                    found[f"{side}_{slot}"] = at
                    break
    missing = [f"{side} {slot}" for slot in _REQUIRED for side in ("left", "right") if f"{side}_{slot}" not in found]
    if missing:
        raise InputError(
            f"its skeleton has no joint known as {missing[0]}",
            source.source or None,
            "rename its joints as in a CMU, Bandai-Namco or Mixamo file",
        )
    parents = source.parents
    found["hips"] = _common(parents, found["left_hip"], found["right_hip"])
    found["chest"] = _common(parents, found["left_shoulder"], found["right_shoulder"])
    head = next((known[name] for name in _HEAD if name in known), None)
    above = [] if head is None else _line(parents, head)
    if head is not None and found["chest"] in above[1:]:
        found["head"] = head
        found["neck"] = above[above.index(found["chest"]) - 1]
    return found


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.split(":")[-1].lower())


def _mirrored(spelling: str) -> str:
    if spelling.startswith("left"):
        return "right" + spelling[4:]
    return "r" + spelling[1:] if spelling.startswith("l") and spelling[:5] != "lower" else spelling[:-1] + "r"


def _line(parents: np.ndarray, joint: int) -> list[int]:
    """The joint and all above it."""
    line = [joint]
    while parents[line[-1]] >= 0:
        line.append(int(parents[line[-1]]))
    return line


def _common(parents: np.ndarray, one: int, other: int) -> int:
    line = set(_line(parents, other))
    return next(joint for joint in _line(parents, one) if joint in line)


def _world(given: _Source, rest: np.ndarray) -> dict[str, np.ndarray]:
    """(T, 3, 3) of each bone: what turns our rest body into the lab there."""
    across = given.place("left_hip") - given.place("right_hip")
    top = given.place("neck") if "neck" in given.joint else given.middle("shoulder")
    upright = top - given.middle("hip")
    above = INDEX["neck"] if "neck" in given.joint else None
    rest_top = rest[above] if above is not None else rest[[INDEX["left_shoulder"], INDEX["right_shoulder"]]].mean(0)
    rest_up = rest_top - rest[[INDEX["left_hip"], INDEX["right_hip"]]].mean(0)
    world = {"pelvis": _carried(given.turn("hips"), across, upright, _X, rest_up)}
    shoulders = given.place("left_shoulder") - given.place("right_shoulder")
    world["chest"] = _carried(given.turn("chest"), shoulders, upright, _X, rest_up)
    world["head"] = world["chest"]
    if "head" in given.joint:
        turn = given.turn("head")
        world["head"] = turn @ _mean_rotation(_between(turn, world["chest"]))
    for side in ("left", "right"):
        _set_arm(world, given, rest, side)
        _set_leg(world, given, rest, side)
    return world


def _set_leg(world: dict[str, np.ndarray], given: _Source, rest: np.ndarray, side: str) -> None:
    hip, knee, ankle = (given.place(f"{side}_{name}") for name in ("hip", "knee", "ankle"))
    thigh, shank = knee - hip, ankle - knee
    lateral = world["pelvis"] @ _X
    hinge = np.cross(_unit(thigh), _unit(shank)) + _SMALL_BEND * lateral
    for name, along, child in (("hip", thigh, "knee"), ("knee", shank, "ankle")):
        slot = f"{side}_{name}"
        world[slot] = _limb(given.turn(slot), along, hinge, rest[INDEX[f"{side}_{child}"]] - rest[INDEX[slot]], _X)
    world[f"{side}_ankle"] = world[f"{side}_knee"]
    foot, turn = _foot(given, side)
    if foot is not None:
        along_rest = rest[INDEX[f"{side}_foot"]] - rest[INDEX[f"{side}_ankle"]]
        world[f"{side}_ankle"] = _limb(turn, foot, np.cross(_unit(foot), _unit(shank)), along_rest, _X)


def _foot(given: _Source, side: str) -> tuple[np.ndarray | None, np.ndarray]:
    """Ankle to toes (T, 3) and the foot's rotation; None where the skeleton ends at the ankle."""
    slot = f"{side}_ankle"
    turn = given.turn(slot)
    if f"{side}_toe" in given.joint:
        return given.place(f"{side}_toe") - given.place(slot), turn
    along = given.ends[:, given.joint[slot]] - given.place(slot)
    return (along if np.linalg.norm(along, axis=1).min() > 1e-3 else None), turn


def _set_arm(world: dict[str, np.ndarray], given: _Source, rest: np.ndarray, side: str) -> None:
    shoulder, elbow = given.place(f"{side}_shoulder"), given.place(f"{side}_elbow")
    # The shoulder's place in the chest, against its usual place, is what the collar bone does.
    chest = world["chest"]
    place = _unit(np.einsum("tba,tb->ta", chest, shoulder - given.place("neck" if "neck" in given.joint else "chest")))
    world[f"{side}_collar"] = chest @ _least_turn(np.broadcast_to(_unit(place.mean(axis=0)), place.shape), place)
    sign = 1.0 if side == "left" else -1.0
    upper = elbow - shoulder
    at = given.joint.get(f"{side}_wrist")
    wrist = given.ends[:, given.joint[f"{side}_elbow"]] if at is None else given.places[:, at]
    fore = wrist - elbow
    hinge_rest = -sign * _Y  # the forearm of the T-pose bends forward
    hinge = np.cross(_unit(upper), _unit(fore)) + _SMALL_BEND * (world[f"{side}_collar"] @ hinge_rest)
    for name, along, child in (("shoulder", upper, "elbow"), ("elbow", fore, "wrist")):
        slot = f"{side}_{name}"
        bone = rest[INDEX[f"{side}_{child}"]] - rest[INDEX[slot]]
        world[slot] = _limb(given.turn(slot), along, hinge, bone, hinge_rest)
    forearm = world[f"{side}_elbow"]
    world[f"{side}_wrist"] = forearm
    if at is not None:  # the hand is on average as the forearm is
        turn = given.turns[:, at]
        world[f"{side}_wrist"] = turn @ _mean_rotation(_between(turn, forearm))


def _carried(
    turn: np.ndarray, across: np.ndarray, up: np.ndarray, rest_across: np.ndarray, rest_up: np.ndarray
) -> np.ndarray:
    """(T, 3, 3) of a piece of the trunk: the source's ``turn``, across and upright as the person is on average."""
    own = [_unit(np.einsum("tba,tb->ta", turn, v).mean(axis=0)) for v in (up, across)]
    return turn @ _frame(own[0], own[1]) @ _frame(rest_up, rest_across).T


def _limb(
    turn: np.ndarray, along: np.ndarray, hinge: np.ndarray, rest_along: np.ndarray, rest_hinge: np.ndarray
) -> np.ndarray:
    """(T, 3, 3) that turns a bone at rest to ``along`` (T, 3), twisted as the source's ``turn`` (T, 3, 3) is.

    Parameters
    ----------
    hinge : (T, 3), longer where it is better known; its mean in the bone's own axes counts
    rest_along, rest_hinge : (3,)
    """
    own = _unit(np.einsum("tba,tb->ta", turn, hinge).sum(axis=0))
    return _frame(along, turn @ own) @ _frame(rest_along, rest_hinge).T


def _between(parent: np.ndarray, child: np.ndarray) -> np.ndarray:
    """(T, 3, 3) of the child in the parent's axes."""
    return np.swapaxes(parent, -1, -2) @ child


def _mean_rotation(rotations: np.ndarray) -> np.ndarray:
    """(3, 3), the chordal mean."""
    mean: np.ndarray = kabsch(np.eye(3), rotations.mean(axis=0).T)
    return mean


def _frame(along: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """(..., 3, 3) columns: the hinge made square to the bone, the bone, and their cross product."""
    along = _unit(along)
    across = _unit(hinge - np.sum(hinge * along, axis=-1, keepdims=True) * along)
    return np.stack([across, along, np.cross(across, along)], axis=-1)


def _least_turn(start: np.ndarray, stop: np.ndarray) -> np.ndarray:
    """(T, 3, 3), the shortest rotation from one unit vector (T, 3) to another."""
    axis = np.cross(start, stop)
    sine = np.linalg.norm(axis, axis=-1, keepdims=True)
    angle = np.arctan2(sine, np.sum(start * stop, axis=-1, keepdims=True))
    return exp_so3(axis / np.maximum(sine, 1e-12) * angle)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-12)


def _path(given: _Source, local: np.ndarray, body: Body, betas: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """(T, 3) m of the root: the source's path by the length of the legs, over the origin, soles on the floor."""
    sides, names = ("left", "right"), ("hip", "knee", "ankle")
    hips, knees, ankles = (rest[[INDEX[f"{side}_{name}"] for side in sides]] for name in names)
    ours = np.linalg.norm(hips - knees, axis=1).mean() + np.linalg.norm(knees - ankles, axis=1).mean()
    bones = (("hip", "knee"), ("knee", "ankle"))
    theirs = sum(
        float(np.median(np.linalg.norm(given.place(f"{side}_{a}") - given.place(f"{side}_{b}"), axis=1)))
        for a, b in bones
        for side in ("left", "right")
    )
    trans = given.middle("hip") * (2 * ours / max(theirs, 1e-6))
    trans[:, :2] -= trans[:, :2].mean(axis=0)
    _, posed = chain(local, rest, np.zeros_like(trans))
    trans = trans - posed[:, [INDEX["left_hip"], INDEX["right_hip"]]].mean(axis=1)
    soles = [INDEX[f"{side}_{name}"] for side in ("left", "right") for name in ("ankle", "foot")]
    above = rest[soles, 1] - body.surface(betas)[:, 1].min()
    height = (posed[:, soles, 2] + trans[:, None, 2] - above).min(axis=1)
    trans[:, 2] -= np.percentile(height, 5)
    return trans
