"""The term of the energy that draws markers to the landmarks that they probably sit on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.pull.targets import Targets
from markerscope.solver.fit.terms.term import Estimate

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
    name: str = "landmark_pull"

    @classmethod
    def of(cls, chance: np.ndarray, strength: float, targets: Targets) -> Pull:
        """The pairs whose probability (M, L) is worth counting, each ``strength`` times it."""
        marker, landmark = np.nonzero(chance > _NEGLIGIBLE)
        return cls(marker, landmark, strength * chance[marker, landmark], targets)

    def of_frames(self, frames: np.ndarray | slice) -> Pull:
        """See ``Evidence``."""
        return self

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        return float(pull_residual(at.state.placement, at.state.pose.betas, self)[1].sum()) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        places, placement, shape = len(at.surface.point), at.unknowns.placement, at.unknowns.shape
        gap, _ = pull_residual(at.state.placement, at.state.pose.betas, self)
        # A marker moves the gap one to one; the shape moves both its ends.
        by_shape = at.state.placement.dirs[self.marker] - self.targets.dirs[self.landmark]
        counted = self.strength[:, None] * gap
        own, slope = np.zeros(places), np.zeros((places, 3))
        cross = np.zeros((places, 3, by_shape.shape[2]))
        np.add.at(own, self.marker, self.strength)
        np.add.at(slope, self.marker, counted)
        np.add.at(cross, self.marker, self.strength[:, None, None] * by_shape)
        diagonal_blocks(sums.h_ss[None, placement, placement])[:, 0] += own[:, None, None] * np.eye(3)
        sums.g_s[placement] += slope.ravel()
        flat = cross.reshape(3 * places, -1)
        sums.h_ss[placement, shape] += flat
        sums.h_ss[shape, placement] += flat.T
        sums.h_ss[shape, shape] += np.einsum("k,kas,kat->st", self.strength, by_shape, by_shape)
        sums.g_s[shape] += np.einsum("ka,kas->s", counted, by_shape)


def pull_residual(placement: Points, betas: np.ndarray, pull: Pull) -> tuple[np.ndarray, np.ndarray]:
    """(K, 3) m from each landmark to its marker on the shaped rest body, and (K,) what it costs."""
    gap = placement.shaped(betas)[pull.marker] - pull.targets.shaped(betas)[pull.landmark]
    return gap, pull.strength * np.einsum("ka,ka->k", gap, gap)
