"""Joint angles over time, whoever read them off or wrote them down."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

_JUMP_DEG = 120.0


@dataclass(frozen=True)
class JointAngles:
    """Joint angles over time.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    names : A column names
    degrees : (T, A), each frame within what the joint can do, whatever came before
    singular : (T, A) True where the sequence cannot tell this angle from another: its value means nothing there
    convention, title : which convention, and what it is
    sequence : A, the intrinsic sequence, or the axes, that each angle is part of
    positive : A, what a positive value means
    zero_pose : what the angles are counted from
    neutral : (A,) degrees that were taken off, the angles of the neutral pose; 0 where nothing was
    zero : "recorded", or "neutral" where angles are relative to a neutral pose
    neutral_pose : what the neutral pose was read off, in words
    recorded_zero_pose : what they were counted from before that
    hint : which convention reads more of a shoulder that this one's sequence cannot tell; "" where there is no need
    """

    time: np.ndarray
    names: tuple[str, ...]
    degrees: np.ndarray
    singular: np.ndarray
    convention: str
    title: str
    sequence: tuple[str, ...]
    positive: tuple[str, ...]
    zero_pose: str
    neutral: np.ndarray = field(default_factory=lambda: np.zeros(0))
    zero: Literal["recorded", "neutral"] = "recorded"
    neutral_pose: str = ""
    recorded_zero_pose: str = ""
    hint: str = ""

    @property
    def as_recorded(self) -> JointAngles:
        """The same angles as the convention counts them, whatever the neutral pose."""
        if self.zero == "recorded":
            return self
        return replace(
            self,
            degrees=self.degrees + self.neutral,
            zero_pose=self.recorded_zero_pose,
            neutral=np.zeros(0),
            zero="recorded",
            neutral_pose="",
            recorded_zero_pose="",
        )

    @property
    def jumps(self) -> np.ndarray:
        """(T, A) True where a defined angle is over 120 degrees from the frame before: the reading changed, no joint.

        An angle that goes round comes in again at the other end of its range.
        """
        found = np.zeros(self.degrees.shape, dtype=bool)
        defined = ~self.singular
        found[1:] = (np.abs(np.diff(self.degrees, axis=0)) > _JUMP_DEG) & defined[1:] & defined[:-1]
        return found
