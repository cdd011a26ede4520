"""The SMPL-layout bone tree: names, parents, parts and connected subtrees."""

from __future__ import annotations

from functools import cache

import numpy as np

JOINTS = (
    "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot "
    "neck left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist "
    "left_hand right_hand"
).split()
"""The 24 joints. A bone carries the name of the joint it turns about: ``left_hip`` is the left thigh."""

PARENTS = np.array([-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21])
"""(24,) index of each joint's parent; the root has -1."""

INDEX = {name: i for i, name in enumerate(JOINTS)}

PARTS: dict[str, tuple[str, ...]] = {
    f"{side}_{part}": tuple(name.format(side=side) for name in names)
    for side in ("left", "right")
    for part, names in {
        "arm": ("{side}_shoulder", "{side}_elbow", "{side}_wrist"),
        "leg": ("{side}_hip", "{side}_knee", "{side}_ankle", "{side}_foot"),
        "shoulder": ("spine3", "{side}_collar", "{side}_shoulder", "{side}_elbow"),
    }.items()
}
"""The six partial-body layouts of Milef et al. (2024), table 5 (whose shoulder names one bone twice)."""


def mirror_index() -> np.ndarray:
    """(24,) the joint on the other side of each joint."""
    swap = {"left": "right", "right": "left"}
    return np.array(
        [INDEX["_".join([swap.get(name.split("_")[0], name.split("_")[0]), *name.split("_")[1:]])] for name in JOINTS]
    )


@cache
def descendants() -> np.ndarray:
    """(24, 24) bool: entry [k, j] is True where joint j moves with joint k (itself included)."""
    table = np.eye(len(JOINTS), dtype=bool)
    for j in range(1, len(JOINTS)):
        table[:, j] |= table[:, PARENTS[j]]
    return table


@cache
def subtrees(size: int) -> tuple[frozenset[int], ...]:
    """Every connected subtree of ``size`` bones: the candidate "chains" of Milef et al. (2024), section 3.4.2."""
    level: set[frozenset[int]] = {frozenset([j]) for j in range(len(JOINTS))}
    neighbours = {
        j: {int(PARENTS[j])} - {-1} | {int(k) for k in np.flatnonzero(j == PARENTS)} for j in range(len(JOINTS))
    }
    for _ in range(size - 1):
        level = {tree | {n} for tree in level for j in tree for n in neighbours[j] - tree}
    return tuple(sorted(level, key=sorted))


BONES = {
    "pelvis": "pelvis",
    "spine1": "lumbar",
    "spine2": "lower_thorax",
    "spine3": "thorax",
    "neck": "neck",
    "head": "head",
    **{
        f"{side}_{joint}": f"{side}_{bone}"
        for side in ("left", "right")
        for joint, bone in {
            "hip": "thigh",
            "knee": "shank",
            "ankle": "foot",
            "foot": "toes",
            "collar": "clavicle",
            "shoulder": "upper_arm",
            "elbow": "forearm",
            "wrist": "hand",
            "hand": "fingers",
        }.items()
    },
}
"""What people call the bone that turns about each joint: the names that labelled markers get."""
