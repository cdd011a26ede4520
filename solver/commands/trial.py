"""One trial as events and cycles need it: a solved body, or a marker file alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.angles.angles import world_rotations
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.cycles.request import name_of
from markerscope.solver.evaluate.posed import Posed, imported_result, measured_markers
from markerscope.solver.events.event import STRIKE, Event, Kind, Side, in_order, require_sense, strange
from markerscope.solver.events.feet import Feet, feet_by_bone, feet_by_name, feet_of_body
from markerscope.solver.events.merge import merged
from markerscope.solver.events.plates import events_of_plates
from markerscope.solver.events.recorded import from_file
from markerscope.solver.events.request import EventSource
from markerscope.solver.events.steps import find_steps
from markerscope.solver.io.c3d_events import events_of
from markerscope.solver.io.c3d_format import decode_c3d, looks_like_c3d
from markerscope.solver.io.events_csv import EventRow
from markerscope.solver.io.force_plates import ForcePlate, plates_of_c3d, plates_of_mot
from markerscope.solver.io.motion_in import MOTION
from markerscope.solver.io.text import read_bytes
from markerscope.solver.pipeline.session import load_session, session_folder

_KINDS: dict[str, Kind] = {
    "foot strike": "foot_strike",
    "foot off": "foot_off",
    "start": "start",
    "turn": "turn",
    "end": "end",
}


@dataclass(frozen=True, eq=False)
class Trial:
    """What is known of one trial.

    Attributes
    ----------
    name, path : of its folder or file
    time, rate : (T,) s and Hz, of the body where there is one, else of the markers
    body : the solved body, None for a marker file
    turn : (T, 24, 3, 3) rotations of its joints in the lab
    markers : None where they are not at hand
    marker_joint : (M,) bone of each marker after a solve
    original : the marker file as it was recorded, None where it is not at hand
    notes : what was assumed, one sentence each
    """

    name: str
    path: Path
    time: np.ndarray
    rate: float
    body: Posed | None
    turn: np.ndarray | None
    markers: Markers | None
    marker_joint: np.ndarray | None
    original: Path | None
    notes: tuple[str, ...] = ()

    @property
    def feet(self) -> Feet | None:
        """Of the body where there is one, else of the markers by their names."""
        return self.feet_of("body") or self.feet_of("markers")

    def feet_of(self, source: str) -> Feet | None:
        """As the body or the markers show them, None where these do not."""
        if source == "body" and self.body is not None and self.turn is not None:
            body = self.body
            landmarks, rest = body.body.landmarks(body.betas), body.body.joints(body.betas)
            return feet_of_body(self.time, self.rate, self.turn, body.joints, rest, landmarks)
        if source == "markers" and self.markers is not None:
            if self.marker_joint is not None and self.turn is not None:
                return feet_by_bone(self.markers, self.marker_joint, self.turn)
            return feet_by_name(self.markers)
        return None


def load_trial(
    path: Path,
    up: str | None = None,
    units: str | None = None,
    subject: str | None = None,
    marker_rate: float | None = None,
) -> Trial:
    """A result's folder, its ``motion.npz``, or a marker file.

    Raises
    ------
    InputError : it is not there, or cannot be read
    """
    from markerscope.solver.io.markers_in import load_markers

    if not path.exists():
        raise InputError("there is no such file or folder", path, "check the name")
    if path.is_dir() or path.name == MOTION:
        return _result(path)
    markers = load_markers(path, up=up, units=units, subject=subject, rate=marker_rate)  # type: ignore[arg-type]
    return Trial(name_of(path), path, markers.time, markers.rate, None, None, markers, None, path, markers.notes)


def _result(path: Path) -> Trial:
    body, notes = imported_result(path)
    folder = path if path.is_dir() else path.parent
    markers, joint = measured_markers(path), None
    with np.load(folder / MOTION, allow_pickle=False) as motion:
        if "marker_joint" in motion:
            joint = motion["marker_joint"]
    if markers is not None and (
        joint is None or len(joint) != len(markers.labels) or len(markers.time) != len(body.time)
    ):
        markers = None
    rate = (len(body.time) - 1) / float(body.time[-1] - body.time[0]) if len(body.time) > 1 else 1.0
    turn = world_rotations(body.rotations)
    original = None
    if session_folder(folder) is not None:
        file = load_session(folder).inputs.get("marker_file")
        original = file.path if file is not None and file.path.is_file() else None
    return Trial(name_of(path), path, body.time, rate, body, turn, markers, joint, original, notes)


@dataclass(frozen=True, eq=False)
class Found:
    """Events of a trial, and what is to be said about them.

    Attributes
    ----------
    events : in order
    told_by : what they were told by, in words
    running : whether it is a run
    notes : one sentence each
    """

    events: tuple[Event, ...]
    told_by: str
    running: bool
    notes: tuple[str, ...]


def events_of_trial(
    trial: Trial, source: EventSource = "auto", plates: Path | None = None, threshold: float = 20.0
) -> Found:
    """Steps of a trial. By default the file's own events where it has any; else plates, and the body or the markers
    for the steps beside them.

    Parameters
    ----------
    plates : OpenSim's ground reaction forces

    Raises
    ------
    InputError : what was asked for is not there
    """
    notes: list[str] = []
    recorded = _recorded(trial) if source in ("auto", "file") else ()
    if source == "file" and not recorded:
        raise InputError("holds no events", trial.original or trial.path, "choose another source with --from")
    if recorded and (source == "file" or any(event.kind == STRIKE for event in recorded)):
        return Found(recorded, "the file's own events", False, strange(recorded))
    feet = trial.feet_of("markers") if source == "markers" else trial.feet
    if source == "body":
        feet = trial.feet_of("body")
    if feet is None:
        what = "is no result of a solve" if source == "body" else "has no markers that are known to be heel and toe"
        remedy = "solve it first, or name heel and toe markers as laboratories do (LHEE, LTOE)"
        raise InputError(what, trial.path, remedy)
    by_plates: tuple[Event, ...] = ()
    if source in ("auto", "plates"):
        found, said = _plates(trial, plates)
        notes += said
        by_plates, left = events_of_plates(feet, found, threshold)
        notes += left
        if source == "plates" and not found:
            raise InputError("holds no force plates", trial.original or trial.path, "give a file with --plates")
        if source == "plates":
            return Found(by_plates, "force plates", False, tuple(notes))
    steps = find_steps(feet, body=trial.body is not None and source != "markers")
    events = in_order((*merged(by_plates, steps.events), *(e for e in recorded if e.kind == "other")))
    told_by = f"force plates and {feet.source}" if by_plates else feet.source
    return Found(events, told_by, steps.running, (*notes, *steps.notes, *strange(events)))


def _recorded(trial: Trial) -> tuple[Event, ...]:
    """Events that the recorded file holds, those within the trial."""
    if trial.original is None:
        return ()
    data = read_bytes(trial.original)
    if not looks_like_c3d(data):
        return ()
    events = from_file(events_of(decode_c3d(data, trial.original)))
    slack = 1 / trial.rate
    return tuple(e for e in events if trial.time[0] - slack <= e.time <= trial.time[-1] + slack)


def _plates(trial: Trial, plates: Path | None) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    if plates is not None:
        return plates_of_mot(plates), ()
    if trial.original is None or trial.markers is None or not looks_like_c3d(read_bytes(trial.original)):
        return (), ()
    return plates_of_c3d(trial.original, trial.markers)


def rows_of(events: tuple[Event, ...]) -> tuple[EventRow, ...]:
    """Events as rows of a CSV."""
    return tuple(EventRow(e.time, e.side, e.words, e.source, e.spread) for e in events)


def events_of_rows(rows: tuple[EventRow, ...], where: str) -> tuple[Event, ...]:
    """Rows of a CSV as events.

    Raises
    ------
    InputError : one is there twice
    """
    sources = ("markers", "body", "plates", "file", "hand", "angle")
    events = []
    for row in rows:
        word = row.event.strip().lower().replace("_", " ")
        last = word.rsplit(" ", 1)[-1]
        side: Side = row.side  # type: ignore[assignment]
        kind = _KINDS.get(word) or (_KINDS[last] if side == "general" and last in ("start", "turn", "end") else "other")
        if kind in ("foot_strike", "foot_off") and side == "general":
            kind = "other"
        label = "" if word in _KINDS else row.event
        source = row.source if row.source in sources else "hand"
        events.append(Event(row.time, side, kind, source, row.spread, label))  # type: ignore[arg-type]
    require_sense(events, where)
    return in_order(events)
