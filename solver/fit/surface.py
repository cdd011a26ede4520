"""How far the markers are from the fitted skin: the m2s of Milef et al. (2024), section 4.1.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.fit.results import FittedMotion

_MOST_FRAMES = 100


@dataclass(frozen=True)
class SurfaceDistance:
    """Distance of markers to the skin.

    Attributes
    ----------
    mean, median : m, over the markers that the fit used and the frames looked at
    per_marker : (M,) m, mean of every marker; NaN for those never seen in these frames
    frames : the frame numbers looked at, evenly spread
    """

    mean: float
    median: float
    per_marker: np.ndarray
    frames: np.ndarray


def surface_distance(
    body: Body, motion: FittedMotion, positions: np.ndarray, progress: Progress = silent
) -> SurfaceDistance:
    """Unsigned distance of every marker to the closest point of the posed body.

    Parameters
    ----------
    body : with bone lengths among its shape coefficients
    positions : (T, M, 3) m, NaN = lost
    """
    from markerscope.solver.core.metrics import marker_to_surface

    count = len(positions)
    frames = np.unique(np.linspace(0, count - 1, min(count, _MOST_FRAMES)).round().astype(int))
    vertices, _ = body.pose(motion.rotations[frames], motion.betas, motion.trans[frames])
    distance = marker_to_surface(positions[frames], vertices, body.faces, progress=progress)
    seen = np.isfinite(distance)
    per_marker = np.where(seen, distance, 0).sum(0) / np.where(seen.any(0), seen.sum(0), np.nan)
    known = distance[seen & (motion.marker_joint >= 0)]
    if not len(known):
        return SurfaceDistance(float("nan"), float("nan"), per_marker, frames)
    return SurfaceDistance(float(known.mean()), float(np.median(known)), per_marker, frames)
