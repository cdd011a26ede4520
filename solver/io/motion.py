"""A skeleton in motion as motion files hold it, and where its joints are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np


@dataclass(frozen=True)
class SkeletonMotion:
    """A tree of joints that are all parallel in the rest pose, and its motion.

    Attributes
    ----------
    names : J joint names
    parents : (J,) index of each joint's parent, smaller than its own; the root has -1
    offsets : (J, 3) m, place of each joint in its parent's frame at rest, in the rest skeleton's axes
    ends : (J, 3) m, end of each joint's bone in its own frame; zero where the file gives none
    rotations : (T, J, 3, 3), parent-relative; the root's turns the rest skeleton into the internal frame (z up)
    translations : (T, J, 3) m, place of each joint in its parent's frame; the root's in the internal frame
    rate : Hz
    source : path of the file
    """

    names: tuple[str, ...]
    parents: np.ndarray
    offsets: np.ndarray
    ends: np.ndarray
    rotations: np.ndarray
    translations: np.ndarray
    rate: float
    source: str = ""

    @property
    def time(self) -> np.ndarray:
        """(T,) s from the first frame."""
        return np.arange(len(self.rotations)) / self.rate

    def global_rotations(self) -> np.ndarray:
        """(T, J, 3, 3) each joint's rotation in the internal frame."""
        turned = self.rotations.copy()
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                turned[:, joint] = turned[:, parent] @ turned[:, joint]
        return turned

    def joint_positions(self) -> np.ndarray:
        """(T, J, 3) m each joint's place in the internal frame."""
        return self._places(self.global_rotations())

    def end_positions(self) -> np.ndarray:
        """(T, J, 3) m the end of each joint's bone in the internal frame."""
        turned = self.global_rotations()
        return self._places(turned) + np.einsum("tjab,jb->tja", turned, self.ends)

    def _places(self, turned: np.ndarray) -> np.ndarray:
        places = np.array(self.translations)
        for joint, parent in enumerate(self.parents):
            if parent >= 0:
                step = np.einsum("tab,tb->ta", turned[:, parent], places[:, joint])
                places[:, joint] = places[:, parent] + step
        return places


def euler_matrix(axes: Sequence[str], angles: np.ndarray) -> np.ndarray:
    """Product of rotations about ``axes``, the first one leftmost: (..., N) rad to (..., 3, 3)."""
    turns = [_about(axis, angles[..., i]) for i, axis in enumerate(axes)]
    identity = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    return reduce(np.matmul, turns, identity)


def _about(axis: str, angle: np.ndarray) -> np.ndarray:
    """(...) rad about one of ``x y z`` to (..., 3, 3)."""
    k = "xyz".index(axis.lower())
    i, j = (k + 1) % 3, (k + 2) % 3
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., k, k] = 1
    matrix[..., i, i] = matrix[..., j, j] = np.cos(angle)
    matrix[..., j, i] = np.sin(angle)
    matrix[..., i, j] = -np.sin(angle)
    return matrix
