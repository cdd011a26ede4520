"""Decisions: undo and redo, what is selected, settings, earlier results, the offset, the range."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs, needs_session, or_without
from markerscope.app.actions.candidate_actions import CANDIDATE_ACTIONS
from markerscope.app.actions.group_actions import GROUP_ACTIONS, needs_groups, none_selected
from markerscope.app.models import edits
from markerscope.app.models.offsets import found_sync
from markerscope.app.models.results import Ref
from markerscope.app.models.workbench import Workbench


def _undo(bench: Workbench, asks: Asks) -> None:
    bench.document.undo()


def _redo(bench: Workbench, asks: Asks) -> None:
    bench.document.redo()


def _nothing_undone(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if bench.document.history.undo_sentence else "nothing has been decided yet"


def _nothing_redone(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if bench.document.history.redo_sentence else "nothing was undone"


def _all(bench: Workbench, asks: Asks) -> None:
    bench.selection.select_markers(range(len(bench.labels)))


def _none(bench: Workbench, asks: Asks) -> None:
    bench.selection.clear()


def _all_selected(bench: Workbench) -> str:
    every = len(bench.selection.markers) == len(bench.labels)
    return "all markers are selected already" if every else ""


def _nothing_selected(bench: Workbench) -> str:
    chosen = bench.selection
    some = chosen.markers or chosen.bone is not None
    single = (chosen.candidate, chosen.hypothesis, chosen.iteration) != (None, None, None)
    return "" if some or single else "nothing is selected"


def _invert(bench: Workbench, asks: Asks) -> None:
    bench.selection.select_markers(range(len(bench.labels)), "toggle")


def _whole_groups(bench: Workbench, asks: Asks) -> None:
    groups = bench.board.current["segment"].clusters
    touched = {int(groups[m]) for m in bench.selection.markers} - {-1}
    bench.selection.select_markers(np.flatnonzero(np.isin(groups, list(touched))), "add")


def _found_offset(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(edits.find_offset(bench.document.session))


def _no_offset(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if bench.board.settings["sync"].offset is not None else "the offset is the one found already"


def _range(bench: Workbench, asks: Asks) -> None:
    assert bench.clock.loop is not None
    bench.document.apply(edits.set_range(bench.document.session, *bench.clock.loop))


def _no_loop(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if bench.clock.loop else "no range is selected in the timelines"


def _whole(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(edits.set_range(bench.document.session, None, None))


def _no_range(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    settings = bench.board.settings["markers"]
    return "" if (settings.start, settings.stop) != (None, None) else "the whole recording is solved already"


_MARKERS = needs("markers", "the markers have not been read")


@dataclass(frozen=True)
class Value:
    """A setting of a stage and the value it is to have, as its form shows it; None leaves it to the program."""

    stage: str
    name: str
    value: Any


def _set_value(bench: Workbench, asks: Asks, given: Value) -> None:
    bench.document.apply(edits.set_value(bench.document.session, given.stage, given.name, given.value))


def _no_setting(bench: Workbench, given: Value) -> str:
    if reason := needs_session(bench):
        return reason
    known = hasattr(bench.board.settings.get(given.stage), given.name)
    return "" if known else "the method has no such setting"


def _set_offset(bench: Workbench, asks: Asks, offset: float) -> None:
    session, found = bench.document.session, found_sync(bench.board)
    automatic = found is not None and found.offset == offset  # which is no number that was given
    bench.document.apply(edits.find_offset(session) if automatic else edits.set_offset(session, offset))


def _tell_angles(bench: Workbench, asks: Asks, convention: str) -> None:
    """Tell the angles by another convention, at once where there is a fit to tell them of."""
    _set_value(bench, asks, Value("angles", "convention", convention))
    if "fit" in bench.board.current and "angles" not in bench.board.current and not bench.runner.running:
        bench.runner.run(["angles", "errors"], again=["angles"])


def _no_step(bench: Workbench, position: int) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if 0 <= position < len(bench.document.history.steps) else "there is no such step any more"


def _not_in_store(bench: Workbench, ref: Ref) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if bench.board.results.has(ref.stage, ref.key) else "the result is not in the store any more"


@dataclass(frozen=True)
class Compared:
    """A result, and whether it is to be shown beside the one in force."""

    ref: Ref
    on: bool


@dataclass(frozen=True)
class GivenFile:
    """An input of the session by its name, and the file it is to be; None for none."""

    name: str
    path: Path | None


SET_VALUE: ActionWith[Value] = ActionWith("setting.set", "Settings", _set_value, _no_setting)
TELL_ANGLES: ActionWith[str] = ActionWith(
    "angles.convention", "Convention of the angles", _tell_angles, or_without(needs_session)
)
SET_OFFSET: ActionWith[float] = ActionWith("offset.set", "Offset of the video", _set_offset, or_without(needs_session))
GIVE_INPUT: ActionWith[GivenFile] = ActionWith(
    "input.give",
    "Use a file",
    lambda bench, asks, given: bench.document.apply(edits.set_input(bench.document.session, given.name, given.path)),
    or_without(needs_session),
)
GO_BACK: ActionWith[Ref] = ActionWith(
    "result.use",
    "Use an earlier result",
    lambda bench, asks, ref: bench.document.apply(bench.board.go_back(ref.stage, ref.key)),
    _not_in_store,
)
COMPARE: ActionWith[Compared] = ActionWith(
    "result.compare",
    "Compare",
    lambda bench, asks, given: bench.board.compare(given.ref.stage, given.ref.key, given.on),
    lambda bench, given: _not_in_store(bench, given.ref) if given.on else needs_session(bench),
)
GO_TO_STEP: ActionWith[int] = ActionWith(
    "history.go", "History", lambda bench, asks, position: bench.document.go_to(position), _no_step
)
EDITS_WITH = (SET_VALUE, TELL_ANGLES, SET_OFFSET, GIVE_INPUT, GO_BACK, COMPARE, GO_TO_STEP)

EDIT_ACTIONS = (
    Action("edit.undo", "Undo", "Edit", "Take the last decision back.", _undo, "Ctrl+Z", _nothing_undone),
    Action("edit.redo", "Redo", "Edit", "Decide again what was undone.", _redo, "Ctrl+Shift+Z Ctrl+Y", _nothing_redone),
    Action(
        "select.all",
        "Select all markers",
        "Edit",
        "Select every marker.",
        _all,
        "Ctrl+A",
        first(_MARKERS, _all_selected),
    ),
    Action("select.none", "Select nothing", "Edit", "Let go of the selection.", _none, "Esc", _nothing_selected),
    Action("select.invert", "Invert selection", "Edit", "Select the other markers.", _invert, "Ctrl+I", _MARKERS),
    Action(
        "select.groups",
        "Select whole groups",
        "Edit",
        "Select all markers of the groups that selected markers belong to.",
        _whole_groups,
        "G",
        first(needs_groups, none_selected),
    ),
    *GROUP_ACTIONS,
    *CANDIDATE_ACTIONS,
    Action(
        "offset.found",
        "Use the offset found",
        "Edit",
        "Take the offset of the video that the motion says, instead of the one given.",
        _found_offset,
        why_not=_no_offset,
    ),
    Action(
        "range.selected",
        "Solve the selected range",
        "Edit",
        "Solve only the range that is selected in the timelines.",
        _range,
        why_not=_no_loop,
    ),
    Action("range.whole", "Solve the whole recording", "Edit", "Solve all frames.", _whole, why_not=_no_range),
)
