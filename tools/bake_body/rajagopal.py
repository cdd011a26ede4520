"""The bones of Rajagopal et al. (2016), out of the wheel of the PyPI package ``nimblephysics``, which carries them.

Only members of the archive are read; the package itself is neither needed nor run.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

FOLDER = "nimblephysics/models/rajagopal_data"
PATELLA = (0.0524, -0.0108, 0.00275)
"""m, translation of the kneecap on the thigh with a straight knee (splines f9, f10 and the constant of the joint)."""
PRONATED = np.radians(90.0)
"""Turn of the radius about the ulna in the rest pose of the body, whose palms face down with its arms out."""


@dataclass(frozen=True)
class Mesh:
    """Vertices (V, 3) m in the axes of the model's body, faces (F, 3)."""

    vertices: np.ndarray
    faces: np.ndarray


class Model:
    """Meshes and body frames of the model's right side and trunk, standing, its forearm pronated."""

    def __init__(self, wheel: Path) -> None:
        self._archive = zipfile.ZipFile(wheel)
        root = ElementTree.fromstring(self._archive.read(f"{FOLDER}/Rajagopal2015.osim"))
        self._bodies = {body.attrib["name"]: body for body in root.iter("Body")}

    def mesh(self, name: str, body: str) -> Mesh:
        """A bone by its name, with ``#ribs`` or ``#right`` a part of the one of ribs and shoulder girdle."""
        name, _, part = name.partition("#")
        mesh = _read_ply(self._archive.read(f"{FOLDER}/Geometry/{name}.vtp.ply"))
        element = self._bodies[body if body in self._bodies else f"{body}_r"]
        # The hand is drawn smaller than its meshes are.
        whole = np.array(element.find("VisibleObject").findtext("scale_factors", "1 1 1").split(), float)  # type: ignore[union-attr]
        return (
            _girdle(Mesh(mesh.vertices * whole, mesh.faces), part) if part else Mesh(mesh.vertices * whole, mesh.faces)
        )

    def frame(self, body: str, seen_from: str) -> np.ndarray:
        """(4, 4) of one body's axes in another's."""
        return np.linalg.inv(self._in_ground(seen_from)) @ self._in_ground(body)

    def _in_ground(self, body: str) -> np.ndarray:
        if body == "ground":
            return np.eye(4)
        element = self._bodies[body if body in self._bodies else f"{body}_r"]
        joint = element.find("Joint")[0]  # type: ignore[index]
        parent = self._in_ground(joint.findtext("parent_body", "ground"))
        there = _transform(joint, "location_in_parent", "orientation_in_parent")
        here = _transform(joint, "location", "orientation")
        between = np.eye(4)
        if body == "radius":
            between[:3, :3] = Rotation.from_euler("z", PRONATED).as_matrix()
        elif body == "patella":
            between[:3, 3] = PATELLA
        return parent @ there @ between @ np.linalg.inv(here)


def _transform(joint: ElementTree.Element, place: str, turn: str) -> np.ndarray:
    found = np.eye(4)
    found[:3, 3] = [float(x) for x in joint.findtext(place, "0 0 0").split()]
    angles = [float(x) for x in joint.findtext(turn, "0 0 0").split()]
    found[:3, :3] = Rotation.from_euler("XYZ", angles).as_matrix()
    return found


def _read_ply(raw: bytes) -> Mesh:
    start = raw.index(b"end_header\n") + len(b"end_header\n")
    header = raw[:start].decode("ascii")
    vertices, faces = (int(re.search(rf"element {what} (\d+)", header)[1]) for what in ("vertex", "face"))  # type: ignore[index]
    columns = header.split("element face")[0].count("property float")
    points = np.frombuffer(raw, "<f4", vertices * columns, start).reshape(vertices, columns)[:, :3]
    corners, at = [], start + 4 * vertices * columns
    for _ in range(faces):
        count = raw[at]
        ring = np.frombuffer(raw, "<i4", count, at + 1)
        corners += [(ring[0], ring[k], ring[k + 1]) for k in range(1, count - 1)]
        at += 1 + 4 * count
    return Mesh(points.astype(float), np.array(corners, dtype=int))


def pieces(mesh: Mesh, smallest: int = 10) -> list[Mesh]:
    """Connected parts, without what is no bone: single faces left over beside the shoulder blades."""
    edges = mesh.faces[:, [0, 1, 1, 2]].reshape(-1, 2)
    _, same = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    edges = np.concatenate([edges, np.stack([np.arange(len(same)), _first(same.ravel())], axis=1)])
    graph = sp.coo_matrix((np.ones(len(edges)), edges.T), shape=(len(mesh.vertices),) * 2)
    label = connected_components(graph, directed=False)[1]
    found = []
    for one in range(label.max() + 1):
        kept = label == one
        if kept.sum() >= smallest:
            place = np.cumsum(kept) - 1
            found.append(Mesh(mesh.vertices[kept], place[mesh.faces[kept[mesh.faces].all(axis=1)]]))
    return found


def _first(group: np.ndarray) -> np.ndarray:
    """For each entry the first one of its group."""
    _, first = np.unique(group, return_index=True)
    return first[group]


def joined(meshes: list[Mesh]) -> Mesh:
    """All in one."""
    starts = np.cumsum([0, *[len(mesh.vertices) for mesh in meshes]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts)]),
    )


def _girdle(mesh: Mesh, part: str) -> Mesh:
    """Shoulder blade and collar bone of the right side, or all but those of both."""
    right, ribs = [], []
    for piece in pieces(mesh):
        middle, size = piece.vertices.mean(axis=0), np.ptp(piece.vertices, axis=0)
        blade = abs(middle[2]) > 0.1 and size[1] > 0.12
        collar = middle[1] > 0.375 and size[2] > 0.1 and abs(middle[2]) > 0.04 and size[0] < 0.05
        if blade or collar:
            right += [piece] if middle[2] > 0 else []
        else:
            ribs.append(piece)
    return joined(right if part == "right" else ribs)
