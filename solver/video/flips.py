"""Left and right exchanged by the pose network: found by continuity over time, and mended.

The network sometimes calls the left limb right for a frame or a while. Of all ways to exchange sides frame by frame,
the one is taken along which the landmarks accelerate least. It has two readings (every frame the other way round is as
smooth); which is right is told by most frames and by the body: a left knee is on the left of the pelvis, toes and nose
point where the trunk faces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.core.landmarks import LANDMARKS, Landmarks

GROUPS: dict[str, tuple[str, ...]] = {
    "trunk": ("eye_inner", "eye", "eye_outer", "ear", "shoulder", "hip"),
    "arms": ("elbow", "wrist", "pinky", "index", "thumb"),
    "legs": ("knee", "ankle", "heel", "foot_index"),
}
"""What is exchanged together. The trunk comes first: the limbs are told apart by it."""

_SWITCH_COST = 0.15  # m of mean acceleration a frame: limbs that pass each other closer need no mending
_CAP = 0.5  # m, the most that one landmark's acceleration counts
_LONGEST_GAP = 0.25  # s without tracking, after which sides start anew
_BODY_WEIGHT = 2.0  # what the body says, against one vote a frame for the network


@dataclass(frozen=True)
class Flip:
    """Rows ``start`` up to ``stop`` of the landmarks in which a group of ``GROUPS`` had its sides exchanged."""

    group: str
    start: int
    stop: int


def mend_flips(landmarks: Landmarks) -> tuple[Landmarks, tuple[Flip, ...]]:
    """Landmarks with exchanged sides put back, and where they had been exchanged."""
    image, world, visibility = landmarks.image.copy(), landmarks.world.copy(), landmarks.visibility.copy()
    flips: list[Flip] = []
    for group, names in GROUPS.items():
        left = [_column(f"left_{name}") for name in names]
        right = [_column(f"right_{name}") for name in names]
        flipped = np.zeros(len(landmarks.time), dtype=bool)
        for rows in _stretches(landmarks):
            path = _in_metres(image[rows], world[rows])
            exchanged = _smoothest(path[:, left], path[:, right])
            vote = 1 + _BODY_WEIGHT * _agreement(group, world[rows])
            flipped[rows] = exchanged if vote[~exchanged].sum() >= vote[exchanged].sum() else ~exchanged
        wrong = np.flatnonzero(flipped)[:, None]
        for values in (image, world, visibility):
            values[wrong, left + right] = values[wrong, right + left]
        flips += _spans(group, flipped & landmarks.tracked)
    return replace(landmarks, image=image, world=world, visibility=visibility), tuple(flips)


def _column(name: str) -> int:
    return LANDMARKS.index(name)


def _stretches(landmarks: Landmarks) -> list[np.ndarray]:
    """Tracked rows, cut where tracking was lost for long."""
    rows = np.flatnonzero(landmarks.tracked)
    return [
        part for part in np.split(rows, 1 + np.flatnonzero(np.diff(landmarks.time[rows]) > _LONGEST_GAP)) if len(part)
    ]


def _in_metres(image: np.ndarray, world: np.ndarray) -> np.ndarray:
    """(F, 33, 5) picture and world coordinates side by side, the picture's at the scale of the world's."""
    spread = [np.sqrt(np.sum((p - p.mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))) for p in (world[..., :2], image)]
    return np.concatenate([image * np.median(spread[0] / spread[1]), world], axis=2)


def _smoothest(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """(F,) bool: the exchanges, the first frame's being None, along which two sides (F, N, D) accelerate least.

    Dynamic programming over the exchanges of two neighbouring frames.
    """
    count = len(left)
    exchanged = np.zeros(count, dtype=bool)
    if count < 3:
        return exchanged
    sides = np.stack([left, right])
    cost = np.empty((2, 2, 2, count - 2))  # by the exchange of a frame, the next and the one after
    for a, b, c in np.ndindex(2, 2, 2):
        order = [sides[[k, 1 - k]][:, i : count - 2 + i] for i, k in enumerate((a, b, c))]
        acceleration = np.linalg.norm(order[0] - 2 * order[1] + order[2], axis=3)
        cost[a, b, c] = np.minimum(acceleration, _CAP).mean(axis=(0, 2)) + _SWITCH_COST * (b != c)
    best = np.array([[0.0, _SWITCH_COST], [np.inf, np.inf]])  # to arrive with exchanges [a, b]
    came_from = np.empty((count - 2, 2, 2), dtype=int)
    for f in range(count - 2):
        total = best[:, :, None] + cost[..., f]
        came_from[f] = total.argmin(axis=0)
        best = total.min(axis=0)
    b, c = np.unravel_index(best.argmin(), (2, 2))
    exchanged[-2:] = b, c
    for f in range(count - 3, -1, -1):
        b, c = came_from[f, b, c], b
        exchanged[f] = b
    return exchanged


def _agreement(group: str, world: np.ndarray) -> np.ndarray:
    """(F,) -1..1: how well the sides of a group, as they stand, fit the rest of the body."""

    def at(name: str) -> np.ndarray:
        return world[:, _column(name)]

    def across(name: str) -> np.ndarray:
        return at(f"left_{name}") - at(f"right_{name}")

    def middle(name: str) -> np.ndarray:
        return (at(f"left_{name}") + at(f"right_{name}")) / 2

    if group == "trunk":
        facing = np.cross(across("hip") + across("shoulder"), middle("shoulder") - middle("hip"))
        ahead = (at("nose") - middle("ear"), middle("foot_index") - middle("heel"))
        return np.mean([_cosine(facing, direction) for direction in ahead], axis=0)
    limb, root = ("elbow", "shoulder") if group == "arms" else ("knee", "hip")
    axis = across(root)
    return np.clip(np.sum(across(limb) * axis, axis=1) / np.maximum(np.sum(axis * axis, axis=1), 1e-6), -1, 1)


def _cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
    return np.sum(a * b, axis=1) / np.maximum(length, 1e-9)


def _spans(group: str, flipped: np.ndarray) -> list[Flip]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flipped, [False]]).astype(int)))
    return [Flip(group, int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]
