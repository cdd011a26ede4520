"""Events as files name them, in the words of several programs, and ours in Vicon's words."""

from __future__ import annotations

import re
from collections.abc import Iterable

from markerscope.solver.events.event import OFF, STRIKE, Event, Kind, Side, in_order
from markerscope.solver.io.c3d_events import FileEvent

_STRIKES = r"(foot|heel|initial|ground)[\s_-]*(strike|contact|on|down)|touch[\s_-]*down|initial[\s_-]*contact"
_OFFS = r"(foot|toe)[\s_-]*off|take[\s_-]*off"
_SHORT = re.compile(r"(?P<side>[LR]|left|right)?[\s_.-]*(?P<kind>HS|FS|IC|FC|TD|FD|TO|FO)", re.I)
_SHORT_STRIKES = ("HS", "FS", "IC", "FC", "TD", "FD")
_NAMES = {STRIKE: "Foot Strike", OFF: "Foot Off"}
_SAID = {"left": r"\bleft\b|^l[\s_.-]", "right": r"\bright\b|^r[\s_.-]"}


def from_file(events: Iterable[FileEvent]) -> tuple[Event, ...]:
    """Events of a C3D by what they are; those that are no steps, or of no side, keep their label.

    Vicon says the side as context and the kind as label; Cortex both in the context (``LHS``) with an empty label;
    Qualisys both in the label. A foot event of no side is no step.
    """
    return in_order(_read(event) for event in events)


def to_file(events: Iterable[Event]) -> tuple[FileEvent, ...]:
    """Events in the words of Vicon's programs, which most readers know."""
    return tuple(
        FileEvent(event.time, event.side.capitalize(), event.label or _NAMES.get(event.kind, event.words.title()))
        for event in events
    )


def _read(event: FileEvent) -> Event:
    side = _side(event.context) or _side(event.label)
    kind = _kind(event.label) or _kind(event.context)
    if side is None or kind is None:
        label = event.label or event.context
        return Event(event.time, side or "general", "other", "file", label=label)
    return Event(event.time, side, kind, "file")


def _side(text: str) -> Side | None:
    words = re.sub(r"[_-]+", " ", text.strip().lower())
    short = _SHORT.fullmatch(text.strip())
    if words in ("l", "left") or (short and (short["side"] or "").lower().startswith("l")):
        return "left"
    if words in ("r", "right") or (short and (short["side"] or "").lower().startswith("r")):
        return "right"
    if re.search(_SAID["left"], words):
        return "left"
    return "right" if re.search(_SAID["right"], words) else None


def _kind(text: str) -> Kind | None:
    short = _SHORT.fullmatch(text.strip())
    if short:
        return STRIKE if short["kind"].upper() in _SHORT_STRIKES else OFF
    if re.search(_STRIKES, text, re.I):
        return STRIKE
    return OFF if re.search(_OFFS, text, re.I) else None
