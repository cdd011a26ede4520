"""The body: a rest mesh with 24 joints, shaped by betas and posed by linear blend skinning.

One class drives the embedded body and, unchanged, a user's own SMPL file. Equations: Loper et al. (2015), eq. 2-10.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.resources import resource
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.meshes import vertex_normals
from markerscope.solver.core.skeleton import JOINTS, PARENTS

EMBEDDED = resource("body", "anny_24.npz")


@dataclass(frozen=True, eq=False)
class Body:
    """A 24-joint body in SMPL layout; its rest pose is y up, facing +z, the left side at +x.

    Attributes
    ----------
    template : (V, 3) m, mean rest surface
    shape_dirs : (V, 3, S) m per unit of each shape coefficient
    joint_template, joint_dirs : (24, 3) and (24, 3, S) m, the joint centres likewise
    weights_index, weights_value : (V, 4) bones a vertex follows and how much, summing to 1
    faces : (F, 3) vertex indices, outward orientation
    lod_index, lod_faces : coarse mesh: (L,) vertex indices, (Lf, 3) positions in ``lod_index``
    marker_mask : (V,) True where a marker can sit
    landmark_names : N names; with landmark_vertices, landmark_values (N, K) a mean of vertices, or
        landmark_joint (N,) the joint whose centre it is (-1: the vertices)
    landmark_bone : (N,) index of the joint whose bone a palpable landmark is a point of; -1 where it is none
    pose_dirs : (V, 3, 207) m pose-dependent correctives of an SMPL file, else None
    betas_count : how many of the S coefficients are the file's own; the rest are bone lengths
    digest : of the file, for provenance
    kind : "smpl" where the shape coefficients are those of SMPL, "" for the embedded body
    """

    template: np.ndarray
    shape_dirs: np.ndarray
    joint_template: np.ndarray
    joint_dirs: np.ndarray
    weights_index: np.ndarray
    weights_value: np.ndarray
    faces: np.ndarray
    lod_index: np.ndarray
    lod_faces: np.ndarray
    marker_mask: np.ndarray
    landmark_names: tuple[str, ...]
    landmark_vertices: np.ndarray
    landmark_values: np.ndarray
    landmark_joint: np.ndarray
    landmark_bone: np.ndarray
    betas_count: int
    pose_dirs: np.ndarray | None = None
    name: str = ""
    digest: str = ""
    kind: str = ""
    _torch: dict[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def load(cls, path: str | Path | None = None) -> Body:
        """The embedded body, or the one in a user's ``SMPL_*.npz`` or ``.pkl``."""
        if path is not None and Path(path).resolve() != EMBEDDED.resolve():
            from markerscope.solver.body.adapt import load_smpl

            return load_smpl(path)
        return _embedded()

    @property
    def shape_count(self) -> int:
        """How many shape coefficients the body takes."""
        return self.shape_dirs.shape[2]

    @cached_property
    def weights(self) -> np.ndarray:
        """(V, 24) dense skinning weights."""
        dense = np.zeros((len(self.template), len(JOINTS)))
        np.put_along_axis(dense, self.weights_index, self.weights_value, axis=1)
        return dense

    @cached_property
    def faces_around(self) -> np.ndarray:
        """(V, K) the faces that meet in each vertex; -1 where they are fewer."""
        corner, face = self.faces.ravel(), np.repeat(np.arange(len(self.faces)), 3)
        order = np.argsort(corner, kind="stable")
        count = np.bincount(corner, minlength=len(self.template))
        rank = np.arange(len(corner)) - np.repeat(np.cumsum(count) - count, count)
        around = np.full((len(count), count.max()), -1)
        around[corner[order], rank] = face[order]
        return around

    def joints(self, betas: np.ndarray) -> np.ndarray:
        """(24, 3) m joint centres of the shaped body at rest."""
        return self.joint_template + self.joint_dirs @ betas

    def surface(self, betas: np.ndarray, vertices: Any = slice(None)) -> np.ndarray:
        """(n, 3) m vertices of the shaped body at rest."""
        return self.template[vertices] + self.shape_dirs[vertices] @ betas

    def normals(self, betas: np.ndarray) -> np.ndarray:
        """(V, 3) outward unit normals of the shaped body at rest."""
        return vertex_normals(self.surface(betas), self.faces)

    def landmarks(self, betas: np.ndarray) -> dict[str, np.ndarray]:
        """Named points (3,) m on the shaped body at rest."""
        return dict(zip(self.landmark_names, self._landmark_rest(self.surface(betas), self.joints(betas)), strict=True))

    def _landmark_rest(self, surface: np.ndarray, joints: np.ndarray) -> np.ndarray:
        on_skin = np.einsum("nk,nk...->n...", self.landmark_values, surface[self.landmark_vertices])
        use_joint = (self.landmark_joint >= 0).reshape(-1, *[1] * (surface.ndim - 1))
        return np.where(use_joint, joints[self.landmark_joint], on_skin)

    def landmark_basis(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rest position (N, 3), shape directions (N, 3, S) and skinning weights (N, 24) of every landmark."""
        weights = np.einsum("nk,nkj->nj", self.landmark_values, self.weights[self.landmark_vertices])
        of_joint = np.eye(len(JOINTS))[self.landmark_joint]
        return (
            self._landmark_rest(self.template, self.joint_template),
            self._landmark_rest(self.shape_dirs, self.joint_dirs),
            np.where(self.landmark_joint[:, None] >= 0, of_joint, weights),
        )

    def pose(
        self, rotations: Any, betas: Any, trans: Any, vertices: Any = None, *, want_vertices: bool = True
    ) -> tuple[Any, Any]:
        """Pose the body.

        Parameters
        ----------
        rotations : (T, 24, 3, 3) root in the world, others relative to the parent; numpy or torch
        betas : (S,) shape, or fewer: the rest are zero
        trans : (T, 3) m added to the posed body, whose root turns about the resting root joint (SMPL's convention)
        vertices : indices of the vertices wanted; None = all

        Returns
        -------
        vertices : (T, n, 3) m
        joints : (T, 24, 3) m
        """
        is_torch = type(rotations).__module__.startswith("torch")
        arrays = self._torch_arrays(rotations) if is_torch else self.__dict__ | {"weights": self.weights}
        count = len(betas)
        rest_joints = arrays["joint_template"] + arrays["joint_dirs"][..., :count] @ betas
        turn, joints = chain(rotations, rest_joints, trans)
        if not want_vertices:
            return None, joints
        chosen = slice(None) if vertices is None else vertices
        rest = arrays["template"][chosen] + arrays["shape_dirs"][chosen][..., :count] @ betas
        weights = arrays["weights"][chosen]
        if self.pose_dirs is not None:
            rest = rest + self._correctives(rotations, arrays["pose_dirs"][chosen])
        # Skinning as one product: x = sum_j w_j (turn_j p + shift_j), features w_j (p, 1) against (turn_j, shift_j).
        shift = joints - (turn @ rest_joints[..., None])[..., 0]
        frames, bones = rotations.shape[0], len(JOINTS)
        if rest.ndim == 2:
            features = weights[:, :, None] * _append_one(rest)[:, None, :]
            motion = _stack_last(turn, shift)  # (T, 24, 3, 4)
            product = features.reshape(-1, bones * 4) @ _move(motion).reshape(bones * 4, frames * 3)
            return product.reshape(-1, frames, 3).swapaxes(0, 1), joints
        blended = (weights @ turn.reshape(frames, bones, 9)).reshape(frames, -1, 3, 3)
        return (blended @ rest[..., None])[..., 0] + weights @ shift, joints

    @staticmethod
    def _correctives(rotations: Any, pose_dirs: Any) -> Any:
        """(T, n, 3) m, SMPL's pose blend shapes."""
        frames = rotations.shape[0]
        eye = np.eye(3) if isinstance(rotations, np.ndarray) else rotations.new_zeros(3, 3).fill_diagonal_(1)
        feature = (rotations[:, 1:] - eye).reshape(frames, -1)
        count = pose_dirs.shape[0]
        return (feature @ pose_dirs.reshape(count * 3, -1).swapaxes(0, 1)).reshape(frames, count, 3)

    def _torch_arrays(self, like: Any) -> dict[str, Any]:
        key = str((like.dtype, like.device))
        if key not in self._torch:
            import torch

            names = ("template", "shape_dirs", "joint_template", "joint_dirs", "weights", "pose_dirs")
            values = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
            self._torch[key] = {k: torch.tensor(v, dtype=like.dtype, device=like.device) for k, v in values.items()}
        return self._torch[key]


@cache
def _embedded() -> Body:
    """Read once; every user shares its arrays, which therefore cannot be written to."""
    try:
        raw = EMBEDDED.read_bytes()
    except OSError as error:
        raise InputError("the embedded body cannot be read", EMBEDDED, "install Markerscope again") from error
    with np.load(EMBEDDED, allow_pickle=False) as data:
        numbers = {
            "template": data["v_template"].astype(float),
            "shape_dirs": data["shapedirs"].astype(float),
            "joint_template": data["J_template"].astype(float),
            "joint_dirs": data["J_shapedirs"].astype(float),
            "weights_index": data["weights_index"].astype(np.intp),
            "weights_value": data["weights_value"].astype(float),
            "faces": data["f"].astype(np.intp),
            "lod_index": data["lod_index"].astype(np.intp),
            "lod_faces": data["lod_f"].astype(np.intp),
            "marker_mask": data["marker_mask"].astype(bool),
            "landmark_vertices": data["landmark_vertices"].astype(np.intp),
            "landmark_values": data["landmark_values"].astype(float),
            "landmark_joint": data["landmark_joint"].astype(np.intp),
            "landmark_bone": data["landmark_bone"].astype(np.intp),
        }
        names = tuple(str(name) for name in data["landmark_names"])
    for array in numbers.values():
        array.setflags(write=False)
    return Body(
        **numbers,
        landmark_names=names,
        betas_count=numbers["shape_dirs"].shape[2],
        name="embedded",
        digest=hashlib.sha256(raw).hexdigest()[:16],
    )


def chain(rotations: Any, rest_joints: Any, trans: Any) -> tuple[Any, Any]:
    """World rotation (T, 24, 3, 3) and position (T, 24, 3) m of every joint, by forward kinematics."""
    turn, place = [rotations[:, 0]], [rest_joints[0] + trans]
    for j in range(1, len(JOINTS)):
        parent = int(PARENTS[j])
        bone = rest_joints[j] - rest_joints[parent]
        turn.append(turn[parent] @ rotations[:, j])
        place.append(place[parent] + turn[parent] @ bone)
    stack = np.stack if isinstance(rotations, np.ndarray) else _torch_stack
    return stack(turn, 1), stack(place, 1)


def _torch_stack(tensors: list[Any], dim: int) -> Any:
    import torch

    return torch.stack(tensors, dim)


def _append_one(points: Any) -> Any:
    if isinstance(points, np.ndarray):
        return np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)
    import torch

    return torch.cat([points, torch.ones_like(points[..., :1])], dim=-1)


def _stack_last(turn: Any, shift: Any) -> Any:
    if isinstance(turn, np.ndarray):
        return np.concatenate([turn, shift[..., None]], axis=-1)
    import torch

    return torch.cat([turn, shift[..., None]], dim=-1)


def _move(motion: Any) -> Any:
    """(T, 24, 3, 4) to (24, 4, T, 3)."""
    return motion.transpose(1, 3, 0, 2) if isinstance(motion, np.ndarray) else motion.permute(1, 3, 0, 2)
