"""How far markers are from the fitted skin: outside or inside of it."""

from __future__ import annotations

import numpy as np

from markerscope.app.views.colours import Coloured, Legend
from markerscope.widgets import palette
from markerscope.widgets.colour_bar import ColourBar

LIMIT_M = 0.03
"""Distances from here on have the last colour on either side."""


def signed_distance(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(M,) m, of points (M, 3) to a closed skin: positive outside, negative inside, NaN where a point is lost.

    The closest point of the triangles about the nearest vertex; exact wherever the closest triangle is one of these,
    which it is for points nearer to the skin than its triangles are wide.

    Parameters
    ----------
    vertices, faces : (V, 3) m and (F, 3), anticlockwise seen from outside
    """
    found = np.full(len(points), np.nan)
    corners = vertices[faces].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    about: dict[int, list[int]] = {}
    seen = np.flatnonzero(np.isfinite(points).all(axis=1))
    if not len(seen) or not len(vertices):
        return found
    apart = ((points[seen, None].astype(np.float32) - vertices[None].astype(np.float32)) ** 2).sum(axis=2)
    near = apart.argmin(axis=1)
    wanted = np.isin(faces, near)
    for face in np.flatnonzero(wanted.any(axis=1)).tolist():
        for vertex in faces[face][wanted[face]].tolist():
            about.setdefault(vertex, []).append(face)
    for m, vertex in zip(seen.tolist(), near.tolist()):
        own = about.get(vertex, [])
        if not own:
            continue
        closest = _closest(points[m], corners[own])
        away = points[m] - closest
        distance = np.linalg.norm(away, axis=1)
        least = distance.min()
        # At an edge several triangles are as near: together they say on which side of the skin the point is.
        outwards = normals[own][distance <= least + 1e-6].sum(axis=0)
        side = float(away[int(distance.argmin())] @ outwards)
        found[m] = least if side >= 0 else -least
    return found


def _closest(point: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(n, 3) of triangles (n, 3, 3), the place nearest to a point (3,)."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    u, v, w = b - a, c - a, point - a
    uu, uv, vv = (u * u).sum(1), (u * v).sum(1), (v * v).sum(1)
    wu, wv = (w * u).sum(1), (w * v).sum(1)
    whole = uu * vv - uv * uv
    safe = np.where(whole > 1e-18, whole, 1.0)
    s, t = (vv * wu - uv * wv) / safe, (uu * wv - uv * wu) / safe
    inside = (whole > 1e-18) & (s >= 0) & (t >= 0) & (s + t <= 1)
    on_plane = a + s[:, None] * u + t[:, None] * v
    sides = np.stack([_on_side(point, p, q) for p, q in ((a, b), (b, c), (c, a))])
    nearest = np.linalg.norm(sides - point, axis=2).argmin(axis=0)
    return np.where(inside[:, None], on_plane, sides[nearest, np.arange(len(a))])


def _on_side(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    way = end - start
    length = (way * way).sum(1)
    share = np.clip(((point - start) * way).sum(1) / np.where(length > 0, length, 1.0), 0.0, 1.0)
    return np.asarray(start + share[:, None] * way)


def by_skin(distance: np.ndarray, limit: float = LIMIT_M) -> Coloured:
    """Colours by the signed distance (M,) m to the skin; grey where there is none."""
    colours = palette.sequential(1000 * distance, -1000 * limit, 1000 * limit, "diverging")
    return Coloured(colours, Legend("To the skin", ColourBar(-1000 * limit, 1000 * limit, "mm", "diverging")))
