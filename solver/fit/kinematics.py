"""Points that ride on the body, and how they move with pose and shape: the analytic derivatives of every fit.

A point follows the bones by linear blend skinning, ``x = sum_j W_j (G_j p + h_j)``. Turning joint k by the small
world vector w moves it by ``w x s_k`` with ``s_k = sum over the bones j below k of W_j (G_j p + h_j - g_k)``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.skeleton import JOINTS, PARENTS, descendants


@dataclass(frozen=True)
class Points:
    """Points fixed to the body at rest.

    Attributes
    ----------
    rest : (P, 3) m on the mean body at rest
    dirs : (P, 3, S) m per unit of each shape coefficient
    weights : (P, 24) skinning weights, summing to 1
    """

    rest: np.ndarray
    dirs: np.ndarray
    weights: np.ndarray

    @classmethod
    def of_vertices(cls, body: Body, vertices: np.ndarray) -> Points:
        """The given vertices of a body."""
        return cls(body.template[vertices], body.shape_dirs[vertices], body.weights[vertices])

    @classmethod
    def none(cls, shapes: int) -> Points:
        """No points, of a body with so many shape coefficients."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3, shapes)), np.zeros((0, len(JOINTS))))

    @classmethod
    def joined(cls, first: Points, second: Points) -> Points:
        """Both sets as one."""
        return cls(*(np.concatenate([getattr(first, k), getattr(second, k)]) for k in ("rest", "dirs", "weights")))

    def take(self, index: np.ndarray) -> Points:
        """Some of the points."""
        return Points(self.rest[index], self.dirs[index], self.weights[index])

    def shaped(self, betas: np.ndarray) -> np.ndarray:
        """(P, 3) m on the shaped body at rest."""
        return self.rest + self.dirs @ betas


@dataclass(frozen=True)
class Pose:
    """Poses of one body over frames, lab frame.

    Attributes
    ----------
    rotations : (F, 24, 3, 3) root in the lab, others relative to the parent
    trans : (F, 3) m
    betas : (S,)
    """

    rotations: np.ndarray
    trans: np.ndarray
    betas: np.ndarray

    def at(self, frames: np.ndarray | slice) -> Pose:
        """Some of the frames."""
        return replace(self, rotations=self.rotations[frames], trans=self.trans[frames])


@dataclass(frozen=True)
class Chain:
    """Forward kinematics of a pose: world rotation and position of each joint, and the offset h = g - G J."""

    turn: np.ndarray
    place: np.ndarray
    shift: np.ndarray
    rest_joints: np.ndarray


def forward(body: Body, pose: Pose) -> Chain:
    """Forward kinematics: ``turn`` (F, 24, 3, 3), ``place`` and ``shift`` (F, 24, 3) m."""
    rest = body.joints(pose.betas)
    turn, place = chain(pose.rotations, rest, pose.trans)
    return Chain(turn, place, place - (turn @ rest[..., None])[..., 0], rest)


def place_points(points: Points, links: Chain, betas: np.ndarray) -> np.ndarray:
    """(F, P, 3) m, lab frame: where the points are in each pose."""
    frames = len(links.turn)
    features = (
        points.weights[:, :, None] * np.concatenate([points.shaped(betas), np.ones((len(points.rest), 1))], 1)[:, None]
    )
    motion = np.concatenate([links.turn, links.shift[..., None]], axis=-1)  # (F, 24, 3, 4)
    product = features.reshape(len(points.rest), -1) @ motion.transpose(1, 3, 0, 2).reshape(-1, frames * 3)
    return product.reshape(-1, frames, 3).swapaxes(0, 1)


def blended_turn(points: Points, links: Chain) -> np.ndarray:
    """(F, P, 3, 3): derivative of each point by its rest position."""
    frames = len(links.turn)
    return (points.weights @ links.turn.reshape(frames, len(JOINTS), 9)).reshape(frames, -1, 3, 3)


def pose_jacobian(points: Points, links: Chain, betas: np.ndarray, joints: np.ndarray) -> np.ndarray:
    """(F, P, 3, 3 K + 3): derivative by a right-hand turn of each of the K ``joints`` (rad) and by translation (m)."""
    bones = np.flatnonzero(points.weights.any(axis=0))
    weights = points.weights[:, bones]
    below = descendants()[np.ix_(joints, bones)].astype(float)  # (K, B)
    posed = (links.turn[:, bones] @ points.shaped(betas).T).transpose(0, 3, 1, 2) + links.shift[:, None, bones]
    lever = below @ (weights[None, :, :, None] * posed)
    lever -= (weights @ below.T)[None, :, :, None] * links.place[:, None, joints]
    frames, count = lever.shape[:2]
    out = np.empty((frames, count, 3, len(joints) * 3 + 3))
    turns = out[..., :-3].reshape(frames, count, 3, len(joints), 3)
    axes = links.turn[:, None, joints]  # columns are the world axes of each joint's own frame
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        turns[:, :, i] = axes[..., j, :] * lever[..., k, None] - axes[..., k, :] * lever[..., j, None]
    out[..., :-3] = turns.reshape(frames, count, 3, -1)
    out[..., -3:] = np.eye(3)
    return out


def shape_jacobian(body: Body, points: Points, links: Chain) -> np.ndarray:
    """(F, P, 3, S): derivative by the shape coefficients."""
    moved = [np.broadcast_to(body.joint_dirs[0], (len(links.turn), *body.joint_dirs[0].shape))]
    for j in range(1, len(JOINTS)):
        p = int(PARENTS[j])
        moved.append(moved[p] + links.turn[:, p] @ (body.joint_dirs[j] - body.joint_dirs[p]))
    shift = np.stack(moved, 1) - links.turn @ body.joint_dirs  # (F, 24, 3, S)
    carried = (points.weights @ shift.reshape(len(shift), len(JOINTS), -1)).reshape(len(shift), -1, *shift.shape[2:])
    return blended_turn(points, links) @ points.dirs + carried
