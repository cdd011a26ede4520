"""What the user decides, as pure functions from a session to the next one and a sentence for the history.

Settings go to the session's settings; decisions about this recording (range, offset, groups, the pinned candidate) go
to its edits, which lie over the settings, so that they can be told apart and taken back.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

from markerscope.app.models.fields import Setting, setting_of, title
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import Method
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.pipeline.cleaning import BY_FRAME
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.methods import with_method as solved_by
from markerscope.solver.pipeline.session import InputFile, Session
from markerscope.solver.pipeline.settings import UNSET, overlay, to_table, without

DECISIONS = {
    "markers": ("start", "stop"),
    "clean": BY_FRAME,
    "sync": ("offset", "rate_ratio"),
    "segment": ("threshold", "groups", "merges", "splits", "moves", "left_out"),
    "localize": ("part_of_cloud",),
    "fit": ("candidate", "pinned", "refused", "second"),
    "neutral": ("start", "stop"),
}
"""Settings that are decided for one recording."""
Layer = Literal["settings", "edits"]
INPUTS = {
    "marker_file": "marker file",
    "video_file": "video",
    "prior_file": "pose prior",
    "camera_file": "camera",
    "body_file": "body",
    "weights_file": "network's weights",
    "neutral_file": "static trial for the neutral pose",
    "known_file": "person known from other trials",
}


@dataclass(frozen=True)
class Edit:
    """One decision.

    Attributes
    ----------
    sentence : for the history and the undo menu, without a full stop
    session : as it is afterwards
    merge : edits in a row with the same one, if any, are one step of the history (a value being dialled)
    complete : whether all that stands on what it changes is settled, too (an earlier result is gone back to)
    """

    sentence: str
    session: Session
    merge: str = ""
    complete: bool = False


def set_value(session: Session, stage: str, name: str, shown: Any) -> Edit:
    """Give a setting a value, as shown in its form (``Setting.value``); None leaves it to the program."""
    setting = _setting(session, stage, name)
    table = {name: setting.inner(shown)}
    if name in DECISIONS.get(stage, ()) or name in _named(session.edits.get(stage, {})):
        after = decide(session, stage, table)
    else:
        after = _lay(session, "settings", stage, table)
    said = f"{title(stage)}: {setting.label} {setting.said(shown)}, was {setting.said(setting.value)}"
    return Edit(said, after, f"{stage}.{name}")


def reset_value(session: Session, stage: str, name: str) -> Edit:
    """Give a setting its default again."""
    setting = _setting(session, stage, name)
    after = _drop(_drop(session, "edits", stage, {name}), "settings", stage, {name})
    return Edit(f"{title(stage)}: {setting.label} {setting.said(setting.default)} again", after)


def reset_stage(session: Session, stage: str) -> Edit:
    """Give all settings of a stage their defaults; decisions stay."""
    after = replace(session, settings={name: table for name, table in session.settings.items() if name != stage})
    return Edit(f"{title(stage)}: all settings to their defaults", after)


def take_back(session: Session, stage: str) -> Edit:
    """Take back every decision about a stage."""
    after = replace(session, edits={name: table for name, table in session.edits.items() if name != stage})
    return Edit(f"{title(stage)}: all decisions taken back", after)


def decide(session: Session, stage: str, table: Mapping[str, Any]) -> Session:
    """The session with values (None among them) laid over a stage's settings as decisions."""
    return _lay(session, "edits", stage, table)


def set_range(session: Session, start: float | None, stop: float | None) -> Edit:
    """Solve a range only, s of the marker file's clock; None leaves an end open."""
    after = decide(session, "markers", {"start": start, "stop": stop})
    ends = (f"{end:.2f} s" if end is not None else word for end, word in ((start, "the start"), (stop, "the end")))
    whole = start is None and stop is None
    return Edit("Solve the whole recording" if whole else "Solve from {} to {}".format(*ends), after, "range")


def set_neutral_span(session: Session, start: float, stop: float) -> Edit:
    """Count angles from the mean pose of a span of the trial, s of the marker file's clock."""
    inputs = {name: file for name, file in session.inputs.items() if name != "neutral_file"}
    after = decide(replace(session, inputs=inputs), "neutral", {"start": float(start), "stop": float(stop)})
    return Edit(f"Angles counted from the pose at {start:.2f} to {stop:.2f} s", after, "neutral")


def no_neutral(session: Session) -> Edit:
    """Count angles from the convention's own zero again."""
    inputs = {name: file for name, file in session.inputs.items() if name != "neutral_file"}
    after = _drop(replace(session, inputs=inputs), "edits", "neutral", {"start", "stop"})
    after = _drop(after, "settings", "neutral", {"start", "stop"})
    return Edit("Angles counted from the convention's own zero", after)


def set_offset(session: Session, offset: float) -> Edit:
    """Say how the video lies on the markers' clock, s."""
    return Edit(f"Offset of the video {offset:+.3f} s", decide(session, "sync", {"offset": float(offset)}), "offset")


def find_offset(session: Session) -> Edit:
    """Let the motion say how the video lies on the markers' clock."""
    after = _drop(session, "edits", "sync", {"offset"})
    if "offset" in after.settings.get("sync", {}):
        after = decide(after, "sync", {"offset": None})
    return Edit("Offset of the video as found from the motion", after)


def pin_candidate(session: Session, row: int) -> Edit:
    """Go on from this row of the ranked candidates."""
    return Edit(f"Candidate {candidate_number(row)} pinned", decide(session, "fit", {"candidate": int(row)}))


def unpin_candidate(session: Session) -> Edit:
    """Go on from the best candidate again."""
    after = _drop(session, "edits", "fit", {"candidate"})
    if "candidate" in after.settings.get("fit", {}):
        after = decide(after, "fit", {"candidate": None})
    return Edit("No candidate pinned", after)


def choose_cloud(session: Session, number: int) -> Edit:
    """Solve this one of several clouds of markers, counted from 1."""
    return Edit(f"Solve cloud {number} of the markers", decide(session, "localize", {"part_of_cloud": int(number)}))


def set_method(session: Session, method: Method) -> Edit:
    """Solve by another method; what belongs to the old one alone goes."""
    names = {"bundle": "the default method", "paper": "the published method", "neural": "the network"}
    return Edit(f"Solve by {names.get(method, method)}", solved_by(session, method))


def set_seed(session: Session, seed: int) -> Edit:
    """Seed every random choice."""
    if seed < 0:
        raise InputError(f"{seed} is not possible", "the seed", "give 0 or a positive whole number")
    return Edit(f"Seed {seed}", replace(session, run=replace(session.run, seed=seed)), "seed")


def set_input(session: Session, name: str, path: Path | None) -> Edit:
    """Take another file as an input, or none."""
    what = INPUTS[name]
    if path is None:
        if name == "marker_file":
            raise InputError("a session cannot be without one", "the marker file", "choose another file instead")
        inputs = {other: file for other, file in session.inputs.items() if other != name}
        return Edit(f"No {what}", replace(session, inputs=inputs))
    inputs = {**session.inputs, name: InputFile(existing(path, what))}
    return Edit(f"{what[0].upper()}{what[1:]} {Path(path).name}", replace(session, inputs=inputs))


def restore(session: Session, stages: Mapping[str, Any], method: Method, sentence: str) -> Edit:
    """Give stages the settings that an earlier result had.

    Parameters
    ----------
    stages : settings dataclass by stage
    method : that the result belongs to
    """
    after = solved_by(session, method)
    settings, edits = dict(after.settings), dict(after.edits)
    for stage, value in stages.items():
        table, default = to_table(value), to_table(type(value)())
        by_hand = {name for name in _named(table) if name in DECISIONS.get(stage, ())}
        settings[stage] = without(table, by_hand)
        edits[stage] = {name: v for name, v in table.items() if name in by_hand and v != default.get(name)}
    edits = {stage: table for stage, table in edits.items() if table}
    return Edit(sentence, replace(after, settings=settings, edits=edits), complete=True)


def existing(path: Path, what: str) -> Path:
    """The absolute path of a file that is there.

    Raises
    ------
    InputError : there is none
    """
    if not path.exists():
        raise InputError(f"there is no such {what}", path, "check the name and the folder")
    if path.is_dir():
        raise InputError(f"is a folder, not a {what}", path, "name the file in it")
    return path.absolute()


def _setting(session: Session, stage: str, name: str) -> Setting:
    return setting_of(stage, session.stage_settings(graph_of(session))[stage], name)


def _named(table: Mapping[str, Any]) -> set[str]:
    """Every setting that a table says something of."""
    return {name for name in (*table, *table.get(UNSET, ())) if name != UNSET}


def _lay(session: Session, layer: Layer, stage: str, table: Mapping[str, Any]) -> Session:
    said = {name: value for name, value in table.items() if value is not None}
    said[UNSET] = [name for name, value in table.items() if value is None]
    return _with_table(session, layer, stage, overlay(getattr(session, layer).get(stage, {}), said))


def _drop(session: Session, layer: Layer, stage: str, names: Collection[str]) -> Session:
    return _with_table(session, layer, stage, without(getattr(session, layer).get(stage, {}), names))


def _with_table(session: Session, layer: Layer, stage: str, table: Mapping[str, Any]) -> Session:
    """The session with another table for a stage; one that says nothing is left out."""
    tables: dict[str, Any] = {**getattr(session, layer), stage: table}
    tables = {name: table for name, table in tables.items() if table}
    return replace(session, settings=tables) if layer == "settings" else replace(session, edits=tables)


def decided(session: Session, stage: str) -> frozenset[str]:
    """Names of a stage's settings that were decided by hand."""
    return frozenset(_named(session.edits.get(stage, {})))


def differences(before: Any, after: Any) -> tuple[str, ...]:
    """Names of the fields in which two settings dataclasses of one type differ."""
    return tuple(field.name for field in fields(after) if getattr(before, field.name) != getattr(after, field.name))
