"""Decisions that stand on something else fall with it, openly: they are taken back by the edit that moved the ground.

The pinned candidate is a row of a ranking, hand-made groups are columns of the marker file, edits of tracks are columns
and frames of it. After another ranking, or of other columns and frames, the same numbers would mean something else, and
nobody would see it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from markerscope.app.models.edits import Edit
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.pipeline.cleaning import BY_FRAME
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import stage_keys
from markerscope.solver.pipeline.stages import SOURCES

_BY_COLUMN = ("merges", "splits", "moves", "left_out")


def kept_decisions(before: Session, edit: Edit) -> Edit:
    """The edit, with the decisions taken back that it makes meaningless, and a sentence that says so."""
    after, lost = edit.session, []
    if edit.complete:
        return edit
    columns = _columns(before) != _columns(after)
    for stage, names, moved, said in (
        ("segment", _BY_COLUMN, columns, "groups made by hand are as the cut makes them"),
        ("localize", ("part_of_cloud",), columns, "the cloud to solve is chosen by the program again"),
        ("clean", BY_FRAME, columns or _start(before) != _start(after), "edits of tracks are taken back"),
    ):
        table = after.edits.get(stage, {})
        kept = {name: value for name, value in table.items() if name not in names}
        if moved and kept != table:
            after = _with(after, stage, kept)
            lost.append(said)
    pinned, still = (session.edits.get("fit", {}).get("candidate") for session in (before, after))
    if pinned is not None and still == pinned and _ranking(before) != _ranking(after):
        after = _with(after, "fit", {name: v for name, v in after.edits["fit"].items() if name != "candidate"})
        lost.append(f"candidate {candidate_number(pinned)} is no longer pinned")
    if not lost:
        return edit
    return replace(edit, session=after, sentence="; ".join((edit.sentence, *lost)))


def _columns(session: Session) -> tuple[Any, ...]:
    file = session.inputs.get("marker_file")
    return None if file is None else file.path, session.settings.get("markers", {}).get("subject")


def _start(session: Session) -> Any:
    """From where frames are counted."""
    return session.stage_settings(graph_of(session))["markers"].start


def _ranking(session: Session) -> str | None:
    """What the ranking of the candidates depends on, but for what the files hold."""
    files = {name: file.path.as_posix() for name, file in session.inputs.items()}
    sources = {name: Source(None, files.get(name, "none")) for name in SOURCES}
    stages = graph_of(session)
    return stage_keys(stages, sources, session.stage_settings(stages)).get("orient")


def _with(session: Session, stage: str, table: Mapping[str, Any]) -> Session:
    tables = {name: dict(own) for name, own in {**session.edits, stage: table}.items() if own}
    return replace(session, edits=tables)
