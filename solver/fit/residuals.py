"""Every residual of the fit, once: how far the guess is from each piece of evidence, and how much that counts.

Each function returns the residual, its weight for Gauss-Newton (the slope of the robust cost), and the cost.
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import log_so3
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.state import FREE, Camera, Observations, State, Surface, Weights

_LOST_VIDEO_TRUST = 0.15
"""A lost stretch of video is filled in: it still says roughly where the limbs are."""
_NEAREST_M = 0.2


def marker_residual(
    where: np.ndarray, target: np.ndarray, present: np.ndarray, weights: Weights
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, M, 3) m between where markers should be and where they were seen; Geman-McClure weight and cost (N, M)."""
    residual = where - target
    squared = np.einsum("nmk,nmk->nm", residual, residual)
    factor = 1 / (1 + squared / weights.marker_kernel**2)
    information = present / weights.marker**2
    return residual, information * factor**2, information * squared * factor


def video_residual(seen: Observations, state: State, weights: Weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, K, 3) rad between each joint and the video's, its bias undone; Cauchy weight and cost (N, K)."""
    expected = seen.prior[:, FREE] @ state.bias
    expected[:, 0] = state.camera.R_lab_cam @ expected[:, 0]
    residual = log_so3(np.swapaxes(expected, -1, -2) @ state.pose.rotations[:, FREE])
    spread = np.full(len(FREE), np.radians(weights.prior_deg))
    spread[0] = np.radians(weights.root_deg)
    trust = np.where(seen.tracked, 1.0, _LOST_VIDEO_TRUST)[:, None] / spread**2
    squared = np.einsum("njk,njk->nj", residual, residual)
    kernel = (3 * spread) ** 2
    return residual, trust / (1 + squared / kernel), trust * kernel * np.log1p(squared / kernel)


def bias_residual(state: State) -> np.ndarray:
    """(K, 3) rad, how far the video's joints are off on average."""
    turned: np.ndarray = log_so3(state.bias)
    return turned


def habit_residual(state: State, weights: Weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, K, 3) rad between each joint and a relaxed pose; weight (K, 3), cost (N, K, 3)."""
    relaxed = np.swapaxes(anatomical.mean_pose()[FREE], -1, -2)
    residual = log_so3(relaxed @ state.pose.rotations[:, FREE])
    information = weights.anatomical / anatomical.spread()[FREE] ** 2
    return residual, information, information * residual**2


def image_residual(
    local: np.ndarray,
    camera: Camera,
    pixels: np.ndarray,
    visible: np.ndarray,
    person: float,
    image_size: tuple[int, int],
    weights: Weights,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, L, 2) px between landmarks and the body's points in camera coordinates (N, L, 3); weight and cost (N, L).

    Parameters
    ----------
    visible : (N, L) 0..1
    person : px, height of the person in the image
    """
    depth = np.maximum(local[..., 2:], _NEAREST_M)
    residual = camera.focal * local[..., :2] / depth + np.array(image_size) / 2 - pixels
    spread = weights.image * person
    squared = np.einsum("nlk,nlk->nl", residual, residual)
    factor = 1 / (1 + squared / (weights.image_kernel * spread) ** 2)
    information = visible / spread**2
    return residual, information * factor**2, information * squared * factor


def projection_jacobian(local: np.ndarray, camera: Camera) -> np.ndarray:
    """(N, L, 2, 3) px per m: derivative of the projection by the camera coordinates."""
    depth = np.maximum(local[..., 2], _NEAREST_M)
    out = np.zeros((*local.shape[:2], 2, 3))
    out[..., 0, 0] = out[..., 1, 1] = camera.focal / depth
    out[..., 2] = -camera.focal * local[..., :2] / depth[..., None] ** 2
    return out


def height_residual(state: State, surface: Surface, weights: Weights) -> np.ndarray:
    """(M,) m of each marker above the skin beyond the usual offset."""
    above = state.placement.shaped(state.pose.betas) - surface.point
    return np.einsum("mk,mk->m", above, surface.normal) - weights.offset


def focal_residual(camera: Camera, image_size: tuple[int, int], weights: Weights) -> float:
    """Natural logarithm of the focal length over its guess."""
    return float(np.log(camera.focal / (weights.focal_guess * max(image_size))))
