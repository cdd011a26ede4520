"""Where a marker sits on the rest body: what skin it rides on, and the surface it is held to."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from markerscope.solver.body.model import Body
from markerscope.solver.core.meshes import normals_at
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.state import Surface

_NEIGHBOURS = 4
_NEGLIGIBLE = 0.02


class Skin:
    """The shaped rest surface of a body, as far as markers can sit on it.

    Parameters
    ----------
    body : the body
    betas : (S,) its shape
    """

    def __init__(self, body: Body, betas: np.ndarray) -> None:
        self.body, self.betas = body, betas
        self.index = np.flatnonzero(body.marker_mask)
        self.surface = body.surface(betas)

    @cached_property
    def _tree(self) -> cKDTree:
        # Asked some forty times each, so that a balanced tree would cost more than it saves.
        return cKDTree(self.surface[self.index], balanced_tree=False, compact_nodes=False)

    def normal(self, vertices: np.ndarray) -> np.ndarray:
        """(..., 3) outward unit normals at given vertices; a fit asks for few of all."""
        flat = normals_at(self.surface, self.body.faces, self.body.faces_around[vertices.ravel()])
        return flat.reshape(*vertices.shape, 3)

    def on_vertices(self, vertices: np.ndarray, height: float) -> tuple[Points, Surface]:
        """Markers (M) set ``height`` m above given vertices."""
        normal = self.normal(vertices)
        placed = self.surface[vertices] + height * normal
        rest = placed - self.body.shape_dirs[vertices] @ self.betas
        points = Points(rest, self.body.shape_dirs[vertices], self.body.weights[vertices])
        return points, Surface(self.surface[vertices], normal)

    def attach(self, placed: np.ndarray) -> tuple[Points, Surface]:
        """Markers at ``placed`` (M, 3) m on the shaped rest body, riding on the skin below them."""
        distance, near = self._tree.query(placed, k=_NEIGHBOURS)
        share = 1 / np.maximum(distance, 1e-4) ** 2
        share /= share.sum(axis=1, keepdims=True)
        near = self.index[near]
        blend = lambda values: np.einsum("mk,mk...->m...", share, values)  # noqa: E731
        dirs = blend(self.body.shape_dirs[near])
        normal = blend(self.normal(near))
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        weights = blend(self.body.weights[near])
        # Traces of far bones would make every marker depend on many joints and tell nothing.
        weights[weights < _NEGLIGIBLE] = 0
        weights /= weights.sum(axis=1, keepdims=True)
        return Points(placed - dirs @ self.betas, dirs, weights), Surface(blend(self.surface[near]), normal)

    def nearest_vertex(self, placed: np.ndarray) -> np.ndarray:
        """(M,) vertex index below each marker."""
        return self.index[self._tree.query(placed)[1]]
