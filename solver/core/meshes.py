"""Normals of triangle meshes."""

from __future__ import annotations

import numpy as np


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) area-weighted outward unit normals of one mesh (V, 3)."""
    a, b, c = vertices.T[:, faces.T].swapaxes(0, 1)
    u, v = b - a, c - a
    face = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    corners = faces.ravel()
    total = np.stack([np.bincount(corners, np.repeat(one, 3), minlength=len(vertices)) for one in face], axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)


def normals_at(vertices: np.ndarray, faces: np.ndarray, around: np.ndarray) -> np.ndarray:
    """(n, 3) the same at some vertices of the mesh, whose faces ``around`` (n, K) lists; -1 = none."""
    wanted, place = np.unique(around, return_inverse=True)
    a, b, c = vertices[faces[wanted]].swapaxes(0, 1)
    face = np.cross(b - a, c - a) * (wanted >= 0)[:, None]
    total = face[place.reshape(around.shape)].sum(axis=1)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
