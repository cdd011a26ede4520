"""The frame that the layout-agnostic network works in: the resting trunk laid over the markers of each frame."""

from __future__ import annotations

from functools import cache

import numpy as np

from markerscope.solver.core.rotations import kabsch
from markerscope.solver.core.skeleton import JOINTS, PARENTS

_TRUNK = ("pelvis", "spine1", "spine2", "spine3")


@cache
def trunk_share() -> np.ndarray:
    """(24,) how much a marker on each bone counts: on the trunk 1, and a tenth for each joint between it and there."""
    share = np.zeros(len(JOINTS))
    for j, name in enumerate(JOINTS):
        share[j] = 1.0 if name in _TRUNK else 0.1 * share[PARENTS[j]]
    return share


def align_to_rest(
    markers: np.ndarray, rest: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Markers in the frame in which the resting body's trunk lies best over them.

    A lab that is turned or moved changes the frame and nothing else. Where there are no markers on the trunk, those of
    the limbs decide, the nearest to it first: a part of the body alone can be aligned too.

    Parameters
    ----------
    markers : (B, M, 3) m, NaN = lost
    rest : (B, M, 3) or (M, 3) m, the root joint at the origin
    weights : (B, M, 24) or (M, 24) skinning weights

    Returns
    -------
    aligned : (B, M, 3) m, 0 where lost
    R : (B, 3, 3) and t : (B, 3) m, ``markers = R aligned + t``
    """
    seen = np.isfinite(markers).all(axis=2)
    rest = np.broadcast_to(rest, markers.shape)
    count = seen * np.broadcast_to(weights @ trunk_share(), seen.shape)
    share = count / np.maximum(count.sum(axis=1, keepdims=True), 1e-12)
    given = np.where(seen[..., None], markers, 0.0)
    now, then = (np.einsum("bm,bmk->bk", share, points)[:, None] for points in (given, rest))
    R = kabsch(rest - then, given - now, share)
    t = now[:, 0] - np.einsum("bij,bj->bi", R, then[:, 0])
    aligned = np.where(seen[..., None], (given - t[:, None]) @ R, 0.0)
    return aligned, R, t
