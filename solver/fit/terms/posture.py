"""Common postures: joints by the ranges that people use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.rotations import log_so3, right_jacobian_inverse
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.state import FREE, State, Weights
from markerscope.solver.fit.terms.term import Estimate


def habit_residual(state: State, weights: Weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, K, 3) rad between each joint and a relaxed pose; weight (K, 3), cost (N, K, 3)."""
    relaxed = np.swapaxes(anatomical.mean_pose()[FREE], -1, -2)
    residual = log_so3(relaxed @ state.pose.rotations[:, FREE])
    information = weights.anatomical / anatomical.spread()[FREE] ** 2
    return residual, information, information * residual**2


@dataclass(frozen=True)
class Posture:
    """How far each joint is turned from a relaxed pose."""

    name: str = "anatomical"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        return float(habit_residual(at.state, at.weights)[2].sum()) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        habit, information, _ = habit_residual(at.state, at.weights)
        by_turn = right_jacobian_inverse(habit)
        sums.add_joints(
            np.swapaxes(by_turn, -1, -2) @ (information[..., None] * by_turn),
            (np.swapaxes(by_turn, -1, -2) @ (information * habit)[..., None])[..., 0],
        )
