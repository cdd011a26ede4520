"""Skin on the bone that it lies on: the rig's weights made rigid about palpable bone, by ``bony_landmarks.toml``."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import dijkstra

from markerscope.solver.core.skeleton import INDEX, JOINTS
from tools.bake_body.picker import Landmark, Picker

TABLE = Path(__file__).with_name("bony_landmarks.toml")
_SURE = 1e-6
"""What a claim that is beyond doubt leaves to others."""
STEP = 0.005
"""m between the points that an edge of bone is followed by."""


@dataclass(frozen=True)
class BonySkin:
    """Skin that moves with one bone: about a landmark, or along an edge of bone from landmark to landmark.

    Attributes
    ----------
    along : names of the landmarks, one or more
    bone : index of the joint whose bone it is
    core : m along the skin, within which the skin moves with that bone alone
    reach : m beyond which the rig's weights hold
    site : a marker on the landmark can be palpated for
    """

    along: tuple[str, ...]
    bone: int
    core: float
    reach: float
    site: bool


def read_table(path: Path = TABLE) -> list[BonySkin]:
    """Every landmark and edge of the table, both sides."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    rows = [({"along": [name], "site": True} | row) for name, row in table["landmark"].items()]
    rows += [row | {"site": False} for row in table["ridge"]]
    return [skin for row in rows for skin in _both_sides(row)]


def _both_sides(row: Mapping) -> Iterator[BonySkin]:
    sided = "{side}" in row["bone"] + "".join(row["along"])
    for side in ("left", "right") if sided else ("",):
        along = tuple(name.format(side=side) for name in row["along"])
        bone = INDEX[row["bone"].format(side=side)]
        yield BonySkin(along, bone, row["core"] / 1000, row["reach"] / 1000, row["site"])


def bones_of_landmarks(table: list[BonySkin]) -> dict[str, int]:
    """The joint of the bone that each palpable landmark is a point of."""
    return {row.along[0]: row.bone for row in table if row.site}


def rigid_weights(
    weights: np.ndarray, picker: Picker, skin: np.ndarray, found: Mapping[str, Landmark], table: list[BonySkin]
) -> np.ndarray:
    """(V, 24) weights with the skin about bony landmarks on its bone.

    Where several bones claim a place, as at the elbow, they share it by the odds of their claims, so that what is in
    the core of one is its alone.

    Parameters
    ----------
    weights : (V, 24) of the rig, rows summing to 1
    picker : the mean body in the A-pose
    skin : (V,) bool, outer skin
    found : every landmark that the table names
    """
    claim = np.zeros(weights.shape)
    graph = _edge_lengths(picker)
    for row in table:
        distance = _along_the_skin(graph, picker, skin, [found[name] for name in row.along], row.reach)
        claim[:, row.bone] = np.maximum(claim[:, row.bone], _falloff(distance, row.core, row.reach))
    odds = claim / (1 - claim + _SURE)
    left = (1 - claim).prod(axis=1, keepdims=True)
    return (1 - left) * odds / np.maximum(odds.sum(axis=1, keepdims=True), 1e-12) + left * weights


def _falloff(distance: np.ndarray, core: float, reach: float) -> np.ndarray:
    """1 up to ``core``, 0 from ``reach`` on, without a kink in between."""
    x = np.clip((reach - distance) / (reach - core), 0, 1)
    return x * x * (3 - 2 * x)


def _edge_lengths(picker: Picker) -> sp.csr_matrix:
    """(V, V) m, from vertex to vertex along the edges and across each pair of faces that share one."""
    vertices, faces = picker.vertices, picker.faces
    pairs = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    opposite = faces[:, [2, 0, 1]].ravel()
    order = np.lexsort(pairs.T)
    one, two = order[:-1], order[1:]
    shared = (pairs[one] == pairs[two]).all(axis=1)
    across = np.sort(np.stack([opposite[one[shared]], opposite[two[shared]]], axis=1), axis=1)
    edges = np.unique(np.concatenate([pairs, across]), axis=0)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    return sp.coo_matrix((length, edges.T), shape=(len(vertices),) * 2).tocsr()


def _along_the_skin(
    graph: sp.csr_matrix, picker: Picker, skin: np.ndarray, landmarks: list[Landmark], limit: float
) -> np.ndarray:
    """(V,) m from the landmark, or from the edge of bone that lies between landmarks; inf beyond ``limit``."""
    points = _points(picker, skin, landmarks)
    # The points become vertices of their own, joined to the corners of the faces they lie on.
    count = len(picker.vertices)
    rows = np.concatenate([np.full(len(p.vertices), count + i) for i, p in enumerate(points)])
    corners = np.concatenate([p.vertices for p in points]).astype(int)
    at = np.repeat([p.of(picker.vertices) for p in points], [len(p.vertices) for p in points], axis=0)
    length = np.linalg.norm(picker.vertices[corners] - at, axis=1)
    edges = graph.tocoo()
    size = count + len(points)
    joined = sp.coo_matrix(
        (
            np.concatenate([edges.data, np.maximum(length, 1e-9)]),
            (np.concatenate([edges.row, rows]), np.concatenate([edges.col, corners])),
        ),
        shape=(size, size),
    ).tocsr()
    sources = np.arange(count, size)
    return dijkstra(joined, directed=False, indices=sources, min_only=True, limit=limit)[:count]


def _points(picker: Picker, skin: np.ndarray, landmarks: list[Landmark]) -> list[Landmark]:
    """The landmarks and, between them, the vertices of the skin nearest to the straight line."""
    found = list(landmarks)
    for one, other in pairwise(landmarks):
        start, end = one.of(picker.vertices), other.of(picker.vertices)
        steps = int(np.linalg.norm(end - start) // STEP)
        found += [picker.nearest(start + (end - start) * k / (steps + 1), skin) for k in range(1, steps + 1)]
    return found


def report_skin(weights: np.ndarray, found: Mapping[str, Landmark], table: list[BonySkin]) -> None:
    """Print how much of the skin at each landmark moves with the landmark's bone."""
    print("skin at bony landmarks that moves with their bone:")
    for name, bone in bones_of_landmarks(table).items():
        if not name.startswith("right"):
            share = np.array(found[name].values) @ weights[list(found[name].vertices), bone]
            print(f"  {name:24s}{JOINTS[bone]:16s}{100 * share:5.0f} %")
