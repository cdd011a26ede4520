"""The problem of a fit whose markers are held near the vertices that they are known to sit on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import Energies, Observations, State, Surface, Weights


class AnchoredProblem(Problem):
    """Beside everything else, a marker may stray along the skin from its own vertex only so far.

    Without this, a longer limb and markers set further along it are nearly the same.

    Parameters
    ----------
    anchors : (U) where each marker is said to sit
    held : (U,) True where that is known to the vertex
    stray_m : how far hands miss the vertex
    """

    def __init__(self, body: Body, seen: Observations, anchors: Points, held: np.ndarray, stray_m: float) -> None:
        super().__init__(body, seen, Points(np.zeros((0, 3)), np.zeros((0, 3, body.shape_count)), np.zeros((0, 24))))
        self.anchors, self.held, self.stray_m = anchors, held, stray_m

    def energies(self, state: State, weights: Weights, surface: Surface) -> Energies:
        """What the state costs, per frame."""
        found = super().energies(state, weights, surface)
        stray = float((self._stray(state, surface) ** 2).sum()) / self.stray_m**2 / len(self.target)
        return replace(found, placement=found.placement + stray)

    def _add_shared(self, sums: NormalEquations, state: State, surface: Surface, weights: Weights) -> None:
        super()._add_shared(sums, state, surface, weights)
        stray = self._stray(state, surface)
        for m in np.flatnonzero(self.held):
            start = self.placement_at.start + 3 * int(m)
            at = slice(start, start + 3)
            normal = surface.normal[m]
            sums.h_ss[at, at] += (np.eye(3) - np.outer(normal, normal)) / self.stray_m**2
            sums.g_s[at] += stray[m] / self.stray_m**2

    def _stray(self, state: State, surface: Surface) -> np.ndarray:
        """(U, 3) m along the skin, zero where no vertex is known."""
        betas = state.pose.betas
        away = state.placement.shaped(betas) - self.anchors.shaped(betas)
        along = away - np.einsum("mk,mk->m", away, surface.normal)[:, None] * surface.normal
        return np.asarray(along * self.held[:, None])
