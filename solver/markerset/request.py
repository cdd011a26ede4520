"""What the user asks of marker sets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import Units, Up

SUFFIXES = (".c3d", ".trc", ".csv")
"""Formats that labelled trajectories can be written in."""


@dataclass(frozen=True)
class LabelRequest:
    """Names for the trajectories of one file.

    Attributes
    ----------
    markers, out : files; the second's ending says its format
    marker_set : name of one that ships, or a file
    up, units, subject, marker_rate, range : how the file is read, as for a solve
    """

    markers: Path
    out: Path
    marker_set: str
    up: Up | None = None
    units: Units | None = None
    subject: str | None = None
    marker_rate: float | None = None
    range: tuple[float | None, float | None] | None = None

    def __post_init__(self) -> None:
        """Refuse formats that cannot be written."""
        if self.out.suffix.lower() not in SUFFIXES:
            raise InputError(f'"{self.out.suffix}" is not a format', "--out", f"use {', '.join(SUFFIXES)}")


@dataclass(frozen=True)
class LearnRequest:
    """A marker set learnt from a labelled trial.

    Attributes
    ----------
    markers : labelled marker file, or a folder that a solve of one wrote
    out : the set's file, TOML
    name : of the set; None takes the file's
    video, prior : of the trial, where its names are nobody's
    up, units, subject, marker_rate, range : how the file is read, as for a solve
    """

    markers: Path
    out: Path
    name: str | None = None
    video: Path | None = None
    prior: Path | None = None
    up: Up | None = None
    units: Units | None = None
    subject: str | None = None
    marker_rate: float | None = None
    range: tuple[float | None, float | None] | None = None

    def __post_init__(self) -> None:
        """Refuse other formats."""
        if self.out.suffix.lower() != ".toml":
            raise InputError(f'"{self.out.suffix}" is no marker set', "--out", "give a name that ends in .toml")
