"""The normal equations of a fit, split into what belongs to one frame and what all frames share.

A point moves only with the joints above its bones, so its rows are multiplied over those columns alone; points are
taken together by limb. The frames are eliminated first (Schur complement), which leaves one small shared system.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import get_blas_funcs, get_lapack_funcs

from markerscope.solver.core.skeleton import INDEX, descendants
from markerscope.solver.fit.kinematics import Chain, Points, pose_jacobian
from markerscope.solver.fit.state import FREE, POSE_SIZE

_NEGLIGIBLE = 1e-3
_SPINE = ("pelvis", "spine1", "spine2", "spine3")
_LIMBS = (
    *(("pelvis", *(f"{s}_{j}" for j in ("hip", "knee", "ankle", "foot"))) for s in ("left", "right")),
    ("pelvis", "left_hip", "right_hip", "spine1", "spine2"),
    *((*_SPINE, *(f"{s}_{j}" for j in ("collar", "shoulder", "elbow", "wrist"))) for s in ("left", "right")),
    (*_SPINE, "neck", "head", "left_collar", "right_collar", "left_shoulder", "right_shoulder"),
)


@dataclass(frozen=True)
class Group:
    """Points that move with the same joints: their indices, the joints, and the columns those have per frame.

    ``runs`` are the same columns as stretches: (where in the frame's unknowns, where in the group's).
    """

    points: np.ndarray
    joints: np.ndarray
    columns: np.ndarray
    runs: tuple[tuple[slice, slice], ...]


@cache
def _limb_masks() -> np.ndarray:
    masks = np.zeros((len(_LIMBS) + 1, 24), bool)
    for i, names in enumerate(_LIMBS):
        masks[i, [INDEX[name] for name in names]] = True
    masks[-1, FREE] = True
    return masks


def groups(weights: np.ndarray) -> list[Group]:
    """Points (P, 24 weights) by the limb whose joints cover all that move them."""
    needed = ((weights > _NEGLIGIBLE).astype(float) @ descendants().T.astype(float)) > 0
    needed[:, np.setdiff1d(np.arange(24), FREE)] = False
    covered = ~(needed[:, None] & ~_limb_masks()[None]).any(axis=2)
    limb = covered.argmax(axis=1)
    found = []
    for i in np.unique(limb):
        place = np.flatnonzero(_limb_masks()[i][FREE])
        columns = np.concatenate([(3 * place[:, None] + np.arange(3)).ravel(), np.arange(POSE_SIZE - 3, POSE_SIZE)])
        breaks = np.flatnonzero(np.diff(columns) != 1) + 1
        ends = zip([0, *breaks.tolist()], [*breaks.tolist(), len(columns)], strict=True)
        runs = tuple((slice(columns[a], columns[b - 1] + 1), slice(a, b)) for a, b in ends)
        found.append(Group(np.flatnonzero(limb == i), FREE[place], columns, runs))
    return found


class NormalEquations:
    """Sums of squares over F frames with a shared part of the given size."""

    def __init__(self, frames: int, shared: int) -> None:
        self.h_ff = np.zeros((frames, POSE_SIZE, POSE_SIZE))
        self.h_fs = np.zeros((frames, POSE_SIZE, shared))
        self.h_ss = np.zeros((shared, shared))
        self.g_f = np.zeros((frames, POSE_SIZE))
        self.g_s = np.zeros(shared)
        self._joints: tuple[np.ndarray, np.ndarray] | None = None

    def add_rows(
        self,
        group: Group,
        by_pose: np.ndarray,
        residual: np.ndarray,
        shared: slice,
        by_shared: np.ndarray | None,
    ) -> None:
        """Rows (F, R, C) over some columns of each frame, their residual (F, R) and shared derivatives (F, R, B)."""
        transposed = np.swapaxes(by_pose, 1, 2)
        square = transposed @ by_pose
        slope = (transposed @ residual[..., None])[..., 0]
        cross = None if by_shared is None else transposed @ by_shared
        # Adding stretch by stretch is several times faster than through an index of all columns.
        for at, of in group.runs:
            self.g_f[:, at] += slope[:, of]
            for also_at, also_of in group.runs:
                self.h_ff[:, at, also_at] += square[:, of, also_of]
            if cross is not None:
                self.h_fs[:, at, shared] += cross[:, of]
        if by_shared is not None:
            flat = by_shared.reshape(-1, by_shared.shape[2])
            self.h_ss[shared, shared] += flat.T @ flat
            self.g_s[shared] += flat.T @ residual.ravel()

    def add_joints(self, square: np.ndarray, slope: np.ndarray) -> None:
        """What acts on each joint alone, (F, K, 3, 3) and (F, K, 3), both then ours; ``gathered`` adds it to the rest.

        Writing to the blocks along many diagonals is slow, so it is done once.
        """
        if self._joints is None:
            self._joints = square, slope
        else:
            self._joints[0][:] += square
            self._joints[1][:] += slope

    def gathered(self) -> NormalEquations:
        """Itself, with what acts on joints alone added."""
        if self._joints is not None:
            square, slope = self._joints
            diagonal_blocks(self.h_ff)[:-1] += square.swapaxes(0, 1)
            self.g_f[:, :-3] += slope.reshape(len(slope), -1)
            self._joints = None
        return self

    def solve(self, free: np.ndarray, damping: float) -> tuple[np.ndarray, np.ndarray]:
        """Step of each frame (F, 69) and of the shared unknowns; those not ``free`` stay at zero."""
        diagonal = np.einsum("nii->ni", self.h_ff)
        diagonal += damping * diagonal + 1e-6
        shared = np.zeros(len(self.g_s))
        if not len(free):
            return -np.linalg.solve(self.h_ff, self.g_f[..., None])[..., 0], shared
        h_ss = self.h_ss[np.ix_(free, free)]
        h_ss[np.diag_indices(len(free))] *= 1 + damping
        h_ss[np.diag_indices(len(free))] += 1e-9
        # With L L^T = h_ff, everything that the frames say of the shared unknowns is one product of L^-1 [h_fs, g_f].
        # Single precision does for a step that is only taken where it pays, in half the time.
        frames, size = self.g_f.shape
        try:
            lower: np.ndarray = np.linalg.cholesky(self.h_ff.astype(np.float32))
        except np.linalg.LinAlgError:  # nearly nothing holds some joint, less than single precision can tell
            lower = np.linalg.cholesky(self.h_ff)
        trsm, trtrs = _routines(lower)
        rows = np.empty((frames, size, len(free) + 1), lower.dtype)
        rows[..., :-1] = self.h_fs[..., free]
        rows[..., -1] = self.g_f
        for of_frame, factor in zip(rows, lower, strict=True):
            # LAPACK counts by columns, so it sees both transposed; it then works in place, without a copy.
            trsm(1.0, factor.T, of_frame.T, side=1, lower=0, overwrite_b=1)
        flat = rows.reshape(frames * size, -1)
        product = flat.T @ flat
        shared[free] = -np.linalg.solve(h_ss - product[:-1, :-1], self.g_s[free] - product[:-1, -1])
        known = rows[..., -1] + rows[..., :-1] @ shared[free].astype(lower.dtype)
        step = [trtrs(factor.T, one, lower=0, trans=0)[0] for factor, one in zip(lower, known, strict=True)]
        return -np.stack(step), shared


def _routines(lower: np.ndarray) -> tuple[Any, Any]:
    """BLAS's trsm and LAPACK's trtrs for the precision of an array."""
    (trsm,), (trtrs,) = list(get_blas_funcs(("trsm",), (lower,))), list(get_lapack_funcs(("trtrs",), (lower,)))  # type: ignore
    return trsm, trtrs


def diagonal_blocks(matrices: np.ndarray) -> np.ndarray:
    """A view (K, F, 3, 3) of the 3 by 3 blocks along the diagonals of matrices (F, at least 3K, 3K)."""
    frames, _, size = matrices.shape
    across, down, along = matrices.strides
    shape, strides = (size // 3, frames, 3, 3), (3 * (down + along), across, down, along)
    return np.lib.stride_tricks.as_strided(matrices, shape, strides)


def group_jacobian(points: Points, group: Group, links: Chain, betas: np.ndarray) -> np.ndarray:
    """(F, p, 3, C): derivative of a group's points by its own columns."""
    return pose_jacobian(points.take(group.points), links, betas, group.joints)
