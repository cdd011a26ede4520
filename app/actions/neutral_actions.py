"""The pose that joint angles are counted from: here, or as a static trial has it, or the convention's own."""

from __future__ import annotations

from markerscope.app.actions.action import Action, Asks, needs, needs_session
from markerscope.app.models import edits
from markerscope.app.models.workbench import Workbench
from markerscope.solver.pipeline.names import FIT

_SPAN_S = 0.2
"""How long the pose under the cursor is averaged over."""
_needs_fit = needs("fit", "the fitted body is not there")


def _here(bench: Workbench, asks: Asks) -> None:
    time, motion = bench.clock.time, bench.board.current[FIT].time
    start = min(max(time - _SPAN_S / 2, motion[0]), max(motion[-1] - _SPAN_S, motion[0]))
    _apply(bench, edits.set_neutral_span(bench.document.session, start, min(start + _SPAN_S, motion[-1])))


def _file(bench: Workbench, asks: Asks) -> None:
    path = asks.file_to_open("neutral")
    if path is not None:
        session = edits.no_neutral(bench.document.session).session
        _apply(bench, edits.set_input(session, "neutral_file", path))


def _none(bench: Workbench, asks: Asks) -> None:
    _apply(bench, edits.no_neutral(bench.document.session))


def _apply(bench: Workbench, edit: edits.Edit) -> None:
    """The decision, its card beside it, and the angles read anew where there is a fit to read."""
    bench.document.apply(edit)
    bench.selection.select(stage="neutral")
    if "fit" in bench.board.current and not bench.runner.running:
        bench.runner.run(["neutral", "angles", "errors"])


def _has_none(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    session = bench.document.session
    tables = (session.settings.get("neutral", {}), session.edits.get("neutral", {}))
    named = "neutral_file" in session.inputs or any({"start", "stop"} & table.keys() for table in tables)
    return "" if named else "no neutral pose was named"


NEUTRAL_ACTIONS = (
    Action(
        "neutral.here",
        "Neutral pose here",
        "Edit",
        "Count joint angles from the pose under the time cursor, where the person stands still.",
        _here,
        why_not=_needs_fit,
    ),
    Action(
        "neutral.file",
        "Neutral pose from a static trial...",
        "Edit",
        "Count joint angles from the pose in another file: the same person with the same markers, standing still.",
        _file,
        why_not=needs_session,
    ),
    Action(
        "neutral.none",
        "No neutral pose",
        "Edit",
        "Count joint angles from the convention's own zero.",
        _none,
        why_not=_has_none,
    ),
)
