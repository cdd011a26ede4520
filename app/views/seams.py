"""The edges of a mesh and the triangles that meet there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Seams:
    """Edges of a mesh with the two triangles that meet there: vertices (E, 2) and faces (E, 2), one twice at a rim."""

    vertices: np.ndarray
    faces: np.ndarray


def seams_of(faces: np.ndarray) -> Seams:
    """The edges of a mesh of triangles (F, 3)."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    first = np.flatnonzero(np.concatenate([[True], (edges[1:] != edges[:-1]).any(axis=1)]))
    last = np.concatenate([first[1:], [len(edges)]]) - 1
    return Seams(edges[first], np.stack([owner[first], owner[last]], axis=1))
