"""The heterogeneous graph of markers and joints: who hears whom, told from how markers move and where they sit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from markerscope.solver.core.skeleton import PARENTS

SOLVING, FILLING = 3, 6
"""Neighbours of a marker in the networks that solve, and where gaps are filled (Pan et al. 2023, section 4)."""
NEAR_M = 0.20
"""A marker and a joint closer than this at rest are linked."""

Links = tuple[tuple[int, ...], ...]
"""For each node that receives, the nodes that it hears from."""


@dataclass(frozen=True)
class Graph:
    """Nodes and edges; every node also hears itself, and the one that stands for the whole body hears and tells all.

    Attributes
    ----------
    joints : J of the 24 joints that are nodes, parents first
    parents : J, in ``joints``; -1 where the parent is not among them
    marker_marker : M, the markers that each hears from: itself, then those whose distance varies least
    marker_joint : M, the joints that each marker hears from
    joint_marker : J, the markers that each joint hears from
    joint_joint : J, itself, its parent and its children
    """

    joints: tuple[int, ...]
    parents: tuple[int, ...]
    marker_marker: Links
    marker_joint: Links
    joint_marker: Links
    joint_joint: Links

    @property
    def markers(self) -> int:
        """M."""
        return len(self.marker_marker)

    def plain(self) -> dict[str, Any]:
        """As JSON has it."""
        return asdict(self)

    @classmethod
    def from_plain(cls, said: Mapping[str, Any]) -> Graph:
        """Back from JSON."""

        def links(rows: Iterable[Iterable[int]]) -> Links:
            return tuple(tuple(int(i) for i in row) for row in rows)

        joints, parents = (tuple(int(i) for i in said[name]) for name in ("joints", "parents"))
        nested = ("marker_marker", "marker_joint", "joint_marker", "joint_joint")
        mm, mj, jm, jj = (links(said[name]) for name in nested)
        return cls(joints, parents, mm, mj, jm, jj)


def distance_deviation(markers: np.ndarray) -> np.ndarray:
    """(M, M) m, standard deviation of the distance of two markers over frames (T, M, 3) of one body."""
    points = np.asarray(markers, dtype=np.float64)
    apart = points[:, :, None] - points[:, None]
    return np.asarray(np.sqrt(np.einsum("tijk,tijk->tij", apart, apart)).std(axis=0))


def nearest(deviation: np.ndarray, count: int) -> Links:
    """For each marker, itself and the ``count`` others whose distance to it varies least."""
    order = np.argsort(deviation + np.diag(np.full(len(deviation), np.inf)), axis=1, kind="stable")
    return tuple((m, *(int(k) for k in order[m, :count])) for m in range(len(deviation)))


def build_graph(
    moved: np.ndarray,
    rest_markers: np.ndarray,
    rest_joints: np.ndarray,
    joints: tuple[int, ...],
    *,
    neighbours: int = SOLVING,
    near_m: float = NEAR_M,
) -> Graph:
    """The graph of a layout.

    Parameters
    ----------
    moved : (T, M, 3) m, the markers of one body in many poses
    rest_markers, rest_joints : (M, 3) and (24, 3) m, of the body at rest in T-pose
    joints : those that are to be solved
    near_m : distance up to which marker and joint are linked; the nearest one is linked at any distance
    """
    apart = np.linalg.norm(rest_markers[:, None] - rest_joints[None, list(joints)], axis=2)  # (M, J)
    linked = apart < near_m
    linked[np.arange(len(apart)), apart.argmin(axis=1)] = True
    linked[apart.argmin(axis=0), np.arange(len(joints))] = True
    place = {joint: i for i, joint in enumerate(joints)}
    parents = tuple(place.get(int(PARENTS[joint]), -1) for joint in joints)
    bones = tuple(
        (i, *([parents[i]] if parents[i] >= 0 else []), *(k for k, parent in enumerate(parents) if parent == i))
        for i in range(len(joints))
    )
    return Graph(
        joints,
        parents,
        nearest(distance_deviation(moved), neighbours),
        tuple(tuple(int(j) for j in np.flatnonzero(row)) for row in linked),
        tuple(tuple(int(m) for m in np.flatnonzero(row)) for row in linked.T),
        bones,
    )
