"""What the user asks when events are to be found."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import Units, Up

EventSource = Literal["auto", "body", "markers", "plates", "file"]
SUFFIXES = (".csv", ".c3d")
"""Formats that events can be written in."""


@dataclass(frozen=True)
class EventsRequest:
    """Events of one trial. None means the documented default.

    Attributes
    ----------
    trial : folder that a solve wrote, or a marker file
    out : files to write; the endings say the formats. Of a result, by default ``events.csv`` in its folder
    source : what steps are told by
    plates : OpenSim file with ground reaction forces, beside those of a C3D
    threshold : N, vertical force at which a plate counts as loaded
    repetitions : angle of the result whose repetitions are wanted instead of steps
    up, units, subject, marker_rate : how a marker file is read, as for a solve
    """

    trial: Path
    out: tuple[Path, ...] = ()
    source: EventSource = "auto"
    plates: Path | None = None
    threshold: float = 20.0
    repetitions: str | None = None
    up: Up | None = None
    units: Units | None = None
    subject: str | None = None
    marker_rate: float | None = None

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        for path in self.out:
            if path.suffix.lower() not in SUFFIXES:
                raise InputError("names no format that events are written in", path, f"end it in {', '.join(SUFFIXES)}")
        if not (math.isfinite(self.threshold) and self.threshold > 0):
            raise InputError(f"{self.threshold:g} is not possible", "--threshold", "give newtons, above 0")
        if self.marker_rate is not None and not (self.marker_rate > 0 and math.isfinite(self.marker_rate)):
            raise InputError(f"{self.marker_rate:g} is not possible", "--marker-rate", "give a number above 0")
        if self.repetitions is not None and (self.source != "auto" or self.plates is not None):
            raise InputError("repetitions are told by an angle", "--repetitions", "leave out --from and --plates")
