"""What ``markerscope events`` does: find a trial's events, say them, write them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.commands.trial import Found, Trial, events_of_trial, load_trial, rows_of
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.cycles.cycle import gait_cycles
from markerscope.solver.events.event import OFF, STRIKE, Event
from markerscope.solver.events.recorded import to_file
from markerscope.solver.events.repetitions import events_of_repetitions, find_repetitions
from markerscope.solver.events.request import EventsRequest
from markerscope.solver.io.angles_in import AngleTable, read_angles
from markerscope.solver.io.atomic import write_bytes_atomic, write_text_atomic
from markerscope.solver.io.c3d_events import with_events
from markerscope.solver.io.c3d_format import looks_like_c3d
from markerscope.solver.io.events_csv import FILE_NAME, events_csv
from markerscope.solver.io.text import read_bytes

_LABELLED = "markers_labelled.c3d"


def find_events(request: EventsRequest, progress: Progress = silent) -> Outcome:
    """Find, say and write the events of a trial.

    Raises
    ------
    InputError : the trial cannot be read, what was asked for is not in it, or a file cannot be written
    """
    progress(0.0, "reading")
    trial = load_trial(request.trial, request.up, request.units, request.subject, request.marker_rate)
    for path in request.out:
        if path.exists() and trial.path.exists() and path.samefile(trial.path):
            raise InputError("would be overwritten", path, "choose another name")
    progress(0.5, "looking for events")
    if request.repetitions is not None:
        found = repetitions_of(trial.path, request.repetitions)
    else:
        found = events_of_trial(trial, request.source, request.plates, request.threshold)
    out = request.out
    if not out and trial.body is not None and trial.path.is_dir():
        out = (trial.path / FILE_NAME,)
    notes = list(found.notes)
    for path in out:
        write_events(path, trial, found.events)
    lines = [f"{_counted(found)}, told by {found.told_by}."]
    lines += [f"  {event.time:9.3f} s  {event.side:7}  {event.words}{_spread(event)}" for event in found.events]
    lines += [f"Note: {note}" for note in notes]
    lines += [f"Written to {path}." for path in out]
    return Outcome(summary=_summary(trial, found, out), lines=tuple(lines))


def repetitions_of(path: Path, angle: str) -> Found:
    """Repetitions by an angle of a result or of an angle table.

    Raises
    ------
    InputError : there is no such angle, or it does not move
    """
    table = read_angles(path)
    values = table.degrees[:, column_of(table, angle, path)]
    found = find_repetitions(table.time, values)
    notes = () if found else ("No whole repetition was found: the angle does not go there and back.",)
    return Found(events_of_repetitions(found, angle), f"{angle} at 30 and 70 % of its range", False, notes)


def column_of(table: AngleTable, angle: str, where: Path) -> int:
    """Which column an angle is in.

    Raises
    ------
    InputError : none
    """
    if angle not in table.names:
        names = ", ".join(table.names[:40])
        raise InputError(f"has no angle {angle!r}", where, f"choose from {names}")
    return table.names.index(angle)


def write_events(path: Path, trial: Trial, events: tuple[Event, ...]) -> None:
    """Write events as CSV, or into a copy of the trial's C3D; of another marker file the C3D holds the markers alone.

    Raises
    ------
    InputError : the file cannot be written
    """
    if path.suffix.lower() == ".csv":
        write_text_atomic(path, events_csv(rows_of(events)))
        return
    source = trial.path / _LABELLED if trial.path.is_dir() else trial.path
    if not source.is_file():
        raise InputError(f"holds no {_LABELLED} to put events into", trial.path, "solve again, or write a .csv")
    data = read_bytes(source)
    if not looks_like_c3d(data):
        data = _as_c3d(trial)
    write_bytes_atomic(path, with_events(data, source, to_file(events)))


def _as_c3d(trial: Trial) -> bytes:
    """The markers alone, as a C3D."""
    from tempfile import TemporaryDirectory

    from markerscope.solver.io.export_c3d import write_c3d

    assert trial.markers is not None
    with TemporaryDirectory() as folder:
        made = Path(folder) / "markers.c3d"
        write_c3d(made, trial.markers)
        return made.read_bytes()


def _counted(found: Found) -> str:
    count = {kind: sum(e.kind == kind for e in found.events) for kind in (STRIKE, OFF, "start", "other")}
    words = {STRIKE: "foot strike", OFF: "foot off", "start": "repetition", "other": "other event"}
    said = [f"{n} {words[kind]}{'' if n == 1 else 's'}" for kind, n in count.items() if n]
    return ("Running: " if found.running else "") + (", ".join(said) or "No event")


def _spread(event: Event) -> str:
    return f"  (estimates {1000 * event.spread:.0f} ms apart)" if np.isfinite(event.spread) else ""


def _summary(trial: Trial, found: Found, out: tuple[Path, ...]) -> dict[str, Any]:
    feet = trial.feet
    return {
        "trial": trial.name,
        "told_by": found.told_by,
        "running": found.running,
        "events": [
            {"time_s": e.time, "side": e.side, "event": e.words, "source": e.source, "spread_s": e.spread}
            for e in found.events
        ],
        "cycles": [
            {"cycle": c.name, "start_s": c.start, "end_s": c.end, "left_out": c.why_not}
            for c in gait_cycles(found.events)
        ],
        "feet_seen": {} if feet is None else feet.seen,
        "notes": list(found.notes),
        "out": [str(path) for path in out],
    }
