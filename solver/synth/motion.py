"""A body in motion, and the same motion at another rate, played forth and back, damped, on another body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.rotations import exp_so3, kabsch, log_so3, slerp
from markerscope.solver.core.skeleton import INDEX

_TURN = 0.25  # s, from full speed to rest where the playing turns


@dataclass(frozen=True)
class Motion:
    """Poses over time, as ``Body.pose`` takes them.

    Attributes
    ----------
    rotations : (T, 24, 3, 3)
    trans : (T, 3) m
    rate : Hz
    """

    rotations: np.ndarray
    trans: np.ndarray
    rate: float

    @property
    def time(self) -> np.ndarray:
        """(T,) s."""
        return np.arange(len(self.trans)) / self.rate


def at_rate(motion: Motion, rate: float) -> Motion:
    """The motion at another frame rate, over the same time."""
    time = np.arange(int(np.floor(motion.time[-1] * rate + 1e-6)) + 1) / rate
    trans = np.stack([np.interp(time, motion.time, column) for column in motion.trans.T], axis=1)
    return Motion(slerp(motion.rotations, motion.time, time), trans, rate)


def played(motion: Motion, frames: int, rate: float, first: int = 0) -> Motion:
    """So many frames of a motion at a rate; a short one is played forth and back, slowing down where it turns.

    Parameters
    ----------
    first : frame to begin with, counted from a little after the motion's start; may be negative
    """
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation

    if len(motion.trans) == 1:
        return Motion(np.repeat(motion.rotations, frames, axis=0), np.repeat(motion.trans, frames, axis=0), rate)
    time = forth_and_back((first + np.arange(frames)) / rate, float(motion.time[-1]))
    # Splines of sign-continuous quaternions: piecewise straight ones would jerk at every frame of the source.
    quaternions = (
        Rotation.from_matrix(motion.rotations.reshape(-1, 3, 3)).as_quat().reshape(*motion.rotations.shape[:2], 4)
    )
    sign = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=2, keepdims=True))
    quaternions[1:] *= np.cumprod(np.where(sign == 0, 1, sign), axis=0)
    turned = CubicSpline(motion.time, quaternions)(time)
    rotations = Rotation.from_quat(turned.reshape(-1, 4)).as_matrix().reshape(frames, -1, 3, 3)
    return Motion(rotations, CubicSpline(motion.time, motion.trans)(time), rate)


def forth_and_back(time: np.ndarray, length: float) -> np.ndarray:
    """(T,) s into a recording of ``length`` s when it has been played for ``time`` s, at full speed but for the turns.

    Speed is continuous: near an end the recording is braked to rest and played back.
    """
    turn = min(_TURN, 0.5 * length)
    leg = length + turn  # the corners lie half a turn beyond the ends, where the rounded path does not come
    phase = np.mod(time + turn, 2 * leg)
    corner = np.abs(phase - np.where(phase > 1.5 * leg, 2 * leg, np.where(phase > 0.5 * leg, leg, 0)))
    straight = leg - np.abs(phase - leg)
    cut = np.where(corner < turn, (turn - corner) ** 2 / (2 * turn), 0)
    return np.clip(straight - 0.5 * turn + np.where(straight > 0.5 * leg, -cut, cut), 0, length)


def damped(motion: Motion, share: float) -> Motion:
    """The motion about its mean pose and place, scaled."""
    mean = kabsch(np.eye(3), np.swapaxes(motion.rotations.mean(axis=0), -1, -2))
    away = log_so3(np.swapaxes(mean, -1, -2) @ motion.rotations)
    middle = motion.trans.mean(axis=0)
    return Motion(mean @ exp_so3(share * away), middle + share * (motion.trans - middle), motion.rate)


def carried_over(motion: Motion, old: np.ndarray, body: Body, betas: np.ndarray) -> Motion:
    """The same poses on another body, the path scaled by the length of its legs.

    Parameters
    ----------
    old : (24, 3) m, joints at rest of the body that the motion was made for
    """
    rest = body.joints(betas)
    legs = [sum(np.linalg.norm(j[INDEX[a]] - j[INDEX[b]]) for a, b in _LEG) for j in (rest, old)]
    # What stays in place is the pelvis, not the translation, which counts from the resting root.
    return Motion(motion.rotations, (motion.trans + old[0]) * (legs[0] / legs[1]) - rest[0], motion.rate)


_LEG = (
    ("left_hip", "left_knee"),
    ("left_knee", "left_ankle"),
    ("right_hip", "right_knee"),
    ("right_knee", "right_ankle"),
)


def on_floor(motion: Motion, body: Body, betas: np.ndarray) -> Motion:
    """The motion lifted as a whole, so that its soles are on the floor z = 0 in all but the lowest frames."""
    rest = body.joints(betas)
    _, posed = chain(motion.rotations, rest, motion.trans)
    soles = [INDEX[f"{side}_{name}"] for side in ("left", "right") for name in ("ankle", "foot")]
    above = rest[soles, 1] - body.surface(betas)[:, 1].min()
    lowest = (posed[:, soles, 2] - above).min(axis=1)
    return Motion(motion.rotations, motion.trans - [0, 0, np.percentile(lowest, 5)], motion.rate)
