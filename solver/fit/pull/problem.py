"""The problem of a fit whose markers are drawn to the landmarks that they probably sit on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.targets import Targets
from markerscope.solver.fit.state import Energies, Observations, State, Surface, Weights

_NEGLIGIBLE = 1e-3


@dataclass(frozen=True, eq=False)
class Pull:
    """What draws markers to landmarks on the shaped rest body: ``sum_k strength_k |p_m(k) - q_l(k)|^2``.

    Attributes
    ----------
    marker, landmark : (K,) the pairs
    strength : (K,) 1/m^2; it counts once, not in every frame
    targets : the landmarks
    """

    marker: np.ndarray
    landmark: np.ndarray
    strength: np.ndarray
    targets: Targets

    @classmethod
    def of(cls, chance: np.ndarray, strength: float, targets: Targets) -> Pull:
        """The pairs whose probability (M, L) is worth counting, each ``strength`` times it."""
        marker, landmark = np.nonzero(chance > _NEGLIGIBLE)
        return cls(marker, landmark, strength * chance[marker, landmark], targets)


def pull_residual(placement: Points, betas: np.ndarray, pull: Pull) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) m from each landmark to its marker on the shaped rest body, and (K,) what it costs."""
    gap = placement.shaped(betas)[pull.marker] - pull.targets.shaped(betas)[pull.landmark]
    return gap, pull.strength * np.einsum("ka,ka->k", gap, gap)


class PulledProblem(Problem):
    """Beside everything else, markers are drawn to landmarks.

    Parameters
    ----------
    pull : which markers to which landmarks, how strongly
    """

    def __init__(self, body: Body, seen: Observations, landmarks: Points, pull: Pull) -> None:
        super().__init__(body, seen, landmarks)
        self.pull = pull

    def energies(self, state: State, weights: Weights, surface: Surface) -> Energies:
        """What the state costs, per frame."""
        found = super().energies(state, weights, surface)
        cost = float(pull_residual(state.placement, state.pose.betas, self.pull)[1].sum())
        return replace(found, placement=found.placement + cost / len(self.target))

    def _add_shared(self, sums: NormalEquations, state: State, surface: Surface, weights: Weights) -> None:
        super()._add_shared(sums, state, surface, weights)
        pull, places = self.pull, len(surface.point)
        gap, _ = pull_residual(state.placement, state.pose.betas, pull)
        # A marker moves the gap one to one; the shape moves both its ends.
        by_shape = state.placement.dirs[pull.marker] - pull.targets.dirs[pull.landmark]
        counted = pull.strength[:, None] * gap
        own, slope = np.zeros(places), np.zeros((places, 3))
        cross = np.zeros((places, 3, by_shape.shape[2]))
        np.add.at(own, pull.marker, pull.strength)
        np.add.at(slope, pull.marker, counted)
        np.add.at(cross, pull.marker, pull.strength[:, None, None] * by_shape)
        at, shape = self.placement_at, self.shape_at
        diagonal_blocks(sums.h_ss[None, at, at])[:, 0] += own[:, None, None] * np.eye(3)
        sums.g_s[at] += slope.ravel()
        flat = cross.reshape(3 * places, -1)
        sums.h_ss[at, shape] += flat
        sums.h_ss[shape, at] += flat.T
        sums.h_ss[shape, shape] += np.einsum("k,kas,kat->st", pull.strength, by_shape, by_shape)
        sums.g_s[shape] += np.einsum("ka,kas->s", counted, by_shape)
