"""What the user asks when curves are to be cut into cycles."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from markerscope.solver.core.errors import InputError

Quantity = Literal["gait", "angles", "velocities", "joints", "markers"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
AUTO = "auto"


@dataclass(frozen=True)
class FilterRequest:
    """A filter as the user says it; a cut-off of None is chosen by residual analysis."""

    kind: Literal["none", "butterworth", "spline"] = "none"
    cutoff: float | None = None
    order: int = 4


@dataclass(frozen=True)
class CyclesRequest:
    """Cycles of some trials of one person. None means the documented default.

    Attributes
    ----------
    trials : folders that solve wrote, or angle tables of OpenSim (.mot, .sto) with ``events``
    out : folder for tables and figures; of one result, by default ``cycles`` in its folder
    events : CSV of events instead of those found, for one trial
    repetitions : angle whose repetitions are the cycles, instead of gait
    quantities : what is cut
    filter : of the curves, after the angles were computed
    controls : results of one's own controls, or one CSV of mean and SD
    leave_out : by ``left 2`` or ``trial/left 2``, the reason
    title : of the figure
    width_mm : of the figure
    """

    trials: tuple[Path, ...]
    out: Path | None = None
    events: Path | None = None
    repetitions: str | None = None
    quantities: tuple[Quantity, ...] = ("gait", "angles")
    filter: FilterRequest = FilterRequest()
    controls: tuple[Path, ...] = ()
    leave_out: tuple[tuple[str, str], ...] = ()
    title: str | None = None
    width_mm: float = 180.0

    def __post_init__(self) -> None:
        """Refuse what makes no sense."""
        if len(self.trials) > 1 and self.events is not None:
            raise InputError(
                "one file of events is of one trial", "--events", "put events.csv into each result's folder"
            )
        if len(self.trials) > 1 and self.out is None:
            raise InputError("no folder was named for the cycles of several trials", remedy="add --out DIR")
        names = [name_of(path) for path in self.trials]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise InputError(f"two trials are called {twice!r}", "trials", "rename one of their folders")
        if not (math.isfinite(self.width_mm) and 60 <= self.width_mm <= 400):
            raise InputError(f"{self.width_mm:g} mm is not possible", "--width", "give 60 to 400")


def name_of(path: Path) -> str:
    """What a trial is called: its folder's name, or its file's."""
    path = path.absolute()
    return path.parent.name if path.name == "motion.npz" else path.name if path.is_dir() else path.stem


def parse_filter(text: str) -> FilterRequest:
    """``none``, ``spline``, ``butterworth:6``, ``butterworth:6:4`` (order), ``butterworth:auto``."""
    remedy = "say none, spline, butterworth:HZ, butterworth:HZ:ORDER or butterworth:auto"
    parts = text.lower().split(":")
    if text.lower() == "none":
        return FilterRequest()
    if text.lower() == "spline":
        return FilterRequest("spline")
    if parts[0] != "butterworth" or not 2 <= len(parts) <= 3:
        raise InputError(f'"{text}" is not understood', "--filter", remedy)
    try:
        cutoff = None if parts[1] == AUTO else float(parts[1])
        order = int(parts[2]) if len(parts) == 3 else 4
    except ValueError as error:
        raise InputError(f'"{text}" is not understood', "--filter", remedy) from error
    if cutoff is not None and not (math.isfinite(cutoff) and cutoff > 0):
        raise InputError(f"{cutoff:g} Hz is no cut-off frequency", "--filter", "give it in Hz, for instance 6")
    if order not in (2, 4, 6, 8, 10):
        raise InputError(f"an order of {order} cannot be filtered both ways", "--filter", "say 2, 4, 6, 8 or 10")
    return FilterRequest("butterworth", cutoff, order)


def parse_leave_out(text: str) -> tuple[str, str]:
    """``left 2: stumbled`` or ``trial/left 2: stumbled`` as the cycle's name and the reason."""
    found = re.fullmatch(r"\s*((?:.+/)?(?:left|right|general) \d+)\s*:\s*(\S.*?)\s*", text, re.S)
    if not found:
        remedy = 'say which cycle and why, like "left 2: stumbled"'
        raise InputError(f'"{text}" is not understood', "--leave-out", remedy)
    return found[1], found[2]


def parse_quantities(text: str) -> tuple[Quantity, ...]:
    """``gait,angles`` as a tuple."""
    names = tuple(part.strip() for part in text.split(",") if part.strip())
    unknown = next((name for name in names if name not in QUANTITIES), None)
    if unknown is not None or not names:
        what = f'"{unknown or text}" is no quantity'
        raise InputError(what, "--what", f"choose from {', '.join(QUANTITIES)}")
    return tuple(name for name in QUANTITIES if name in names)
