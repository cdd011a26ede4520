"""Which markers a lost one can be told from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.clustering.affinity import affinity

_COMPARED = 600
"""Frames from which distances are compared at most; their spread changes little with more."""
_FEWEST_TOGETHER = 5
"""Compared frames that two markers must share."""


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Markers ordered by how little their distance varies (the paper's locality).

    Attributes
    ----------
    order : (M, M) indices, for each marker the others, least spread first; itself and unknown ones come last
    spread : (M, M) m, standard deviation of the distance; infinite where it is not known, and to itself
    """

    order: np.ndarray
    spread: np.ndarray

    def nearest(self, marker: int, usable: np.ndarray, most: int) -> np.ndarray:
        """Up to ``most`` neighbours among the ``usable`` (M,) markers, least spread first."""
        order = self.order[marker]
        return order[usable[order] & np.isfinite(self.spread[marker, order])][:most]


def neighbours_of(positions: np.ndarray) -> Neighbours:
    """Neighbours of every marker of (T, M, 3) m, NaN = lost."""
    pairs = affinity(positions, max_frames=_COMPARED)
    enough = min(_FEWEST_TOGETHER, max(2, pairs.frames))
    spread = np.where((pairs.overlap >= enough) & np.isfinite(pairs.deviation), pairs.deviation, np.inf)
    np.fill_diagonal(spread, np.inf)
    return Neighbours(np.argsort(spread, axis=1, kind="stable"), spread)
