"""The term of the energy that holds markers near the vertices that they are known to sit on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.terms.term import Estimate


@dataclass(frozen=True, eq=False)
class Anchors:
    """How far each marker strays along the skin from its own vertex, once and not in every frame.

    Without this, a longer limb and markers set further along it are nearly the same.

    Attributes
    ----------
    places : (U) where each marker is said to sit
    held : (U,) True where that is known to the vertex
    stray_m : how far hands miss the vertex
    """

    places: Points
    held: np.ndarray
    stray_m: float
    name: str = "anchors"

    def of_frames(self, frames: np.ndarray | slice) -> Anchors:
        """See ``Evidence``."""
        return self

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        return float((self._stray(at) ** 2).sum()) / self.stray_m**2 / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        normal, placement = at.surface.normal, at.unknowns.placement
        along = np.eye(3) - normal[:, :, None] * normal[:, None]
        own = self.held[:, None, None] * along / self.stray_m**2
        diagonal_blocks(sums.h_ss[None, placement, placement])[:, 0] += own
        sums.g_s[placement] += (self._stray(at) / self.stray_m**2).ravel()

    def _stray(self, at: Estimate) -> np.ndarray:
        """(U, 3) m along the skin, zero where no vertex is known."""
        betas, normal = at.state.pose.betas, at.surface.normal
        away = at.state.placement.shaped(betas) - self.places.shaped(betas)
        along = away - np.einsum("mk,mk->m", away, normal)[:, None] * normal
        return np.asarray(along * self.held[:, None])
