"""What the view of joint angles shows, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Rgb = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class AngleCurve:
    """One angle of one side.

    Attributes
    ----------
    name : its column in the files
    side : "left", "right", or "" for pelvis and trunk
    degrees : (T,) NaN where it means nothing, or cannot be told from another angle
    reference : (T,) the same of another result on this clock, None where there is none
    positive : what a positive value means
    rests_on : what it was found from: "markers", "one segment" (of two, one carries markers), "video only"; ""
        if unknown
    colour : of its side
    error : (T,) degrees, standard error, None where it is not known
    """

    name: str
    side: str
    degrees: np.ndarray
    reference: np.ndarray | None = None
    positive: str = ""
    rests_on: str = ""
    colour: Rgb = (0, 114, 178)
    error: np.ndarray | None = None

    @property
    def unmeasured(self) -> bool:
        """Whether no marker sits on either segment: the curve is what the video says."""
        return self.rests_on == "video only"

    @property
    def band(self) -> tuple[np.ndarray, np.ndarray] | None:
        """(T,) and (T,) two standard errors below and above."""
        return None if self.error is None else (self.degrees - 2 * self.error, self.degrees + 2 * self.error)


@dataclass(frozen=True, eq=False)
class AnglePlot:
    """One angle, of both sides where there are two: its joint, its title, and its curves."""

    joint: str
    title: str
    curves: tuple[AngleCurve, ...]
