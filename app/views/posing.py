"""A body of one shape, posed frame by frame: everything that does not change over time is worked out beforehand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.solver.body.bone_meshes import bone_meshes
from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.rotations import slerp
from markerscope.solver.core.skeleton import JOINTS, PARENTS

Detail = Literal["coarse", "full"]
"""The body's coarse mesh, for playing, or every vertex."""

BONE_EDGES = np.stack([PARENTS[1:], np.arange(1, len(JOINTS))], axis=1)
"""(23, 2) joints that a line of the skeleton joins."""


@dataclass(frozen=True)
class Pose:
    """The body in one frame, lab frame.

    Attributes
    ----------
    rotations : (24, 3, 3) root in the lab, others relative to the parent
    trans : (3,) m
    """

    rotations: np.ndarray
    trans: np.ndarray


@dataclass(frozen=True, eq=False)
class PosedPoints:
    """Points of one shaped body, ready to be posed by one small matrix product.

    Skinning is linear in the bones' motion: ``x = sum_j w_j (turn_j p + shift_j)`` is a row of ``features`` (w_j p and
    w_j for every bone) times the 96 numbers of ``turn`` and ``shift``. Single precision halves what has to be read, and
    is exact to a tenth of a millimetre even a kilometre from the lab's origin.

    Attributes
    ----------
    features : (V, 96) float32
    rest_joints : (24, 3) m
    faces : (F, 3) triangles among the V points, (0, 3) where they are no mesh
    weights : (V, 24) float32, and correctives : (V * 3, 207) float32 m, of a body with pose-dependent correctives
    """

    features: np.ndarray
    rest_joints: np.ndarray
    faces: np.ndarray
    weights: np.ndarray | None = None
    correctives: np.ndarray | None = None

    def at(self, pose: Pose) -> np.ndarray:
        """(V, 3) m, float32: the points in one pose."""
        turn, place = self._links(pose)
        shift = place - (turn @ self.rest_joints[..., None])[..., 0]
        motion = np.concatenate([turn, shift[..., None]], axis=-1).transpose(0, 2, 1)  # (24, 4, 3)
        points = self.features @ motion.reshape(-1, 3).astype(np.float32)
        if self.correctives is not None and self.weights is not None:
            feature = (pose.rotations[1:] - np.eye(3)).ravel().astype(np.float32)
            bent = (self.correctives @ feature).reshape(-1, 3, 1)
            blended = self.weights @ turn.reshape(len(JOINTS), 9).astype(np.float32)
            points += (blended.reshape(-1, 3, 3) @ bent)[..., 0]
        return points

    def over(self, rotations: np.ndarray, trans: np.ndarray) -> np.ndarray:
        """(N, V, 3) m, float32: the points in several poses, (N, 24, 3, 3) and (N, 3) m."""
        if self.correctives is not None:
            return np.stack([self.at(Pose(*pose)) for pose in zip(rotations, trans)])
        turn, place = chain(rotations, self.rest_joints, trans)
        shift = place - (turn @ self.rest_joints[..., None])[..., 0]
        motion = np.concatenate([turn, shift[..., None]], axis=-1).transpose(0, 1, 3, 2)  # (N, 24, 4, 3)
        return np.asarray(self.features @ motion.reshape(len(trans), -1, 3).astype(np.float32))

    def joints(self, pose: Pose) -> np.ndarray:
        """(24, 3) m, the joint centres in one pose."""
        return self._links(pose)[1]

    def _links(self, pose: Pose) -> tuple[np.ndarray, np.ndarray]:
        turn, place = chain(pose.rotations[None], self.rest_joints, pose.trans[None])
        return turn[0], place[0]


def mesh_of(body: Body, betas: np.ndarray, detail: Detail = "full") -> PosedPoints:
    """The skin of a body of one shape.

    Parameters
    ----------
    body : with bone lengths among its shape coefficients, where ``betas`` has them
    betas : (S,) shape, or its first coefficients: the rest are zero
    """
    if detail == "full":
        return _points(body, betas, slice(None), body.faces)
    return _points(body, betas, body.lod_index, body.lod_faces)


def skin_points(body: Body, betas: np.ndarray, vertices: np.ndarray) -> PosedPoints:
    """Some vertices of the skin, in the order given."""
    return _points(body, betas, vertices, np.zeros((0, 3), dtype=np.intp))


def bones_of(body: Body, betas: np.ndarray) -> PosedPoints:
    """The bones inside a body of one shape, or of its first coefficients."""
    meshes = bone_meshes()
    every = np.pad(betas, (0, body.shape_count - len(betas)))
    return PosedPoints(_features(meshes.rest(body, every), meshes.weights), body.joints(every), meshes.faces)


def fixed_points(body: Body, betas: np.ndarray, rest: np.ndarray, dirs: np.ndarray, weights: np.ndarray) -> PosedPoints:
    """Points fixed to the body at rest, as the fit places markers.

    Parameters
    ----------
    rest, dirs, weights : (P, 3) m on the mean rest body, (P, 3, S) m per shape coefficient, (P, 24)
    """
    shaped = rest + dirs @ betas
    return PosedPoints(_features(shaped, weights), body.joints(betas), np.zeros((0, 3), dtype=np.intp))


def pose_at(times: np.ndarray, rotations: np.ndarray, trans: np.ndarray, time: float) -> Pose:
    """The pose at a time between keyframes; held beyond the first and the last.

    Parameters
    ----------
    times : (N,) s, ascending
    rotations, trans : (N, 24, 3, 3) and (N, 3) m
    """
    right = int(np.clip(np.searchsorted(times, time), 1, max(len(times) - 1, 1)))
    pair = slice(right - 1, right + 1)
    turned = slerp(rotations[pair], times[pair], np.array([time]))[0]
    return Pose(turned, np.array([np.interp(time, times[pair], trans[pair, k]) for k in range(3)]))


def _points(body: Body, betas: np.ndarray, chosen: np.ndarray | slice, faces: np.ndarray) -> PosedPoints:
    count = len(betas)
    rest = body.template[chosen] + body.shape_dirs[chosen][..., :count] @ betas
    rest_joints = body.joint_template + body.joint_dirs[..., :count] @ betas
    weights = body.weights[chosen]
    features = _features(rest, weights)
    faces = np.ascontiguousarray(faces)
    if body.pose_dirs is None:
        return PosedPoints(features, rest_joints, faces)
    correctives = body.pose_dirs[chosen].reshape(len(rest) * 3, -1).astype(np.float32)
    return PosedPoints(features, rest_joints, faces, weights.astype(np.float32), correctives)


def _features(rest: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(P, 96) float32: each bone's weight times the point (x, y, z, 1)."""
    one = np.concatenate([rest, np.ones((len(rest), 1))], axis=1)
    features: np.ndarray = (
        (weights[:, :, None] * one[:, None, :]).reshape(len(rest), 4 * weights.shape[1]).astype(np.float32)
    )
    return features
