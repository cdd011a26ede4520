"""What a row of the timelines shows, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class PresenceRow:
    """A strip a marker: where it was seen, lost, filled or taken for an outlier.

    Attributes
    ----------
    name : shown left of the row, and given back by the signals
    time : (T,) s, rising
    present : (T, M) True where the marker was measured
    filled : (T, M) True where a gap was filled, None if nothing was
    outlier : (T, M) True where a point was taken out, None if none was
    colours : (M, 3) uint8 of the strips, None for one colour
    labels : of the strips, for the tooltip
    help : what the row means
    markers : (M,) the marker that each strip shows, by which signals and selections go; None if strip k is marker k
    """

    name: str
    time: np.ndarray
    present: np.ndarray
    filled: np.ndarray | None = None
    outlier: np.ndarray | None = None
    colours: np.ndarray | None = None
    labels: tuple[str, ...] = ()
    help: str = ""
    markers: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class StateRow:
    """One strip of named states, such as the video's tracked and lost frames.

    Attributes
    ----------
    name : as above
    time : (T,) s, rising
    states : (T,) uint8, indices into ``colours`` and ``labels``; the higher wins where several fall on one pixel
    colours : (S, 3) uint8
    labels : (S,) what each state is called
    help : what the row means
    """

    name: str
    time: np.ndarray
    states: np.ndarray
    colours: np.ndarray
    labels: tuple[str, ...] = ()
    help: str = ""


@dataclass(frozen=True, eq=False)
class Curve:
    """One line of a plot.

    Attributes
    ----------
    label : in the legend
    values : (T,) in the unit of its row; NaN interrupts the line
    colour : (3,) uint8
    time : (T,) s if it has a clock of its own, else None
    dashed : True for what is compared with
    framed : False where it may go beyond the axis, which the others decide then
    old : True for what is out of date: it is drawn pale
    """

    label: str
    values: np.ndarray
    colour: np.ndarray
    time: np.ndarray | None = None
    dashed: bool = False
    framed: bool = True
    old: bool = False


@dataclass(frozen=True, eq=False)
class CurveRow:
    """Lines over time, such as the residual of every cached fit.

    Attributes
    ----------
    name : as above
    time : (T,) s of the curves that bring no clock of their own
    curves : drawn in order
    unit : of the values as given, such as "mm"
    lowest : lower end of the axis, None to go by the values
    help : what the row means
    """

    name: str
    time: np.ndarray
    curves: tuple[Curve, ...]
    unit: str
    lowest: float | None = 0.0
    help: str = ""


@dataclass(frozen=True, eq=False)
class OffsetRow:
    """The video's span as a bar to drag along the markers' clock: ``marker time = rate_ratio * video time + offset``.

    Attributes
    ----------
    name : as above
    start, end : s on the video's own clock
    offset : s, in force
    automatic : s, found from the motion; None if it was not looked for
    rate_ratio : marker seconds per video second
    fixed : how much the markers move over time, drawn behind the bar for the eye to match; None to leave it out
    moving : the same of the video, on the video's clock; it moves with the bar
    help : what the row means
    """

    name: str
    start: float
    end: float
    offset: float
    automatic: float | None = None
    rate_ratio: float = 1.0
    fixed: Curve | None = None
    moving: Curve | None = None
    help: str = ""


Row = PresenceRow | StateRow | CurveRow | OffsetRow
