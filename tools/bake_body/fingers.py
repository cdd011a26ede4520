"""The model's fingers are curled; those of the body's rest pose are nearly straight, and so the bones are made."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from tools.bake_body.rajagopal import Mesh, Model

FINGERS = {
    "index": ("metacarpal2", ("proximal", "medial", "distal")),
    "middle": ("metacarpal3", ("proximal", "medial", "distal")),
    "ring": ("metacarpal4", ("proximal", "medial", "distal")),
    "little": ("metacarpal5", ("proximal", "medial", "distal")),
    "thumb": ("metacarpal1", ("proximal", "distal")),
}
BENT = np.radians([8.0, 8.0, 6.0])
"""How far each phalanx is bent towards the palm against the bone before it."""
THUMB_BENT, THUMB_CLOSED = np.radians([25.0, 10.0]), np.radians(28.0)
"""The same of the thumb, and how far it lies nearer to the fingers than its metacarpal points."""
LENGTH = 0.88
"""Phalanges of the model over those of the body, whose hand is as wide."""
_AHEAD, _ACROSS = np.array([1.0, 0, 0]), np.array([0.0, 0, 1])
"""The way the palm faces, and the axis about which the model's fingers bend (positive: to the palm)."""


def straight_fingers(model: Model) -> dict[str, Mesh]:
    """The phalanges by the names of their meshes, each set on the end of the bone before it; the hand's axes, m."""
    found = {}
    for finger, (metacarpal, names) in FINGERS.items():
        before = model.mesh(f"{metacarpal}_rvs", "hand").vertices
        start, end = _ends(before, np.zeros(3))
        direction = (end - start) / np.linalg.norm(end - start)
        curl = BENT
        if finger == "thumb":
            curl = THUMB_BENT
            direction = Rotation.from_rotvec(THUMB_CLOSED * _AHEAD).apply(direction)
        old_end = end
        for name, bend in zip(names, curl):
            mesh = model.mesh(f"{finger}_{name}_rvs", "hand")
            near, far = _ends(mesh.vertices, old_end)
            direction = Rotation.from_rotvec(bend * _ACROSS).apply(direction)
            turn = _least_turn(far - near, direction)
            # The gap between two bones stays as wide as it was.
            there = end + np.linalg.norm(near - old_end) * direction
            found[f"{finger}_{name}_rvs"] = Mesh(LENGTH * (mesh.vertices - near) @ turn.T + there, mesh.faces)
            end, old_end = there + LENGTH * np.linalg.norm(far - near) * direction, far
    return found


def _ends(vertices: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both ends of a long bone on its axis, the one nearer to a point first."""
    middle = vertices.mean(axis=0)
    axis = np.linalg.svd(vertices - middle, full_matrices=False)[2][0]
    along = (vertices - middle) @ axis
    ends = [middle + extreme * axis for extreme in (along.min(), along.max())]
    return tuple(sorted(ends, key=lambda end: float(np.linalg.norm(end - near))))  # type: ignore[return-value]


def _least_turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(3, 3) the smallest rotation from one direction to another."""
    a, b = start / np.linalg.norm(start), end / np.linalg.norm(end)
    axis = np.cross(a, b)
    size = np.linalg.norm(axis)
    if size < 1e-9:
        return np.eye(3)
    return Rotation.from_rotvec(axis / size * np.arctan2(size, a @ b)).as_matrix()
