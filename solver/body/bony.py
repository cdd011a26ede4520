"""Bony landmarks that a finger finds under the skin: where laboratories put markers, and which bone each is part of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.meshes import normals_at


@dataclass(frozen=True, eq=False)
class BonySites:
    """Palpable landmarks as points of a body's skin, in the order of ``body.landmark_names``.

    Attributes
    ----------
    names : L names, the sided ones as in ``left_knee_lateral``
    row : (L,) place of each in ``body.landmark_names`` and in every array of ``body.landmark_basis()``
    vertices, values : (L, K) each as a mean of vertices
    bone : (L,) index of the joint whose bone the landmark belongs to by anatomy: with the embedded body's skin weights
        it is also the bone that the skin there moves with, with a user's own SMPL file it need not be
    """

    names: tuple[str, ...]
    row: np.ndarray
    vertices: np.ndarray
    values: np.ndarray
    bone: np.ndarray

    def __len__(self) -> int:
        return len(self.names)

    def points(self, surface: np.ndarray) -> np.ndarray:
        """(..., L, 3) m on surfaces (..., V, 3) of the body."""
        return np.einsum("lk,...lkd->...ld", self.values, surface[..., self.vertices, :])

    def normals(self, body: Body, surface: np.ndarray) -> np.ndarray:
        """(L, 3) outward unit normals on one surface (V, 3) of the body."""
        flat = self.vertices.ravel()
        around = normals_at(surface, body.faces, body.faces_around[flat]).reshape(*self.vertices.shape, 3)
        mean = np.einsum("lk,lkd->ld", self.values, around)
        return mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)


def bony_sites(body: Body) -> BonySites:
    """The palpable landmarks of a body.

    For a shaped body ``sites.points(body.surface(betas))`` and ``sites.normals(body, body.surface(betas))``; how they
    move with shape and pose is rows ``sites.row`` of ``body.landmark_basis()``.
    """
    row = np.flatnonzero(body.landmark_bone >= 0)
    return BonySites(
        names=tuple(body.landmark_names[i] for i in row),
        row=row,
        vertices=body.landmark_vertices[row],
        values=body.landmark_values[row],
        bone=body.landmark_bone[row],
    )
