"""One gap filled by every way there is, with the error to be expected of each; computed beside the window."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from markerscope.app.models.signal import Signal
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.fill import METHODS
from markerscope.solver.cleaning.fill.one import fill_gap, fill_gap_by_body
from markerscope.solver.cleaning.gaps import Gap

BODY = "body"
"""Not a method of the cleaning: the places of a fitted body are taken into the session."""
WAYS = (*METHODS, BODY)


@dataclass(frozen=True, eq=False)
class Preview:
    """A gap as one way would fill it.

    Attributes
    ----------
    way : a method, or ``BODY``
    values : (L, 3) m, None where it cannot
    error : m, to be expected; infinite where that is not known
    why_not : a clause, where it cannot
    """

    way: str
    values: np.ndarray | None
    error: float = float("inf")
    why_not: str = ""


_CANNOT = {
    "regression": "too little is seen of it, or about it",
    "rigid": "fewer than three markers are seen with it throughout",
    "edm": "fewer than three markers are seen with it throughout, or neither end is",
    "pattern": "no other marker is seen throughout",
    "spline": "it is not seen on both sides",
    "linear": "it is not seen on both sides",
    BODY: "the body has no place for it there",
}


def preview(work: Working, placed: np.ndarray | None, gap: Gap, way: str) -> Preview:
    """A gap as one way would fill it.

    Parameters
    ----------
    placed : (T, M, 3) m, where the fit in force has the markers; None without one
    """
    positions, rate = work.measured.positions, work.measured.rate
    if way != BODY:
        made = fill_gap(positions, rate, gap, METHODS[way])  # type: ignore[index]  # a way is a method
    elif placed is None or placed.shape != positions.shape:
        return Preview(way, None, why_not="there is no fit of these trajectories")
    else:
        made = fill_gap_by_body(positions, placed, rate, gap)
    if made is None:
        return Preview(way, None, why_not=_CANNOT[way])
    return Preview(way, made[1], made[0].error)


def best(previews: Iterator[Preview] | tuple[Preview, ...]) -> Preview | None:
    """The one of least expected error; None where none can fill the gap."""
    able = [p for p in previews if p.values is not None]
    return min(able, key=lambda p: p.error, default=None)


class GapPreviews:
    """The previews of the gap that was asked for last; each arrives as soon as it is made.

    Attributes
    ----------
    gap : the one, None without
    found : so far, in the order of ``WAYS``
    changed : emitted by ``poll`` when there is another
    """

    def __init__(self) -> None:
        self.gap: Gap | None = None
        self.found: tuple[Preview, ...] = ()
        self.changed: Signal[[]] = Signal()
        self._asked: tuple[object, ...] = ()
        self._arrived: list[Preview] = []
        self._lock = threading.Lock()
        self._turn = 0
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether more is to come."""
        return self.gap is not None and len(self.found) < len(WAYS)

    def ask(self, work: Working | None, placed: np.ndarray | None, gap: Gap | None) -> None:
        """Have the previews of a gap made, None for none; the same one is not made again."""
        known = self._asked
        if len(known) == 3 and known[0] is work and known[1] is placed and known[2] == gap:
            return
        self._asked = work, placed, gap
        self.gap, self.found = gap, ()
        with self._lock:
            self._turn += 1
            self._arrived = []
            turn = self._turn
        if work is not None and gap is not None:
            make = partial(preview, work, placed, gap)
            self._thread = threading.Thread(target=self._make, args=(turn, make), name="previews", daemon=True)
            self._thread.start()
        self.changed.emit()

    def _make(self, turn: int, make: Callable[[str], Preview]) -> None:
        for way in reversed(WAYS):  # the quick ones first
            if turn != self._turn:
                return
            try:
                made = make(way)
            except Exception as error:  # one that fails is one that cannot; the others are looked at all the same
                made = Preview(way, None, why_not=f"it failed: {error}")
            with self._lock:
                if turn == self._turn:
                    self._arrived.append(made)

    def poll(self) -> bool:
        """Take what has arrived; returns whether there was something."""
        with self._lock:
            arrived, self._arrived = self._arrived, []
        if not arrived:
            return False
        known = {p.way: p for p in (*self.found, *arrived)}
        self.found = tuple(known[way] for way in WAYS if way in known)
        self.changed.emit()
        return True
