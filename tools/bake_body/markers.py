"""Where on the skin a reflective marker may plausibly sit."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import INDEX
from tools.bake_body.coarse import vertex_areas
from tools.bake_body.source import Sample

KNUCKLE = 0.55
"""Weight of the finger bones beyond which skin is past the knuckles."""
HEAD_GAP, FOOT_GAP = 0.030, 0.015
"""m of free space that a marker needs outwards: keeps nostrils, ears' folds and clefts between toes out."""


def marker_mask(
    vertices: np.ndarray, faces: np.ndarray, weights: np.ndarray, inner: np.ndarray, fingers: np.ndarray
) -> np.ndarray:
    """(V,) bool on the T-pose template; ``fingers`` (V,) is the weight of bones beyond the knuckles."""
    allowed = ~inner & (fingers < KNUCKLE) & (vertex_areas(vertices, faces) > 0)
    normal = vertex_normals(vertices, faces)
    dominant = weights.argmax(axis=1)
    foot = np.isin(dominant, [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("ankle", "foot")])
    allowed &= ~(foot & (normal[:, 1] < -0.3))
    head = np.isin(dominant, [INDEX["head"], INDEX["neck"]])
    for part, gap in ((head, HEAD_GAP), (foot, FOOT_GAP)):
        ids = np.flatnonzero(part & allowed)
        near = part[faces].any(axis=1)
        allowed[ids[_obstructed(vertices[ids], normal[ids], vertices[faces[near]], gap)]] = False
    return allowed


def finger_weight(sample: Sample) -> np.ndarray:
    """(V,) skinning weight of the fingers beyond the knuckles, and of the thumb beyond its first joint."""
    names = [f"finger{i}-{j}" for i in range(1, 6) for j in range(1 + (i == 1), 4)]
    distal = np.array([label.split(".")[0] in names for label in sample.labels])
    return (distal[sample.weights_index] * sample.weights_value).sum(axis=1)


def vertex_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 3) area-weighted unit normals."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    normal = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(normal, faces[:, i], np.cross(b - a, c - a))
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)


def _obstructed(points: np.ndarray, normals: np.ndarray, triangles: np.ndarray, reach: float) -> np.ndarray:
    """(P,) bool: a ray along the normal meets a triangle (F, 3, 3) within ``reach`` m."""
    a, b, c = triangles.transpose(1, 0, 2)
    met = np.zeros(len(points), dtype=bool)
    for i, (point, normal) in enumerate(zip(points + 1e-3 * normals, normals, strict=True)):
        across = np.cross(normal, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / np.einsum("fd,fd->f", b - a, across)
            u = np.einsum("fd,fd->f", point - a, across) * scale
            other = np.cross(point - a, b - a)
            v = other @ normal * scale
            distance = np.einsum("fd,fd->f", c - a, other) * scale
        met[i] = bool(np.any((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0) & (distance < reach)))
    return met
