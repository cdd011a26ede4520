"""The pool of candidate "chains" (section 3.4.2): connected subtrees of the bones, less those that nearly repeat."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import JOINTS, subtrees


def candidate_chains(groups: int, shared: float = 0.9) -> tuple[int, tuple[frozenset[int], ...]]:
    """How many chains of as many bones as there are groups exist, and those that remain after pruning.

    Parameters
    ----------
    groups : K; more than there are bones count as all of them
    shared : a chain goes if it has more than this part of its bones in common with one kept before
    """
    size = int(np.clip(groups, 1, len(JOINTS)))
    kept: list[frozenset[int]] = []
    every = subtrees(size)
    for chain in every:
        if all(len(chain & other) <= shared * size for other in kept):
            kept.append(chain)
    return len(every), tuple(kept)
