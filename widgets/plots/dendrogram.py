"""Where the branches of a tree are drawn, and which of them lie below a cut; no Qt."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np


@dataclass(frozen=True, eq=False)
class Dendrogram:
    """A tree over U leaves, as scipy's linkage writes it.

    Attributes
    ----------
    linkage : (U - 1, 4) children, height and size of each join
    order : (U,) position -> leaf, as drawn from left to right
    """

    linkage: np.ndarray
    order: np.ndarray

    @cached_property
    def places(self) -> tuple[np.ndarray, np.ndarray]:
        """Middle (leaf positions, 0.5 for the first leaf) and height of every node, leaves first: (2 U - 1,) each."""
        leaves = len(self.order)
        middle, height = np.zeros(2 * leaves - 1), np.zeros(2 * leaves - 1)
        middle[self.order] = np.arange(leaves) + 0.5
        for k, (a, b, tall, _) in enumerate(self.linkage):
            middle[leaves + k] = 0.5 * (middle[int(a)] + middle[int(b)])
            height[leaves + k] = tall
        return middle, height

    @cached_property
    def spans(self) -> np.ndarray:
        """First and one past the last position below every node: (2 U - 1, 2)."""
        leaves = len(self.order)
        spans = np.zeros((2 * leaves - 1, 2), np.intp)
        spans[self.order, 0] = np.arange(leaves)
        spans[:leaves, 1] = spans[:leaves, 0] + 1
        for k, (a, b, _, _) in enumerate(self.linkage):
            below = spans[[int(a), int(b)]]
            spans[leaves + k] = below[:, 0].min(), below[:, 1].max()
        return spans

    @cached_property
    def brackets(self) -> np.ndarray:
        """Of each join, left x, its foot, right x, its foot, and the height: (U - 1, 5)."""
        middle, height = self.places
        a, b = self.linkage[:, 0].astype(int), self.linkage[:, 1].astype(int)
        left, right = np.where(middle[a] <= middle[b], a, b), np.where(middle[a] <= middle[b], b, a)
        joins = height[len(self.order) :]
        return np.stack([middle[left], height[left], middle[right], height[right], joins], axis=1)

    @cached_property
    def tallest(self) -> float:
        """Height of the root."""
        return float(self.linkage[:, 2].max()) if len(self.linkage) else 1.0

    def below(self, join: int) -> np.ndarray:
        """Leaves below a join."""
        first, last = self.spans[len(self.order) + join]
        return self.order[first:last]

    def groups_at(self, height: float) -> int:
        """How many groups a cut at this height makes."""
        return len(self.order) - int((self.linkage[:, 2] <= height).sum())


def blocks(groups: np.ndarray) -> list[tuple[int, int, int]]:
    """Neighbours of the same group, as (group, first, one past the last); -1 is no group."""
    if not len(groups):
        return []
    stops = [0, *(np.flatnonzero(np.diff(groups)) + 1).tolist(), len(groups)]
    return [(int(groups[a]), a, b) for a, b in pairwise(stops) if groups[a] >= 0]
