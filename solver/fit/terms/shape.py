"""Usual shapes: people's, or what the video says of this person's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.terms.term import Estimate


@dataclass(frozen=True, eq=False)
class Shape:
    """How far shape and bone lengths are from the usual.

    Attributes
    ----------
    usual : (S,) shape coefficients
    told : so many of the first are the video's
    """

    usual: np.ndarray
    told: int
    name: str = "shape"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        gap = at.state.pose.betas - self.usual
        return at.weights.shape * float(self._information(at) @ gap**2)

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        shape = at.unknowns.shape
        strength = at.frames * at.weights.shape * self._information(at)
        sums.h_ss[shape, shape] += np.diag(strength)
        sums.g_s[shape] += strength * (at.state.pose.betas - self.usual)

    def _information(self, at: Estimate) -> np.ndarray:
        """(S,) one over the variance of each shape coefficient about the usual: people's, or the video's error."""
        information = np.ones(len(self.usual))
        information[: self.told] = at.weights.video_shape**-2
        return information
