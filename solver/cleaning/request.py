"""What the user asks of one cleaning."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import Units, Up

Method = Literal["regression", "rigid", "edm", "pattern", "spline", "linear"]
OutlierMethod = Literal["local", "prominence", "none"]
Filling = Literal["regression", "rigid", "edm", "pattern", "spline", "linear", "none"]
NETWORK = "network"
"""A filling that needs weights, and so is no setting of a session."""

SUFFIXES = (".c3d", ".trc", ".csv")
"""Formats that can be written."""


@dataclass(frozen=True)
class CleanRequest:
    """One cleaning. None means the documented default.

    Attributes
    ----------
    markers, out : files; the second's ending says its format
    fill : the method, ``none`` leaves gaps, ``network`` fills by the weights where that is better than the default
    weights : of the network that fills gaps
    max_gap : s, longer gaps stay; infinite for no limit
    min_confidence : 0..1, gaps whose filling would be less sure stay
    outliers : how they are found
    apply : numbers, from 1, of proposed edits of an earlier run to be made first
    up, units, subject, marker_rate, range : how the file is read, as for a solve
    """

    markers: Path
    out: Path
    fill: Filling | Literal["network"] | None = None
    weights: Path | None = None
    max_gap: float | None = None
    min_confidence: float | None = None
    outliers: OutlierMethod | None = None
    apply: tuple[int, ...] = ()
    up: Up | None = None
    units: Units | None = None
    subject: str | None = None
    marker_rate: float | None = None
    range: tuple[float | None, float | None] | None = None

    def __post_init__(self) -> None:
        """Refuse what no cleaning can make sense of."""
        if self.out.suffix.lower() not in SUFFIXES:
            raise InputError("names no format that can be written", self.out, f"end it in {', '.join(SUFFIXES)}")
        if self.fill == NETWORK and self.weights is None:
            raise InputError("no weights are named", "--fill network", "add --weights FILE, as train writes them")
        if self.weights is not None and self.fill != NETWORK:
            raise InputError("weights are for --fill network alone", "--weights", "add --fill network, or leave it out")
        if self.max_gap is not None and not self.max_gap >= 0:
            raise InputError(f"{self.max_gap:g} is not possible", "--max-gap", "give seconds, 0 or above")
        if self.min_confidence is not None and not 0 <= self.min_confidence <= 1:
            raise InputError(f"{self.min_confidence:g} is not possible", "--min-confidence", "give 0 to 1")
        if self.marker_rate is not None and not (self.marker_rate > 0 and math.isfinite(self.marker_rate)):
            raise InputError(f"{self.marker_rate:g} is not possible", "--marker-rate", "give a number above 0")
        if any(number < 1 for number in self.apply):
            raise InputError("edits are numbered from 1", "--apply", "give numbers of edits that were proposed")


def parse_numbers(text: str) -> tuple[int, ...]:
    """``1,3`` as (1, 3)."""
    try:
        return tuple(int(part) for part in text.split(",") if part.strip())
    except ValueError as error:
        raise InputError(f'"{text}" is not understood', "--apply", "give numbers, for example 1,3") from error


FILLINGS, OUTLIER_METHODS = (*get_args(Filling), NETWORK), get_args(OutlierMethod)
