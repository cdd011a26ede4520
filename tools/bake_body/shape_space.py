"""Ten shape components of the sampled adults."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

COMPONENTS = 10


@dataclass(frozen=True)
class ShapeSpace:
    """Linear bases over ``betas`` that are about N(0, 1) in the sample.

    Attributes
    ----------
    mean : (P, 3) m
    basis : (P, 3, 10) m per unit of beta
    betas : (N, 10) of the sampled bodies
    explained : (10,) share of the weighted variance, cumulated
    residual : (N, P) m, how far each point is missed
    """

    mean: np.ndarray
    basis: np.ndarray
    betas: np.ndarray
    explained: np.ndarray
    residual: np.ndarray


def fit_shape_space(points: np.ndarray, mass: np.ndarray) -> ShapeSpace:
    """Principal components of points (N, P, 3), each weighed by ``mass`` (P,), from the scalar products of bodies."""
    mean = points.mean(axis=0)
    centred = (points - mean).reshape(len(points), -1)
    weighted = centred * np.repeat(np.sqrt(mass / mass.sum()), 3)
    variance, vectors = np.linalg.eigh(weighted @ weighted.T)
    order = np.argsort(variance)[::-1][:COMPONENTS]
    scores = vectors[:, order] * np.sqrt(len(points))
    basis = np.linalg.lstsq(scores, centred, rcond=None)[0]
    # A beta that makes the body larger counts up: an eigenvector's sign is arbitrary, the body's growth is not.
    sign = np.where(_growth(basis, mean) < 0, -1.0, 1.0)
    scores, basis = scores * sign, basis * sign[:, None]
    residual = (centred - scores @ basis).reshape(points.shape)
    return ShapeSpace(
        mean=mean,
        basis=basis.reshape(COMPONENTS, -1, 3).transpose(1, 2, 0),
        betas=scores,
        explained=np.cumsum(variance[order]) / variance.sum(),
        residual=np.linalg.norm(residual, axis=-1),
    )


def _growth(basis: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """(10,) how much each component moves points away from the origin."""
    return basis @ mean.ravel()
