"""What the user asks of one solve, and what comes back: the command line and the window speak through these."""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from markerscope.solver.core.errors import InputError

Up = Literal["x", "y", "z"]
Units = Literal["m", "cm", "mm"]
Method = Literal["bundle", "paper", "neural", "known"]
RECORDED = "recorded"
"""What ``--neutral`` takes for the convention's own zero."""
_SPAN = re.compile(r"[-+.\deE]*:[-+.\deE]*")
LandmarkPull = Literal["earned", "off"]
Convention = Literal["opensim", "opensim-xzy", "isb", "isb-xzy", "gait2392", "visual3d", "plugin-gait"]


@dataclass(frozen=True)
class SolveRequest:
    """One solve. None means: as the session has it, else found from the data, else the documented default.

    Attributes
    ----------
    markers : marker file, or a session's folder (whose inputs and settings are then the start)
    out : folder for the results; a session may leave it out, its own folder is used then
    video : video of the same movement
    prior : poses reconstructed from the video by another program, instead of the embedded network's
    camera : result folder of another trial of the same session, to take the camera from
    marker_set : name of a marker set that ships, or a file, by which the markers are named before the solve; without a
        video or a prior, the pose that this finds is the prior
    offset, rate_ratio : s and 1, marker time = rate_ratio * video time + offset
    up : vertical axis of the marker file
    units : length unit of the marker file
    subject : whose markers to take where a file holds several people's
    marker_rate : Hz, frame rate of the marker file where it does not say
    part_of_cloud : which of several clouds of markers to solve, counted from 1, where two people are in one file
    range : (start, stop) s in the marker file's clock, either may be None
    method : how the body is fitted
    iterations : of each optimisation at most, for the paper's method
    seed : of every random choice
    body : a user's own SMPL-layout model instead of the embedded body
    weights : of the network, instead of those that ship, for the method with a network
    convention : names and signs of the angles
    neutral : what the angles are counted from: a span (start, stop) s of the trial, either may be None, the file of a
        static trial of the same person, or "recorded" for the convention's own zero
    known : a person known from other trials (person.npz): shape and marker places are taken from there
    markers_moved : the markers were put on anew since then, near the same places
    landmark_pull : whether markers are drawn to bony landmarks where their layout has earned it
    standard_errors : whether ``angles.csv`` has a column of standard errors beside each angle
    """

    markers: Path
    out: Path | None = None
    video: Path | None = None
    prior: Path | None = None
    camera: Path | None = None
    marker_set: str | None = None
    offset: float | None = None
    rate_ratio: float | None = None
    up: Up | None = None
    units: Units | None = None
    subject: str | None = None
    marker_rate: float | None = None
    part_of_cloud: int | None = None
    range: tuple[float | None, float | None] | None = None
    method: Method | None = None
    iterations: int | None = None
    seed: int | None = None
    body: Path | None = None
    weights: Path | None = None
    convention: Convention | None = None
    neutral: tuple[float | None, float | None] | Path | Literal["recorded"] | None = None
    landmark_pull: LandmarkPull | None = None
    known: Path | None = None
    markers_moved: bool | None = None
    standard_errors: bool | None = None

    def __post_init__(self) -> None:
        """Refuse values that no data can make sense of."""
        choices_of = {
            "up": Up, "units": Units, "method": Method, "convention": Convention, "landmark_pull": LandmarkPull,
        }  # fmt: skip
        for name, literal in choices_of.items():
            value, choices = getattr(self, name), typing.get_args(literal)
            if value is not None and value not in choices:
                raise InputError(f'"{value}" is not known', option(name), f"use {' or '.join(choices)}")
        for name in ("offset", "rate_ratio", "marker_rate"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise InputError(f"{value} is not possible", option(name), "give a finite number")
        for name in ("rate_ratio", "marker_rate"):
            value = getattr(self, name)
            if value is not None and value <= 0:
                raise InputError(f"{value:g} is not possible", option(name), "give a number above 0")
        for name in ("iterations", "part_of_cloud"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise InputError(f"{value} is not possible", option(name), "give 1 or more")
        if self.seed is not None and self.seed < 0:
            raise InputError(f"{self.seed} is not possible", option("seed"), "give 0 or a positive whole number")
        if self.range is not None:
            _check_range(*self.range)
        if isinstance(self.neutral, tuple):
            _check_range(*self.neutral, option("neutral"))


@dataclass(frozen=True)
class EvaluateRequest:
    """One comparison.

    Attributes
    ----------
    result : folder that a solve wrote, or its motion.npz
    reference : another result, or an AMASS-layout npz
    body : the SMPL-layout model that the reference was made with, if not the result's body
    """

    result: Path
    reference: Path
    body: Path | None = None


@dataclass(frozen=True)
class SynthRequest:
    """One synthetic session.

    Attributes
    ----------
    motion : a motion file, or the name of one of the program's own motions
    out : folder for the files
    seed : of every random choice
    skeleton : the ASF of an AMC, where it is not the one beside it
    motion_rate : Hz, frame rate of an AMC
    settings : fields of ``SynthSettings`` that are not to have their defaults
    """

    motion: str
    out: Path
    seed: int = 0
    skeleton: Path | None = None
    motion_rate: float | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a command found.

    Attributes
    ----------
    summary : what ``--json`` prints (plain JSON values; for a solve: stage times in seconds, energies, confidence...)
    lines : the same for a person, one sentence each
    warnings : what the user should doubt, one sentence each
    """

    summary: Mapping[str, Any]
    lines: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class SolveOutcome(Outcome):
    """What a solve found, and ``out``, the folder that it wrote it to."""

    out: Path


def check_inputs(request: SolveRequest | EvaluateRequest) -> None:
    """Refuse files that are not there before any work is done."""
    for one in fields(request):
        path = getattr(request, one.name)
        if isinstance(path, Path) and one.name != "out" and not path.exists():
            named = f" ({option(one.name)})" if one.default is None else ""
            raise InputError(f"there is no such file{named}", path, "check the name and the folder")


def option(name: str) -> str:
    """The command-line spelling of a field, for messages."""
    return f"--{name.replace('_', '-')}"


def parse_neutral(text: str) -> tuple[float | None, float | None] | Path | Literal["recorded"]:
    """A span ``A:B`` in seconds, ``recorded``, or the name of a file."""
    if text == RECORDED:
        return "recorded"
    if not text.strip() or text.strip() == ":":
        raise InputError(
            f'"{text}" names no pose', option("neutral"), f"give seconds A:B, the name of a file, or {RECORDED}"
        )
    return parse_range(text, option("neutral")) if _SPAN.fullmatch(text) else Path(text)


def parse_range(text: str, where: str = "--range") -> tuple[float | None, float | None]:
    """``A:B`` in seconds, either end may be left out: ``2.5:10``, ``:10``, ``2.5:``."""
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError(text)
        ends = tuple(float(end) if end.strip() else None for end in (start, stop))
    except ValueError as error:
        raise InputError(f'"{text}" is not understood', where, "give A:B in seconds, for example 2.5:10") from error
    _check_range(ends[0], ends[1], where)
    return ends[0], ends[1]


def _check_range(start: float | None, stop: float | None, where: str = "--range") -> None:
    for end in (start, stop):
        if end is not None and not math.isfinite(end):
            raise InputError(f"it cannot end at {end}", where, "give finite seconds, or leave the end out")
    if start is not None and stop is not None and stop <= start:
        raise InputError(f"it ends at {stop:g} s and starts at {start:g} s", where, "give the earlier time first")
