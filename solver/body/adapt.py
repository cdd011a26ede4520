"""A user's own SMPL body brought into the shape that the solver drives: landmarks, coarse mesh, marker places.

What an SMPL file does not name (landmarks, where markers can sit) is carried over from the embedded body: each bone's
skin is laid over the other's by scaling along the bones, and the nearest vertex takes the name.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import PARENTS


def load_smpl(path: str | Path) -> Body:
    """The body in a user's ``SMPL_*.npz`` or ``.pkl``."""
    from markerscope.solver.body.smpl_file import read_smpl_file

    data = read_smpl_file(path)
    template, regressor = data["v_template"], data["J_regressor"]
    # A vertex of an SMPL file follows at most four bones; more would make every product slower for nothing.
    order = np.argsort(-data["weights"], axis=1)[:, :4]
    values = np.take_along_axis(data["weights"], order, axis=1)
    own = Body(
        template=template,
        shape_dirs=data["shapedirs"],
        joint_template=regressor @ template,
        joint_dirs=np.einsum("jv,vks->jks", regressor, data["shapedirs"]),
        weights_index=order,
        weights_value=values / values.sum(axis=1, keepdims=True),
        faces=data["f"],
        lod_index=np.arange(len(template)),
        lod_faces=data["f"],
        marker_mask=np.ones(len(template), bool),
        landmark_names=(),
        landmark_vertices=np.zeros((0, 1), int),
        landmark_values=np.zeros((0, 1)),
        landmark_joint=np.zeros(0, int),
        landmark_bone=np.zeros(0, int),
        betas_count=data["shapedirs"].shape[2],
        pose_dirs=data.get("posedirs"),
        name=Path(path).name,
        kind="smpl",
        digest=hashlib.sha256(Path(path).read_bytes()).hexdigest()[:16],
    )
    return _named_like(own, Body.load())


def _named_like(own: Body, known: Body) -> Body:
    from dataclasses import replace

    carried = _carried(known, own.joint_template)
    to_known = cKDTree(carried).query(own.template)[1]
    to_own = cKDTree(own.template)
    points = np.einsum("nk,nkd->nd", known.landmark_values, carried[known.landmark_vertices])
    spacing, vertices = to_own.query(points, k=min(3, len(own.template)))
    share = 1 / np.maximum(spacing, 1e-4)
    coarse = np.unique(to_own.query(carried[known.lod_index])[1])
    return replace(
        own,
        lod_index=coarse,
        lod_faces=_coarse_faces(own.template, own.faces, coarse),
        marker_mask=known.marker_mask[to_known],
        landmark_names=known.landmark_names,
        landmark_vertices=vertices.reshape(len(points), -1),
        landmark_values=(share / share.sum(axis=-1, keepdims=True)).reshape(len(points), -1),
        landmark_joint=known.landmark_joint,
        landmark_bone=known.landmark_bone,
        _torch={},
    )


def _coarse_faces(vertices: np.ndarray, faces: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """(Lf, 3) triangles between seeds (L,): a face whose corners are nearest to three of them joins these three.

    Nearness is measured along the surface, so that neighbouring fingers do not grow together.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    graph = coo_matrix((np.maximum(length, 1e-9), edges.T), shape=(len(vertices),) * 2).tocsr()
    nearest = dijkstra(graph, directed=False, indices=seeds, min_only=True, return_predecessors=True)[2]
    position = np.full(len(vertices) + 1, -1)  # what no seed reaches has a negative source: the last place
    position[seeds] = np.arange(len(seeds))
    corners = position[np.where(nearest < 0, -1, nearest)][faces]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a) & (corners >= 0).all(axis=1)]
    first = np.argmin(corners, axis=1)[:, None]
    return np.unique(np.take_along_axis(corners, (first + np.arange(3)) % 3, axis=1), axis=0)


def _carried(known: Body, joints: np.ndarray) -> np.ndarray:
    """(V, 3) m, the embedded template with its bones moved and stretched onto other joint centres."""
    scale = np.ones(len(joints))
    for j in range(1, len(joints)):
        p = PARENTS[j]
        length = np.linalg.norm(known.joint_template[j] - known.joint_template[p])
        scale[p] = np.linalg.norm(joints[j] - joints[p]) / max(float(length), 1e-6)
    scale[[0, 9]] = np.linalg.norm(joints[9] - joints[0]) / np.linalg.norm(
        known.joint_template[9] - known.joint_template[0]
    )
    local = known.template[:, None] - known.joint_template[None]
    moved = joints[None] + local * scale[None, :, None]
    return np.einsum("vj,vjk->vk", known.weights, moved)
