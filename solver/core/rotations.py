"""Rotations as (..., 3, 3) matrices and rotation vectors, batched."""

from __future__ import annotations

import numpy as np

_NEARLY_HALF_A_TURN = 3.1


def exp_so3(vector: np.ndarray) -> np.ndarray:
    """(..., 3) rotation vectors in rad to (..., 3, 3) matrices (Rodrigues)."""
    angle2 = np.einsum("...i,...i->...", vector, vector)
    angle = np.sqrt(angle2)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1 - angle2 / 6, np.sin(safe) / safe)[..., None, None]
    b = np.where(small, 0.5 - angle2 / 24, (1 - np.cos(safe)) / safe**2)[..., None, None]
    k = skew(vector)
    return np.eye(3) + a * k + b * (k @ k)


def log_so3(matrix: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrices to (..., 3) rotation vectors in rad, angle within [0, pi]."""
    twice_sine = np.stack(
        [
            matrix[..., 2, 1] - matrix[..., 1, 2],
            matrix[..., 0, 2] - matrix[..., 2, 0],
            matrix[..., 1, 0] - matrix[..., 0, 1],
        ],
        axis=-1,
    )
    cosine = (matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2] - 1) / 2
    sine = np.sqrt(np.einsum("...i,...i->...", twice_sine, twice_sine)) / 2
    angle = np.arctan2(sine, cosine)
    scale = np.where(sine > 1e-8, angle / np.maximum(2 * sine, 1e-16), 0.5)
    vector = twice_sine * scale[..., None]
    # Near half a turn the sine vanishes and the axis has to be read off the symmetric part.
    turned = angle > _NEARLY_HALF_A_TURN
    if np.any(turned):
        from scipy.spatial.transform import Rotation

        vector[turned] = Rotation.from_matrix(matrix[turned]).as_rotvec()
    return vector


def skew(v: np.ndarray) -> np.ndarray:
    """(..., 3) to the (..., 3, 3) matrix of the cross product with it."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return out


def right_jacobian_inverse(vector: np.ndarray) -> np.ndarray:
    """(..., 3, 3): ``log(R exp(d)) ~ log(R) + Jr^-1 d`` with ``vector = log(R)``."""
    angle2 = np.einsum("...i,...i->...", vector, vector)
    angle = np.sqrt(angle2)
    small = angle < 1e-3
    safe = np.where(small, 1.0, np.minimum(angle, np.pi - 1e-3))
    c = np.where(small, 1 / 12 + angle2 / 720, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
    k = skew(vector)
    return np.eye(3) + 0.5 * k + c[..., None, None] * (k @ k)


def kabsch(source: np.ndarray, target: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
    """Rotation R (..., 3, 3) that best turns centred ``source`` (..., N, 3) into ``target``: target ~ R source."""
    weighted = source if weights is None else source * weights[..., None]
    u, _, vt = np.linalg.svd(np.swapaxes(target, -1, -2) @ weighted)
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., :, 2] *= sign[..., None]
    return u @ vt


def mean_rotation(rotations: np.ndarray) -> np.ndarray:
    """(..., 3, 3), the rotation nearest to all of ``rotations`` (N, ..., 3, 3) by the sum of squared entries."""
    u, _, vt = np.linalg.svd(rotations.mean(axis=0))
    u[..., -1] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[..., None]
    mean: np.ndarray = u @ vt
    return mean


def slerp(rotations: np.ndarray, times: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Rotations (F, J, 3, 3) at ``times`` (F,) s interpolated at ``wanted`` (T,) s; held beyond the ends."""
    if len(times) == 1:
        return np.repeat(rotations, len(wanted), axis=0)
    right = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    left = right - 1
    share = np.clip((wanted - times[left]) / (times[right] - times[left]), 0, 1)
    step = log_so3(np.swapaxes(rotations[left], -1, -2) @ rotations[right])
    return rotations[left] @ exp_so3(step * share[:, None, None])
