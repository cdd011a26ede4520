"""How much the distance of two markers varies, over the frames that show both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.progress import Progress, silent

_CHUNK_BYTES = 24 << 20


@dataclass(frozen=True, eq=False)
class Affinity:
    """Statistics of every pair of markers.

    Attributes
    ----------
    deviation : (M, M) m, standard deviation of the distance; NaN where never seen together
    distance : (M, M) m, mean distance; NaN where never seen together
    overlap : (M, M) number of compared frames that show both; the diagonal counts each marker's own
    frames : number of frames compared
    """

    deviation: np.ndarray
    distance: np.ndarray
    overlap: np.ndarray
    frames: int


def affinity(positions: np.ndarray, max_frames: int = 5000, progress: Progress = silent) -> Affinity:
    """Masked standard deviation of pairwise distances.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    max_frames : longer recordings are sampled evenly down to this many frames
    progress : called along the way

    Notes
    -----
    Memory stays bounded: frames are taken in chunks of some 24 MB of distances.
    """
    total, count = positions.shape[:2]
    frames = np.unique(np.linspace(0, total - 1, min(total, max_frames)).round().astype(np.intp))
    overlap, first, second = np.zeros((count, count)), np.zeros((count, count)), np.zeros((count, count))
    reference = np.full((count, count), np.nan)
    step = max(1, _CHUNK_BYTES // (8 * max(count, 1) ** 2))
    for start in range(0, len(frames), step):
        chunk = positions[frames[start : start + step]]
        apart = _distances(chunk)
        # sums about a first value keep the small variance from drowning in the square of the distance
        here = np.nan_to_num(apart).sum(axis=0) / np.maximum(np.isfinite(apart).sum(axis=0), 1)
        new = np.isnan(reference) & np.isfinite(apart).any(axis=0)
        reference[new] = here[new]
        apart -= np.nan_to_num(reference)
        seen = np.isfinite(apart)
        apart[~seen] = 0.0
        overlap += seen.sum(axis=0)
        first += apart.sum(axis=0)
        second += np.einsum("tij,tij->ij", apart, apart)
        progress(min(1.0, (start + step) / len(frames)), "comparing markers")
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = first / overlap
        deviation = np.sqrt(np.maximum(second / overlap - mean**2, 0.0))
    return Affinity(deviation, reference + mean, overlap.astype(np.int64), len(frames))


def _distances(points: np.ndarray) -> np.ndarray:
    """(T, M, M) m from (T, M, 3); NaN where either is lost."""
    lost = ~np.isfinite(points).all(axis=2)
    centre = np.where(lost[..., None], 0.0, points).sum(axis=1) / np.maximum((~lost).sum(axis=1), 1)[:, None]
    local = np.where(lost[..., None], 0.0, points - centre[:, None])
    squared = np.einsum("tik,tik->ti", local, local)
    square = squared[:, :, None] + squared[:, None, :] - 2 * (local @ local.transpose(0, 2, 1))
    apart = np.sqrt(np.maximum(square, 0.0))
    apart[np.broadcast_to(lost[:, :, None] | lost[:, None, :], apart.shape)] = np.nan
    index = np.arange(points.shape[1])
    apart[:, index, index] = np.where(lost, np.nan, 0.0)
    return apart


def bridged(deviation: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """(M, M) m: pairs that are not ``measured`` get the best bridge over other markers.

    Two pieces of one broken trajectory are never seen together, yet both move with their bone. A bridge is as bad as
    its worst step, so the value is the least, over all paths of measured pairs, of the largest deviation on the path.
    NaN remains where no path exists.
    """
    best = np.where(measured, deviation, np.inf)
    np.fill_diagonal(best, 0.0)
    for middle in range(len(best)):
        np.minimum(best, np.maximum(best[:, middle, None], best[None, middle, :]), out=best)
    best[~np.isfinite(best)] = np.nan
    return np.where(measured, deviation, best)
