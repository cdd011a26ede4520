"""Three angles out of a rotation, followed over time through what the sequence cannot tell apart."""

from __future__ import annotations

import warnings
from itertools import pairwise
from typing import Any

import numpy as np

from solver.rotations import exp_so3, log_so3

SINGULAR_DEG = 4.0
"""Nearer than this to a singularity, an error of the rotation is more than 14 times as large in the outer angles."""
_STEP_DEG = 90.0
"""A larger step across a singular stretch is not taken for a continued turn."""
_ITERATIONS = 12
"""Gauss-Newton steps from zero, for turns up to a right angle."""


def cardan(rotations: np.ndarray, sequence: str) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsic angles (T, 3) in degrees, unwrapped over time, and (T, 3) True where they are not defined.

    Parameters
    ----------
    rotations : (T, 3, 3)
    sequence : three of X, Y, Z. Where it begins and ends with the same axis, the middle angle is taken as negative, as
        ISB does for the shoulder; else it lies within [-90, 90] degrees, or beyond where that brings all three angles
        nearer to zero: an arm raised sideways overhead is abducted by 120 degrees, not flexed by 180, abducted by 60
        and turned by 180.

    Near a singularity the first and the third angle cannot be told apart; the middle one stays good.
    """
    from scipy.spatial.transform import Rotation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gimbal lock is flagged below
        turns: Any = Rotation.from_matrix(rotations)
        angles = turns.as_euler(sequence, degrees=True)
    if sequence[0] == sequence[2]:
        angles = np.stack([angles[:, 0] + 180, -angles[:, 1], angles[:, 2] + 180], axis=1)
        distance = np.abs(np.sin(np.radians(angles[:, 1])))
        beyond = np.zeros(len(angles), bool)
    else:
        distance = np.abs(np.cos(np.radians(angles[:, 1])))
        beyond = _beyond(angles, distance)
        angles[beyond] = _other_branch(angles[beyond])
    lost = distance < np.sin(np.radians(SINGULAR_DEG))
    for k in (0, 2):
        angles[:, k] = _followed(angles[:, k], ~lost)
    return angles, np.stack([lost, np.zeros_like(lost), lost], axis=1)


def about_axes(rotations: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (T, 2) in degrees about two fixed axes of a joint that has no third, and (T, 2) all False.

    The turn about the first axis followed by that about the second, which the first one carries along, that comes
    nearest to the rotation. The axes need not be square to each other: an ankle's are not.

    Parameters
    ----------
    rotations : (T, 3, 3)
    axes : (2, 3) in the proximal frame at zero, which is the distal one
    """
    first, second = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.zeros((len(rotations), 2))
    for _ in range(_ITERATIONS):
        turn = exp_so3(angles[:, 1:] * second)
        missing = log_so3(np.swapaxes(exp_so3(angles[:, :1] * first) @ turn, 1, 2) @ rotations)
        slopes = np.stack([np.swapaxes(turn, 1, 2) @ first, np.broadcast_to(second, (len(turn), 3))], axis=2)
        normal = np.swapaxes(slopes, 1, 2)
        angles += np.linalg.solve(normal @ slopes, normal @ missing[..., None])[..., 0]
    angles = np.unwrap(_wrapped(np.degrees(angles)), period=360, axis=0)
    return angles, np.zeros(angles.shape, bool)


def _beyond(angles: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """(T,) True where the second solution, whose middle angle is beyond 90 degrees, is clearly nearer to zero.

    Decided once for each stretch between singularities, and at a singularity where the angles come closest to it: a
    choice per stretch cannot drift over a long recording.
    """
    good = distance >= np.sin(np.radians(SINGULAR_DEG))
    chosen = np.zeros(len(angles), bool)
    runs = _runs(good)
    for run in runs:
        ours, other = (
            np.median(np.abs(_wrapped(candidate)).sum(axis=1))
            for candidate in (angles[run], _other_branch(angles[run]))
        )
        chosen[run] = other + 90 < ours
    ends = [slice(0, 0), *runs, slice(len(angles), len(angles))]
    for before, after in pairwise(ends):
        gap = slice(before.stop, after.start)
        if gap.stop > gap.start:
            nearest = gap.start + int(np.argmin(distance[gap]))
            first = chosen[before.stop - 1] if before.stop else chosen[min(after.start, len(chosen) - 1)]
            last = chosen[after.start] if after.start < len(chosen) else first
            chosen[gap.start : nearest] = first
            chosen[nearest : gap.stop] = last
    return chosen


def _other_branch(angles: np.ndarray) -> np.ndarray:
    """The second triple of angles with the same rotation, for sequences of three axes."""
    turned = np.stack([angles[:, 0] + 180, 180 - angles[:, 1], angles[:, 2] + 180], axis=1)
    turned[:, 1] = _wrapped(turned[:, 1])
    return turned


def _followed(values: np.ndarray, good: np.ndarray) -> np.ndarray:
    """Degrees (T,) without jumps of whole turns inside each good stretch, stretches joined where the step is small."""
    out = values.copy()
    last = None
    for run in _runs(good):
        stretch = np.unwrap(values[run], period=360)
        shift = None if last is None else 360 * np.round((last - stretch[0]) / 360)
        if last is None or abs(stretch[0] + shift - last) > _STEP_DEG:
            middle = np.median(stretch) if np.ptp(stretch) < 360 else stretch[0]
            shift = -360 * np.round(middle / 360)
        out[run] = stretch + shift
        last = out[run][-1]
    return out


def _runs(good: np.ndarray) -> list[slice]:
    """The stretches of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _wrapped(degrees: np.ndarray) -> np.ndarray:
    return (degrees + 180) % 360 - 180
