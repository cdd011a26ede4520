"""What the cards of the stages show, as plain records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

State = Literal["not run", "cached", "check", "stale", "running", "failed"]
Kind = Literal["float", "int", "bool", "choice", "text", "range"]


@dataclass(frozen=True)
class FieldSpec:
    """One setting; any object with these attributes will do.

    Attributes
    ----------
    name : given back by the signals
    label : in words
    kind : of value; a "range" is a pair of numbers, either of which may be None
    value, default : as shown, in ``unit``; None where it is left to the program
    unit : such as "mm", "s", "deg"
    minimum, maximum : in ``unit``, None where there is no end
    choices : of a choice
    optional : whether None may be chosen
    help : what it means
    decided : whether it is a decision by hand
    """

    name: str
    label: str
    kind: Kind
    value: Any
    default: Any
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    optional: bool = False
    help: str = ""
    decided: bool = False


@dataclass(frozen=True)
class EarlierResult:
    """A result of a stage that is in the store.

    Attributes
    ----------
    key : given back by the signals
    settings : what differs from those in force, in words
    when : when it was computed, in words
    headline : its figure
    current : True for the one in force
    compared : True while it is shown beside the one in force
    """

    key: str
    settings: str
    when: str = ""
    headline: str = ""
    current: bool = False
    compared: bool = False


@dataclass(frozen=True)
class StageData:
    """All that a card shows.

    Attributes
    ----------
    name : given back by the signals
    title : in words
    state : see the words in ``MEANING``
    seconds : how long it took, None if unknown
    headline : one line about its result, or why it failed
    fields : its settings
    earlier : its results in the store, newest first
    help : what the stage does
    why_not : why it cannot run now, a clause; empty if it can
    checks : what is to check of its result, one sentence each
    note : what its result stands on that was decided by hand; empty where nothing is to be said
    """

    name: str
    title: str
    state: State = "not run"
    seconds: float | None = None
    headline: str = ""
    fields: tuple[FieldSpec, ...] = ()
    earlier: tuple[EarlierResult, ...] = ()
    help: str = ""
    why_not: str = ""
    checks: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class StageProgress:
    """How far a running stage is.

    Attributes
    ----------
    part : 0..1, None while unknown
    text : what it is at
    seconds_left : None while unknown
    """

    part: float | None = None
    text: str = ""
    seconds_left: float | None = None


MEANING = {
    "not run": "This stage has no result yet.",
    "cached": "The result fits the settings and all that it was computed from.",
    "check": "The result is there, and something in it deserves a look: the reasons stand below.",
    "stale": "A setting or an earlier stage has changed since: the results here are of before.",
    "running": "It is being computed now.",
    "failed": "It ended without a result.",
}


def duration(seconds: float) -> str:
    """A length of time as one says it."""
    if seconds < 0.095:
        return f"{1000 * seconds:.0f} ms"
    if seconds < 60:
        return f"{seconds:.1f} s" if seconds < 9.95 else f"{seconds:.0f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def left(seconds: float) -> str:
    """A time that remains, no more exact than it is known."""
    if seconds < 1.5:
        return "about 1 s left"
    if seconds < 55:
        return f"about {round(seconds) if seconds < 10 else 5 * round(seconds / 5)} s left"
    return f"about {max(1, round(seconds / 60))} min left"
