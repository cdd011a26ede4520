"""Rigid frames that ride with a few markers."""

from __future__ import annotations

import numpy as np


def local_frames(points: np.ndarray, reference: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rotation and centre that lay ``reference`` over the points of each frame best.

    Parameters
    ----------
    points : (N, K, 3) m
    reference : (K, 3) m, weighted centroid at the origin
    weights : (K,)

    Returns
    -------
    R_lab_local : (N, 3, 3)
    centre : (N, 3) m, weighted centroid of the points
    """
    share = weights / weights.sum()
    centre = np.einsum("k,nki->ni", share, points)
    cross = np.einsum("k,nki,kj->nij", share, points - centre[:, None], reference)
    return nearest_rotations(cross), centre


def nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """The rotation R of each (N, 3, 3) matrix A that maximises trace(R^T A)."""
    u, _, vt = np.linalg.svd(matrices)
    u[..., 2] *= np.linalg.det(u @ vt)[:, None]
    return u @ vt


def centred(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(K, 3) points about their weighted centroid."""
    return points - (weights / weights.sum()) @ points
