"""The outline of a mesh in a picture: the edges between what faces the camera and what does not."""

from __future__ import annotations

import numpy as np


class Outline:
    """Prepared once for the faces of a mesh.

    Parameters
    ----------
    faces : (F, 3) vertex indices, all turned the same way round
    """

    def __init__(self, faces: np.ndarray) -> None:
        self._faces = np.asarray(faces, dtype=np.int64)
        edges = np.sort(
            np.concatenate([self._faces[:, [0, 1]], self._faces[:, [1, 2]], self._faces[:, [2, 0]]]), axis=1
        )
        owner = np.tile(np.arange(len(self._faces)), 3)
        order = np.lexsort((edges[:, 1], edges[:, 0]))
        edges, owner = edges[order], owner[order]
        pair = (edges[1:] == edges[:-1]).all(axis=1)
        single = ~(np.append(pair, False) | np.insert(pair, 0, False))[: len(edges)]  # a mesh may have no faces
        self._edges = np.concatenate([edges[:-1][pair], edges[single]])
        self._sides = np.concatenate(
            [np.stack([owner[:-1][pair], owner[1:][pair]], axis=1), np.stack([owner[single], owner[single]], axis=1)]
        )
        self._rim = np.arange(len(self._edges)) >= int(pair.sum())

    def segments(self, pixels: np.ndarray) -> np.ndarray:
        """(S, 2, 2) px from the vertices' pixels (V, 2); those with a vertex that is NaN are left out."""
        a, b, c = (pixels[self._faces[:, k]] for k in range(3))
        facing = ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])) < 0
        turned = (facing[self._sides[:, 0]] != facing[self._sides[:, 1]]) | self._rim
        found = pixels[self._edges[turned]]
        return np.asarray(found[np.isfinite(found).all(axis=(1, 2))])
