"""Markers as high over the skin as markers are, sliding on it little by little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.state import State, Surface, Weights
from markerscope.solver.fit.terms.term import Estimate


def height_residual(state: State, surface: Surface, weights: Weights) -> np.ndarray:
    """(M,) m of each marker above the skin beyond the usual offset."""
    above = state.placement.shaped(state.pose.betas) - surface.point
    return np.einsum("mk,mk->m", above, surface.normal) - weights.offset


@dataclass(frozen=True)
class Height:
    """How far each marker's height over the skin is from the usual, once and not in every frame."""

    name: str = "placement"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        height = height_residual(at.state, at.surface, at.weights)
        return float(((height / at.weights.offset_spread) ** 2).sum()) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``; the slide along the skin is damped, which costs nothing."""
        weights, normal, placement = at.weights, at.surface.normal, at.unknowns.placement
        height = height_residual(at.state, at.surface, weights)
        own = normal[:, :, None] * normal[:, None] / weights.offset_spread**2 + np.eye(3) / weights.slide**2
        diagonal_blocks(sums.h_ss[None, placement, placement])[:, 0] += own
        sums.g_s[placement] += (normal * height[:, None]).ravel() / weights.offset_spread**2
