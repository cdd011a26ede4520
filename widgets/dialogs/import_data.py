"""What the import dialog shows and gives back, as plain records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

UNITS = ("mm", "cm", "m")
AXES = ("z", "y")


@dataclass(frozen=True, eq=False)
class ImportShown:
    """A marker file as it would be read.

    Attributes
    ----------
    name : of the file
    labels : (M,) of the points
    measured : (M,) share 0..1 of the frames that show each
    points : (M, 3) m, z up, in one frame; NaN = lost
    frames : how many there are
    units, units_declared : taken, and as the file says (None where it is silent)
    up, up_declared : taken, and as the file says
    rate, rate_known : Hz, and whether the file or the user said so
    subjects, subject : that the file tells apart, and whose points these are
    notes : what was assumed, a sentence each
    problem : what keeps the file from being read so, "" if nothing does
    """

    name: str
    labels: tuple[str, ...]
    measured: np.ndarray
    points: np.ndarray
    frames: int
    units: str = "mm"
    units_declared: str | None = None
    up: str = "z"
    up_declared: str | None = None
    rate: float = 0.0
    rate_known: bool = True
    subjects: tuple[str, ...] = ()
    subject: str = ""
    notes: tuple[str, ...] = ()
    problem: str = ""

    @property
    def height(self) -> float:
        """m, from the lowest to the highest point; NaN without any."""
        z = self.points[np.isfinite(self.points).all(axis=1), 2]
        return float(np.ptp(z)) if len(z) else float("nan")


@dataclass(frozen=True)
class ImportChoice:
    """What the user decided: ``left_out`` are labels, ``video`` a path or ""."""

    units: str
    up: str
    rate: float
    subject: str
    left_out: tuple[str, ...]
    video: str
