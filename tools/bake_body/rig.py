"""From the rig's 104 bones to SMPL's 24 joints, and from a mesh with loose parts to one closed skin."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from markerscope.solver.core.skeleton import JOINTS
from tools.bake_body.source import Sample

WEIGHTS = 4
SMOOTHINGS = 4

_SIDED = {
    "hip": "upperleg01",
    "knee": "lowerleg01",
    "ankle": "foot",
    "foot": "toe2-1",
    "collar": "clavicle",
    "shoulder": "upperarm01",
    "elbow": "lowerarm01",
    "wrist": "wrist",
    "hand": "finger3-1",
}
_MIDLINE = {"spine1": "spine04", "spine2": "spine03", "spine3": "spine02", "neck": "neck01", "head": "head"}
BONE_OF_JOINT = _MIDLINE | {
    f"{side}_{joint}": f"{bone}.{letter}"
    for side, letter in (("left", "L"), ("right", "R"))
    for joint, bone in _SIDED.items()
}
"""The rig bone that each of SMPL's joints takes over; the pelvis has none."""


def merge_joints(sample: Sample) -> np.ndarray:
    """(N, 24, 3) the rig's own centres of SMPL's joints; the pelvis lies midway between hips and lumbar spine."""
    joints = np.zeros((len(sample.bones), len(JOINTS), 3))
    for j, name in enumerate(JOINTS):
        if name in BONE_OF_JOINT:
            joints[:, j] = sample.bones[:, sample.labels.index(BONE_OF_JOINT[name])]
    hips = joints[:, [JOINTS.index("left_hip"), JOINTS.index("right_hip")]].mean(axis=1)
    joints[:, 0] = (hips + sample.bones[:, sample.labels.index("spine05")]) / 2
    return joints


def joint_of_bone(sample: Sample) -> np.ndarray:
    """(B,) the SMPL joint that each rig bone's skin goes with: its own, or its nearest ancestor's."""
    taken = {bone: JOINTS.index(joint) for joint, bone in BONE_OF_JOINT.items()}
    for letter, side in (("L", "left"), ("R", "right")):
        for toe in range(1, 6):
            taken[f"toe{toe}-1.{letter}"] = JOINTS.index(f"{side}_foot")
        for finger in range(2, 6):
            taken[f"finger{finger}-1.{letter}"] = JOINTS.index(f"{side}_hand")
    found = np.zeros(len(sample.labels), dtype=int)
    for b, label in enumerate(sample.labels):
        found[b] = taken.get(label, 0 if sample.parents[b] < 0 else found[sample.parents[b]])
    return found


def merge_weights(sample: Sample) -> np.ndarray:
    """(V, 24) skinning weights of SMPL's joints, at most four to a vertex, each row summing to 1."""
    joint = joint_of_bone(sample)[sample.weights_index]
    dense = np.zeros((len(joint), len(JOINTS)))
    np.add.at(dense, (np.arange(len(joint))[:, None], joint), sample.weights_value)
    return top_weights(dense)


def top_weights(dense: np.ndarray) -> np.ndarray:
    """(V, 24) the four largest weights of each row, renormalised; of two sides' equal fourths neither is kept."""
    fifth = -np.sort(-dense, axis=1)[:, WEIGHTS : WEIGHTS + 1]
    kept = np.where(dense > fifth + 1e-9, dense, 0.0)
    return kept / kept.sum(axis=1, keepdims=True)


def smooth_weights(weights: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(V, 24) weights averaged with their neighbours', since the rig's jump from ankle to toe and at the elbow."""
    edges = np.unique(faces[:, [0, 1, 1, 2, 2, 0, 1, 0, 2, 1, 0, 2]].reshape(-1, 2), axis=0)
    near = sp.coo_matrix((np.ones(len(edges)), edges.T), shape=(len(weights),) * 2).tocsr()
    share = sp.diags(1 / np.asarray(near.sum(axis=1)).ravel()) @ near
    for _ in range(SMOOTHINGS):
        weights = (weights + share @ weights) / 2
    return weights


def main_component(faces: np.ndarray, count: int) -> np.ndarray:
    """(V',) indices of the largest connected part of a mesh: the skin, without eyeballs, tongue and teeth."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    graph = sp.coo_matrix((np.ones(len(edges)), edges.T), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    return np.flatnonzero(label == np.bincount(label).argmax())


def mirror_vertices(vertices: np.ndarray) -> np.ndarray:
    """(V,) the vertex on the other side of each vertex of a body that is symmetric about x = 0."""
    distance, twin = map(np.asarray, cKDTree(vertices).query(vertices * [-1, 1, 1]))
    if distance.max() > 2e-3 or not np.array_equal(twin[twin], np.arange(len(twin))):
        raise ValueError(f"the mesh is not symmetric: twins are up to {distance.max() * 1000:.1f} mm apart")
    return twin
