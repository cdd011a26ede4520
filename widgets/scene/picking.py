"""What lies under the pointer, from pixels alone: quicker by far than asking the graphics library."""

from __future__ import annotations

import numpy as np


def nearest_point(pixels: np.ndarray, depth: np.ndarray, at: tuple[float, float], reach: float) -> int:
    """Index of the point (of pixels (N, 2), NaN hidden) at ``at``; -1 where none is within ``reach`` pixels.

    Among those that lie within two pixels of the nearest, the one in front.
    """
    if not len(pixels):
        return -1
    away = np.hypot(pixels[:, 0] - at[0], pixels[:, 1] - at[1])
    away[np.isnan(away)] = np.inf
    best = float(away.min())
    if best > reach:
        return -1
    return int(np.argmin(np.where(away <= min(best + 2.0, reach), depth, np.inf)))


def points_in_box(pixels: np.ndarray, a: tuple[float, float], b: tuple[float, float]) -> list[int]:
    """Indices of the points of pixels (N, 2) in the box between two corners."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return [int(i) for i in np.flatnonzero(((pixels >= low) & (pixels <= high)).all(axis=1))]


def nearest_segment(starts: np.ndarray, ends: np.ndarray, at: tuple[float, float], reach: float) -> int:
    """Index of the segment (pixels (N, 2) to (N, 2)) nearest to ``at``; -1 where none is within ``reach`` pixels."""
    if not len(starts):
        return -1
    along = ends - starts
    length = np.maximum((along**2).sum(axis=1), 1e-9)
    share = np.clip(((np.array(at) - starts) * along).sum(axis=1) / length, 0.0, 1.0)
    away = np.linalg.norm(starts + share[:, None] * along - at, axis=1)
    away[np.isnan(away)] = np.inf
    best = int(np.argmin(away))
    return best if away[best] <= reach else -1
