"""Vertex normals of a mesh whose vertices move and whose faces stay."""

from __future__ import annotations

import numpy as np
from scipy import sparse


class Normals:
    """Sums face normals, weighed by area, at the vertices; one sparse product a frame.

    Parameters
    ----------
    faces : (F, 3) vertex indices
    count : number of vertices
    """

    def __init__(self, faces: np.ndarray, count: int) -> None:
        self._corners = [np.ascontiguousarray(faces[:, k]) for k in range(3)]
        self.count = count
        ones = np.ones(3 * len(faces), dtype=np.float32)
        of_face = np.repeat(np.arange(len(faces)), 3)
        self._sum = sparse.csr_matrix((ones, (faces.ravel(), of_face)), shape=(count, len(faces)))

    def of(self, vertices: np.ndarray) -> np.ndarray:
        """(V, 3) float32 unit normals of vertices (V, 3); zero where a vertex has no face."""
        a, b, c = (vertices[corner] for corner in self._corners)
        u, v = b - a, c - a
        across = np.empty((len(u), 3), dtype=np.float32)  # np.cross is three times slower
        across[:, 0] = u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]
        across[:, 1] = u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2]
        across[:, 2] = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        normals = self._sum @ across
        normals /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normals, normals)), 1e-20)[:, None]
        return np.asarray(normals)
