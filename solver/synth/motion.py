"""A body in motion, and the same motion at another rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.rotations import slerp


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
