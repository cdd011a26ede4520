"""A coarse mesh whose vertices are vertices of the full one, evenly spread, and closed.

Seeds are relaxed (Lloyd) under geodesic distance; the coarse mesh is the dual of their Voronoi regions, so a triangle
of the full mesh whose corners lie in three regions becomes a triangle of the coarse one.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

RELAXATIONS = 12
REPAIRS = 50
"""Seeds that may be added where regions meet twice, as around a finger."""


def coarse_mesh(
    vertices: np.ndarray, faces: np.ndarray, allowed: np.ndarray, detail: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Vertex ids (L,) and faces (Lf, 3) into them; ``detail`` (V,) says how much finer than elsewhere a place is."""
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    length = length * detail[edges].mean(axis=1)
    graph = sp.coo_matrix((length, edges.T), shape=(len(vertices),) * 2).tocsr()
    graph = graph + graph.T
    mass = vertex_areas(vertices, faces) * detail**2
    seeds = _spread(graph, allowed, count)
    for _ in range(RELAXATIONS):
        seeds = _relax(graph, vertices, mass, allowed, seeds)
    dual = _dual(faces, _regions(graph, seeds))
    for _ in range(REPAIRS):
        bad = bad_edges(dual)
        around = bad[0] if len(bad) else pinched_vertices(dual)[:1]
        if not len(around):
            break
        seeds = np.append(seeds, _farthest(graph, allowed, seeds, around))
        dual = _dual(faces, _regions(graph, seeds))
    used = np.unique(dual)
    place = np.full(len(seeds), -1)
    place[used] = np.arange(len(used))
    return seeds[used], place[dual]


def vertex_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V,) a third of the area of the faces around each vertex, m^2."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(faces.ravel(), np.repeat(area / 3, 3), minlength=len(vertices))


def _regions(graph: sp.csr_matrix, seeds: np.ndarray) -> np.ndarray:
    """(V,) which seed each vertex is nearest to."""
    _, _, source = dijkstra(graph, indices=seeds, min_only=True, return_predecessors=True)
    order = np.full(graph.shape[0], -1)
    order[seeds] = np.arange(len(seeds))
    return order[source]


def _spread(graph: sp.csr_matrix, allowed: np.ndarray, count: int) -> np.ndarray:
    """Farthest-point sampling: each seed is the allowed vertex farthest from those before it."""
    start = int(np.flatnonzero(allowed)[0])
    seeds = [start]
    distance = dijkstra(graph, indices=[start])[0]
    while len(seeds) < count:
        seeds.append(int(np.argmax(np.where(allowed, distance, -1))))
        reach = distance.max()
        distance = np.minimum(distance, dijkstra(graph, indices=seeds[-1:], limit=float(reach))[0])
    return np.array(seeds)


def _relax(
    graph: sp.csr_matrix, vertices: np.ndarray, mass: np.ndarray, allowed: np.ndarray, seeds: np.ndarray
) -> np.ndarray:
    """Move every seed to the allowed vertex of its region nearest to the region's centroid."""
    region = _regions(graph, seeds)
    total = np.bincount(region, mass, minlength=len(seeds))
    centroid = np.stack([np.bincount(region, mass * x, minlength=len(seeds)) for x in vertices.T], axis=1)
    distance = np.linalg.norm(vertices - (centroid / total[:, None])[region], axis=1)
    distance = np.where(allowed, distance, np.inf)
    order = np.lexsort((distance, region))
    first = order[np.searchsorted(region[order], np.arange(len(seeds)))]
    return np.where(np.isfinite(distance[first]), first, seeds)


def _farthest(graph: sp.csr_matrix, allowed: np.ndarray, seeds: np.ndarray, regions: np.ndarray) -> int:
    """The allowed vertex farthest from its seed in the given regions."""
    distance = dijkstra(graph, indices=seeds, min_only=True)
    return int(np.argmax(np.where(allowed & np.isin(_regions(graph, seeds), regions), distance, -1)))


def _dual(faces: np.ndarray, region: np.ndarray) -> np.ndarray:
    """(F', 3) triangles between regions (V,) that meet at a face, each once, with the face's orientation."""
    corner = region[faces]
    distinct = (corner[:, 0] != corner[:, 1]) & (corner[:, 1] != corner[:, 2]) & (corner[:, 2] != corner[:, 0])
    triangles = corner[distinct]
    first = np.argmin(triangles, axis=1)[:, None]
    return np.unique(np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1), axis=0)


def bad_edges(faces: np.ndarray) -> np.ndarray:
    """(E, 2) directed edges without an opposite, or met twice: none in a closed, oriented manifold."""
    edges, counts = np.unique(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=0, return_counts=True)
    present = {(int(a), int(b)) for a, b in edges}
    lonely = np.array([(int(b), int(a)) not in present for a, b in edges], dtype=bool)
    return edges[lonely | (counts > 1)]


def pinched_vertices(faces: np.ndarray) -> np.ndarray:
    """(n,) vertices of a closed mesh whose faces are not one fan: where two parts of it touch in a point."""
    corners, ahead, behind = faces.ravel(), faces[:, [1, 2, 0]].ravel(), faces[:, [2, 0, 1]].ravel()
    found = []
    for vertex in np.unique(faces):
        own = corners == vertex
        beyond = dict(zip(ahead[own].tolist(), behind[own].tolist()))
        start = next(iter(beyond))
        at, fan = beyond[start], 1
        while at != start:
            at, fan = beyond[at], fan + 1
        if fan < len(beyond):
            found.append(vertex)
    return np.array(found, dtype=int)
