"""How joint angles change with small turns of the segments' frames: analytic, by the sequence of each joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from markerscope.solver.angles.angles import AngleSettings, columns_of, conventions, lab_axes
from markerscope.solver.angles.cardan import about_axes, cardan
from markerscope.solver.core.rotations import exp_so3, log_so3, right_jacobian_inverse

_MIRROR = np.array([1.0, 1, -1])
_FLAT = 1e-3
"""Sine of the angle between two axes of a sequence below which they are taken for one: such frames are flagged."""


def angle_slopes(
    segments: Mapping[str, np.ndarray], settings: AngleSettings
) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]:
    """Derivatives of every angle by a small turn between its two segments.

    With the intrinsic sequence ``R = R1(a) R2(b) R3(c)`` of the distal in the proximal frame, a turn w of the distal
    one against it is ``w = e1 a' + R1 e2 b' + R1 R2 e3 c'``; the inverse of these axes are the derivatives.

    Parameters
    ----------
    segments : (T, 3, 3) frame of each segment in the lab, as ``angles.read_angles`` takes them
    settings : which convention

    Returns
    -------
    slopes : (T, A, 3) rad per rad, by a right-hand turn in the lab of the distal segment, less that of the proximal
    near, far : A names of the proximal segment, "" for the lab, and of the distal one
    """
    convention = conventions()[settings.convention]
    lab = lab_axes(segments["pelvis"], convention["lab"] == "quarter turns")
    columns = list(columns_of(settings.convention))
    slopes = np.zeros((len(segments["pelvis"]), len(columns), 3))
    for i, column in enumerate(columns):
        near = np.broadcast_to(segments[column.near] if column.near else lab, segments[column.far].shape)
        relative = np.swapaxes(near, -1, -2) @ segments[column.far]
        if column.mirrored:
            relative = _MIRROR[:, None] * relative * _MIRROR
        if column.axes is None:
            row = _by_sequence(relative, column.sequence, column.ranges, column.place)
        else:
            row = _by_axes(relative, column.axes, column.place)
        if column.mirrored:  # a mirror M turns the turn w into -M w
            row = -row * _MIRROR
        slopes[:, i] = column.sign * (near @ row[..., None])[..., 0]
    return slopes, tuple(column.near for column in columns), tuple(column.far for column in columns)


def _by_sequence(relative: np.ndarray, sequence: str, ranges: np.ndarray, place: int) -> np.ndarray:
    """(T, 3) derivative of one angle of an intrinsic sequence by a turn in the proximal frame."""
    angles = np.radians(cardan(relative, sequence, ranges)[0])
    first, second, third = (np.eye(3)["XYZ".index(letter)] for letter in sequence)
    turn = exp_so3(angles[:, :1] * first)
    axes = np.stack(
        [np.broadcast_to(first, angles.shape), turn @ second, turn @ exp_so3(angles[:, 1:2] * second) @ third], axis=2
    )
    # The rows of an inverse are the cross products of the columns over the determinant.
    one, other = axes[..., (place + 1) % 3], axes[..., (place + 2) % 3]
    across = np.cross(one, other)
    size = np.einsum("ti,ti->t", across, axes[..., place])
    return np.asarray(across / np.where(np.abs(size) < _FLAT, np.copysign(_FLAT, size), size)[:, None])


def _by_axes(relative: np.ndarray, axes: np.ndarray, place: int) -> np.ndarray:
    """(T, 3) derivative of one of two angles about given axes.

    What the two turns leave over, m = log(S^T R), is square to both of them: ``J^T m = 0`` with J the axes in the
    distal frame. Its derivative is that of the angles, by the implicit function theorem.
    """
    angles = np.radians(about_axes(relative, axes)[0])
    first, second = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    back = np.swapaxes(exp_so3(angles[:, 1:] * second), 1, 2)
    carried = back @ first
    missing = log_so3(back @ np.swapaxes(exp_so3(angles[:, :1] * first), 1, 2) @ relative)
    pair = np.stack([carried, np.broadcast_to(second, carried.shape)], axis=2)
    across, right = np.swapaxes(pair, 1, 2), right_jacobian_inverse(missing)
    by_angles = -across @ np.swapaxes(right, 1, 2) @ pair
    by_angles[:, 0, 1] += np.einsum("ti,ti->t", np.cross(carried, second), missing)
    by_turn = across @ right @ np.swapaxes(relative, 1, 2)
    return np.asarray(-np.linalg.solve(by_angles, by_turn)[:, place])
