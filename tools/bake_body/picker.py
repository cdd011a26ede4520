"""Points on or in a mesh, written as weighted means of its vertices so that they follow every shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

CORNERS = 8
"""The most vertices that one landmark is a mean of."""


@dataclass(frozen=True)
class Landmark:
    """A point as a weighted mean of vertices; ``values`` sum to 1."""

    vertices: tuple[int, ...]
    values: tuple[float, ...]

    def of(self, vertices: np.ndarray) -> np.ndarray:
        """(..., 3) the landmark on meshes of (..., V, 3)."""
        return np.einsum("k,...kd->...d", np.array(self.values), vertices[..., list(self.vertices), :])

    def mirrored(self, twin: np.ndarray) -> Landmark:
        """The landmark on the other side, by each vertex' ``twin``."""
        return Landmark(tuple(int(twin[v]) for v in self.vertices), self.values)


def mean(*landmarks: Landmark) -> Landmark:
    """The point midway between landmarks."""
    total: dict[int, float] = {}
    for landmark in landmarks:
        for vertex, value in zip(landmark.vertices, landmark.values, strict=True):
            total[vertex] = total.get(vertex, 0.0) + value / len(landmarks)
    return Landmark(tuple(total), tuple(total.values()))


@dataclass(frozen=True)
class Picker:
    """Finds landmarks on one mesh of ``vertices`` (V, 3) and ``faces`` (F, 3)."""

    vertices: np.ndarray
    faces: np.ndarray

    def surface(self, origin: np.ndarray, direction: np.ndarray, part: np.ndarray | None = None) -> Landmark:
        """Where a ray from inside leaves the mesh for the last time; ``part`` (F,) bool limits the faces."""
        faces = self.faces if part is None else self.faces[part]
        a, b, c = (self.vertices[faces[:, i]] for i in range(3))
        normal = np.cross(direction, c - a)
        determinant = np.einsum("fd,fd->f", b - a, normal)
        other = np.cross(origin - a, b - a)
        tolerance = 1e-9
        with np.errstate(divide="ignore", invalid="ignore"):  # faces along the ray
            u = np.einsum("fd,fd->f", origin - a, normal) / determinant
            v = other @ np.asarray(direction, dtype=float) / determinant
            distance = np.einsum("fd,fd->f", c - a, other) / determinant
            hit = (u >= -tolerance) & (v >= -tolerance) & (u + v <= 1 + tolerance) & (distance > 0)
        if not hit.any():
            raise ValueError(f"no surface from {np.round(origin, 3)} along {np.round(direction, 2)}")
        f = np.flatnonzero(hit)[np.argmax(distance[hit])]
        values = np.clip([1 - u[f] - v[f], u[f], v[f]], 0, None)
        return Landmark(tuple(int(i) for i in faces[f]), tuple(float(x) for x in values / values.sum()))

    def nearest(self, point: np.ndarray, allowed: np.ndarray) -> Landmark:
        """The vertex nearest to a point, out of the ``allowed`` (V,) bool."""
        candidates = np.flatnonzero(allowed)
        nearest = candidates[np.argmin(np.linalg.norm(self.vertices[candidates] - point, axis=1))]
        return Landmark((int(nearest),), (1.0,))

    def around(self, point: np.ndarray, allowed: np.ndarray, count: int = 60) -> Landmark:
        """A point inside the body, as a mean of skin that surrounds it (``allowed``, (V,) bool)."""
        candidates = np.flatnonzero(allowed)
        distance = np.linalg.norm(self.vertices[candidates] - point, axis=1)
        near = candidates[np.argsort(distance, kind="stable")[:count]]
        system = np.vstack([(self.vertices[near] - point).T, np.full(len(near), 0.1)])
        values = nnls(system, np.array([0.0, 0.0, 0.0, 0.1]))[0]
        kept = np.argsort(-values, kind="stable")[:CORNERS]
        kept = kept[values[kept] > 0]
        return Landmark(tuple(int(i) for i in near[kept]), tuple(float(x) for x in values[kept] / values[kept].sum()))
