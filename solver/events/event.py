"""Events of a movement: what happened, on which side, when, and who says so."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from markerscope.solver.core.errors import InputError

Side = Literal["left", "right", "general"]
Kind = Literal["foot_strike", "foot_off", "start", "turn", "end", "other"]
Source = Literal["markers", "body", "plates", "file", "hand", "angle"]
SIDES: tuple[Side, Side] = ("left", "right")
STRIKE: Kind = "foot_strike"
OFF: Kind = "foot_off"


@dataclass(frozen=True)
class Event:
    """One event.

    Attributes
    ----------
    time : s, the marker file's clock
    side : whose foot, or general
    kind : ``foot_strike``, ``foot_off``; ``start``, ``turn``, ``end`` of a repetition; ``other``
    source : what it was told by
    spread : s, between the earliest and the latest of the estimates that it is the middle of; NaN where there was one
    label : what a file calls it, "" where it is the kind's own name
    """

    time: float
    side: Side
    kind: Kind
    source: Source
    spread: float = float("nan")
    label: str = ""

    @property
    def words(self) -> str:
        """What it is called."""
        return self.label or self.kind.replace("_", " ")


def in_order(events: Iterable[Event]) -> tuple[Event, ...]:
    """By time, then side, then kind."""
    return tuple(sorted(events, key=lambda event: (event.time, event.side, event.kind)))


def times_of(events: Iterable[Event], side: str, kind: str) -> np.ndarray:
    """(N,) s, times of one kind on one side, rising."""
    return np.array(sorted(event.time for event in events if event.side == side and event.kind == kind))


def strange(events: Iterable[Event]) -> tuple[str, ...]:
    """What contradicts itself in the steps, one sentence each: of one foot strikes and offs come in turns."""
    found = []
    for side in SIDES:
        steps = [event for event in in_order(events) if event.side == side and event.kind in (STRIKE, OFF)]
        for first, second in pairwise(steps):
            if first.kind == second.kind:
                other = "off" if first.kind == STRIKE else "strike"
                found.append(
                    f"The {side} foot has two {first.words}s, at {first.time:.3f} and {second.time:.3f} s, "
                    f"and no {other} between them."
                )
    return tuple(found)


def require_sense(events: Iterable[Event], where: str) -> None:
    """Refuse events that are no numbers, or that have one time twice.

    Raises
    ------
    InputError : as said
    """
    seen = set()
    for event in events:
        if not np.isfinite(event.time):
            raise InputError(f"a {event.words} has no time", where, "give its time in seconds, or take it out")
        key = (event.side, event.kind, event.label, round(event.time, 4))
        if key in seen:
            what = f"the {event.side} {event.words} at {event.time:.3f} s is there twice"
            raise InputError(what, where, "take one of them out")
        seen.add(key)
