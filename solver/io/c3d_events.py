"""Events of a C3D file: its EVENT section as several programs write it, and written anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.c3d_encode import MOST_PER_PARAMETER, Value, parameter_content
from markerscope.solver.io.c3d_format import C3DContent, decode_c3d
from markerscope.solver.io.c3d_keep import with_section
from markerscope.solver.io.c3d_parameters import Record, Section

_ICONS = {"foot strike": 1, "foot off": 2}
_CONTEXTS = ("General", "Left", "Right")


@dataclass(frozen=True)
class FileEvent:
    """An event as a file holds it.

    Attributes
    ----------
    time : s, in the file's clock, in which its first frame has the time (number - 1) / rate
    context : "Left", "Right", "General", or whatever stands there
    label : "Foot Strike"..., or empty
    """

    time: float
    context: str
    label: str


def events_of(content: C3DContent) -> tuple[FileEvent, ...]:
    """The events of a decoded file, in its order; times that are no numbers are left out."""
    section = content.section
    used = section.count("EVENT", "USED") or 0
    times = _joined(section, "TIMES").reshape(-1, 2)
    labels, contexts = section.text("EVENT", "LABELS"), section.text("EVENT", "CONTEXTS")
    rows = []
    for i in range(min(used, len(times)) if used else 0):
        time = float(60 * times[i, 0] + times[i, 1])
        if np.isfinite(time):
            rows.append(FileEvent(time, contexts[i] if i < len(contexts) else "", labels[i] if i < len(labels) else ""))
    return tuple(rows)


def _joined(section: Section, name: str) -> np.ndarray:
    """Numbers of an EVENT parameter and its continuations, an even number of them."""
    parts = [section.numbers("EVENT", name)]
    for i in range(2, 100):
        more = section.numbers("EVENT", f"{name}{i}")
        if not len(more):
            break
        parts.append(more)
    whole = np.concatenate(parts)
    return whole[: len(whole) // 2 * 2]


def with_events(data: bytes, path: str | Path, events: Sequence[FileEvent], subject: str = "") -> bytes:
    """A C3D file's bytes with other events in its EVENT section; all else stays as it is.

    Parameters
    ----------
    data : of a whole C3D file
    path : for messages
    subject : whose events

    Raises
    ------
    InputError : the file cannot be read, or so many events do not fit
    """
    if len(events) > MOST_PER_PARAMETER:
        what = f"{len(events)} events do not fit the EVENT section of a C3D, which holds {MOST_PER_PARAMETER}"
        raise InputError(what, path, "write them as CSV, or cut the trial")
    content = decode_c3d(data, path)
    section = content.section
    subject = subject or next(iter(section.text("SUBJECTS", "NAMES")), "")
    records = _without(section.records, "EVENT")
    records = _with_group(records, "EVENT", _parameters(events, subject), section)
    if not any(record.identity < 0 and record.name == "EVENT_CONTEXT" for record in records):
        records = _with_group(records, "EVENT_CONTEXT", _contexts(), section)
    try:
        return with_section(data, content, replace(section, records=records))
    except ValueError as error:
        raise InputError(f"has no room for events: {error}", path, "write them as CSV") from error


def _parameters(events: Sequence[FileEvent], subject: str) -> dict[str, Value]:
    count = len(events)
    times = np.array([[0.0, event.time] for event in events]).reshape(-1, 2)
    if not count:
        return {"USED": np.array([0])}
    return {
        "USED": np.array([count]),
        "CONTEXTS": tuple(event.context for event in events),
        "LABELS": tuple(event.label for event in events),
        "DESCRIPTIONS": ("",) * count,
        "SUBJECTS": (subject,) * count,
        "TIMES": times,
        "ICON_IDS": np.array([_ICONS.get(event.label.lower(), 0) for event in events]),
        "GENERIC_FLAGS": np.zeros(count, dtype=int),
    }


def _contexts() -> dict[str, Value]:
    return {
        "USED": np.array([len(_CONTEXTS)]),
        "LABELS": _CONTEXTS,
        "DESCRIPTIONS": ("For other events", "Left side", "Right side"),
        "ICON_IDS": np.arange(len(_CONTEXTS)),
    }


def _without(records: Sequence[Record], group: str) -> tuple[Record, ...]:
    """The records less the parameters of a group; the group itself stays."""
    own = {-record.identity for record in records if record.identity < 0 and record.name == group}
    return tuple(record for record in records if record.identity not in own)


def _with_group(
    records: tuple[Record, ...], group: str, parameters: dict[str, Value], section: Section
) -> tuple[Record, ...]:
    identity = next((-r.identity for r in records if r.identity < 0 and r.name == group), 0)
    if not identity:
        taken = {abs(record.identity) for record in records}
        identity = next((i for i in range(1, 128) if i not in taken), 0)
        if not identity:
            raise ValueError("it has 127 groups of parameters")
        records = (*records, Record(-identity, group.encode("ascii"), b"\0"))
    made = tuple(
        Record(identity, name.encode("ascii"), parameter_content(value, section.order, section.processor))
        for name, value in parameters.items()
    )
    return (*records, *made)
