"""A track beside what its neighbours tell of it: what is left is what it does alone."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.neighbours import neighbours_of

_NEIGHBOURS = 8
_FEWEST = 3
_FEWEST_FRAMES = 30
"""Frames that the relation can be learnt from."""
_TOGETHER = 0.8
"""Of the frames that show a marker, a neighbour has to be seen in."""
_NOISE_M = 0.001
"""Of a second difference: the ridge."""


def beside_neighbours(positions: np.ndarray, sound: np.ndarray) -> np.ndarray:
    """(T, M, 3) m, tracks less a weighted sum of their neighbours' that accelerates as they do.

    On a rigid body a point is the same weighted sum of others in every frame, however the body moves, so its
    acceleration is that of theirs. The weights are learnt from accelerations: where the body moves fast counts most.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    sound : (T, M, 3) m, the same with what is known to be wrong mended: what neighbours tell is taken from it

    Returns
    -------
    beside : NaN where too few neighbours are seen
    """
    beside = np.full_like(positions, np.nan)
    present = np.isfinite(sound).all(axis=2)
    pull = np.full_like(sound, np.nan)
    pull[1:-1] = sound[1:-1] - 0.5 * (sound[:-2] + sound[2:])
    near = neighbours_of(sound)
    together = present.T.astype(float) @ present / np.maximum(present.sum(axis=0), 1)[:, None]
    for m in range(positions.shape[1]):
        group = near.nearest(m, together[m] > _TOGETHER, _NEIGHBOURS)
        if len(group) < _FEWEST:
            continue
        rows = np.flatnonzero(np.isfinite(pull[:, [m, *group]]).all(axis=(1, 2)))
        if len(rows) < _FEWEST_FRAMES:
            continue
        theirs = pull[rows][:, group].transpose(0, 2, 1).reshape(-1, len(group))
        gram = theirs.T @ theirs + _NOISE_M**2 * len(theirs) * np.eye(len(group))
        weights = np.linalg.solve(gram, theirs.T @ pull[rows, m].ravel())
        beside[:, m] = positions[:, m] - np.einsum("tki,k->ti", sound[:, group], weights)
    return beside
