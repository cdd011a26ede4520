"""What the view of marker curves shows, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Rgb = tuple[int, int, int]
Kind = Literal["raw", "measured", "filled", "body", "preview"]
KIND_TITLES: dict[Kind, str] = {
    "raw": "as in the file",
    "measured": "cleaned",
    "filled": "filled",
    "body": "as the body predicts",
    "preview": "preview of a fill",
}
"""What each way of drawing a line means, in the order of the legend."""


@dataclass(frozen=True, eq=False)
class Line:
    """One quantity of one marker.

    Attributes
    ----------
    kind : which says how it is drawn
    label : the marker's name
    values : (n,) NaN where there is none
    colour : of the marker
    start : frame of the first value
    strong : whether it stands out among others of its kind
    """

    kind: Kind
    label: str
    values: np.ndarray
    colour: Rgb
    start: int = 0
    strong: bool = False


@dataclass(frozen=True, eq=False)
class CurvePlot:
    """One plot: a component of a quantity, of every marker that is shown."""

    title: str
    unit: str
    lines: tuple[Line, ...]


@dataclass(frozen=True)
class Shade:
    """A stretch of frames that is marked, both inclusive.

    Attributes
    ----------
    first, last : frames
    kind : "gap", "filled", "outlier"
    label : the marker's name
    colour : of the marker
    target : whether it is the one that an edit would be made on
    """

    first: int
    last: int
    kind: str
    label: str
    colour: Rgb
    target: bool = False


@dataclass(frozen=True)
class Way:
    """One way to fill the gap.

    Attributes
    ----------
    name, title : in the program, and in words
    error : in words, such as "1.2 mm"
    why_not : why it cannot, a clause
    help : what it does
    """

    name: str
    title: str
    error: str = ""
    why_not: str = ""
    help: str = ""


@dataclass(frozen=True)
class ProposalRow:
    """A proposed edit: what, when, and what was decided about it ("proposed", "accepted", "rejected")."""

    sentence: str
    time: str
    state: str


@dataclass(frozen=True, eq=False)
class CurvePicture:
    """All that the plots show.

    Attributes
    ----------
    time : (T,) s
    plots : top down
    shades : under all of them
    names : (name, colour) of the markers, for the legend
    note : what is left out, or why nothing is shown
    """

    time: np.ndarray
    plots: tuple[CurvePlot, ...] = ()
    shades: tuple[Shade, ...] = ()
    names: tuple[tuple[str, Rgb], ...] = ()
    note: str = ""
    kinds: frozenset[str] = field(default_factory=frozenset)
