"""Who moves rigidly with whom, as lines between markers: the graph that gaps are filled from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.views.tracks import MarkerTracks
from markerscope.solver.clustering.segment import Segmentation
from markerscope.widgets import palette

MOST = 3
"""Neighbours of a marker that are drawn: a rigid body needs as many."""
LIMIT_M = 0.02
"""Distances that vary by more have the last colour: that is no neighbour any more."""


@dataclass(frozen=True, eq=False)
class Graph:
    """Pairs of markers.

    Attributes
    ----------
    edges : (E, 2) markers, the smaller first
    spread : (E,) m, standard deviation of their distance
    colours : (E, 3) uint8, by the spread: the first of the scale is rigid
    """

    edges: np.ndarray
    spread: np.ndarray
    colours: np.ndarray


def graph_of(found: Segmentation, most: int = MOST) -> Graph:
    """Every marker's most rigid neighbours, of the pairs that were measured; nobody's are left out."""
    spread = np.where(found.measured & np.isfinite(found.affinity), found.affinity, np.inf)
    np.fill_diagonal(spread, np.inf)
    nearest = np.argsort(spread, axis=1, kind="stable")[:, :most]
    owner = np.repeat(np.arange(len(spread)), nearest.shape[1])
    pairs = np.sort(np.stack([owner, nearest.ravel()], axis=1), axis=1)
    edges = np.unique(pairs[np.isfinite(spread[pairs[:, 0], pairs[:, 1]])], axis=0).reshape(-1, 2)
    own = spread[edges[:, 0], edges[:, 1]]
    return Graph(edges, own, palette.sequential(1000 * own, 0.0, 1000 * LIMIT_M))


def graph_at(tracks: MarkerTracks, graph: Graph, frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Start and end (n, 3) m of the lines whose markers are both seen in a frame, and their colours (n, 3)."""
    here = tracks.seen(frame)
    start, end = here[graph.edges[:, 0]], here[graph.edges[:, 1]]
    seen = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    return start[seen], end[seen], graph.colours[seen]
