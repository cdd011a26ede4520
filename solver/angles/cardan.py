"""Three angles out of a rotation, each frame read by itself within what the joint can do."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from markerscope.solver.core.rotations import exp_so3, log_so3

SINGULAR_DEG = 4.0
"""Nearer than this to a singularity, an error of the rotation is more than 14 times as large in the outer angles."""
TURNS = (-np.inf, np.inf)
"""The range of an angle that is no joint's: a heading, whose turns are counted over time."""
_FROM_ZERO = 0.25
"""Share of the way from the anatomical position that counts beside what lies outside of the ranges."""
_STEP_DEG = 90.0
"""A larger step across a singular stretch is not taken for a continued turn."""
_ITERATIONS = 30
_STILL = 1e-10
"""rad, a step of the last iteration."""


def cardan(rotations: np.ndarray, sequence: str, ranges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Intrinsic angles (T, 3) in degrees within what the joint can do, and (T, 3) True where they are not defined.

    A rotation has two triples of angles, and each angle goes round in whole turns. Every frame takes the triple that
    goes least beyond the ranges, counted together with a share of its way from zero; each angle is given within half a
    turn of the middle of its range. What came before does not matter: nothing winds up, and what stands still reads
    the same however it got there. Only an angle that ranges over ``TURNS`` is followed over time.

    An arm raised sideways overhead is thus abducted by 120 degrees, not flexed by 180, abducted by 60, turned by 180.

    Parameters
    ----------
    rotations : (T, 3, 3)
    sequence : three of X, Y, Z; where the first is the last, the sign of the middle angle's range decides
    ranges : (3, 2) degrees, least and greatest of each angle

    Near a singularity the first and the third angle cannot be told apart; the middle one stays good.
    """
    from scipy.spatial.transform import Rotation

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # gimbal lock is flagged below
        turns: Any = Rotation.from_matrix(rotations)
        first = turns.as_euler(sequence, degrees=True)
    repeated = sequence[0] == sequence[2]
    middle = -first[:, 1] if repeated else 180 - first[:, 1]
    second = np.stack([first[:, 0] + 180, middle, first[:, 2] + 180], axis=1)
    distance = np.abs((np.sin if repeated else np.cos)(np.radians(first[:, 1])))
    first, second = _within(first, ranges), _within(second, ranges)
    if repeated:  # their middle angles differ in sign alone, and the range has one sign
        chosen = np.abs(first[:, 1] - ranges[1].mean()) <= np.abs(second[:, 1] - ranges[1].mean())
    else:
        chosen = _beyond(first, ranges) <= _beyond(second, ranges)
    angles = np.where(chosen[:, None], first, second)
    lost = distance < np.sin(np.radians(SINGULAR_DEG))
    for k in np.flatnonzero(~np.isfinite(ranges).all(axis=1)):
        angles[:, k] = _followed(angles[:, k], ~lost)
    return angles, np.stack([lost, np.zeros_like(lost), lost], axis=1)


def about_axes(rotations: np.ndarray, axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (T, 2) in degrees about two fixed axes of a joint that has no third, and (T, 2) True where not defined.

    The turn about the first axis followed by that about the second, which the first one carries along, that comes
    nearest to the rotation. The axes need not be square to each other: an ankle's are not. Further than a right angle
    from zero the search may not come to rest: such a frame is flagged.

    Parameters
    ----------
    rotations : (T, 3, 3)
    axes : (2, 3) in the proximal frame at zero, which is the distal one
    """
    first, second = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.zeros((len(rotations), 2))
    step = np.full_like(angles, np.inf)
    for _ in range(_ITERATIONS):
        turn = exp_so3(angles[:, 1:] * second)
        missing = log_so3(np.swapaxes(exp_so3(angles[:, :1] * first) @ turn, 1, 2) @ rotations)
        slopes = np.stack([np.swapaxes(turn, 1, 2) @ first, np.broadcast_to(second, (len(turn), 3))], axis=2)
        normal = np.swapaxes(slopes, 1, 2)
        step = np.linalg.solve(normal @ slopes, normal @ missing[..., None])[..., 0]
        angles += step
        if (np.abs(step) < _STILL).all():
            break
    lost = (np.abs(step) > np.radians(0.01)).any(axis=1)
    return _wrapped(np.degrees(angles)), np.stack([lost, lost], axis=1)


def _within(angles: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """The angles (T, 3) within half a turn of the middle of their range; of zero where it has no end."""
    middle = np.where(np.isfinite(ranges), ranges, 0.0).mean(axis=1)
    return middle + _wrapped(angles - middle)


def _beyond(angles: np.ndarray, ranges: np.ndarray) -> np.ndarray:
    """(T,) degrees that the triples lie outside of the ranges, with a share of their way from zero.

    The share decides where two triples lie within: an arm turned out by 95 degrees hangs, and is not flexed by 180 and
    abducted by 180.
    """
    outside = np.maximum(ranges[:, 0] - angles, 0) + np.maximum(angles - ranges[:, 1], 0)
    counted = np.isfinite(ranges).all(axis=1)
    return (outside + _FROM_ZERO * np.abs(angles))[:, counted].sum(axis=1)


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
