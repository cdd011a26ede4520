"""Running stages and choosing the method."""

from __future__ import annotations

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs_idle, needs_session
from markerscope.app.models import edits
from markerscope.app.models.fields import title
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.core.request import Method


def run_until(bench: Workbench, stage: str | None) -> None:
    """Have every stage down to one, or all, computing only what is missing; says so where there is nothing to do."""
    board = bench.board
    until = None
    if stage is not None:
        above = board.names[: board.names.index(stage) + 1]
        runnable = board.runnable
        until = [name for name in above if name == stage or name in runnable]
    if not bench.runner.run(until):
        what = "All results are" if stage is None else f"Everything up to {title(stage)} is"
        bench.say(Said("note", _and(f"{what} there for these settings already", _left_out(bench, until))))
    elif left := _left_out(bench, until):
        bench.say(Said("note", _and("Only what the files that are there allow is computed", left)))


def _and(said: str, more: str) -> str:
    return f"{said}; {more}" if more else said


def _left_out(bench: Workbench, until: list[str] | None) -> str:
    """Which of all stages a run of all leaves out, and why; empty where it leaves out none."""
    board = bench.board
    others = [name for name in board.names if name not in board.runnable] if until is None else []
    problem = board.problem_of(others)
    if problem is None:
        return ""
    return f"{title(others[0])} and {len(others) - 1} more stages wait, since {str(problem).rstrip('.')}"


def run_stage(bench: Workbench, stage: str) -> None:
    """Compute one stage, also where it is there, from what is there; only what it needs and is missing comes first."""
    bench.runner.run([stage], again=[stage])


def _all(bench: Workbench, asks: Asks) -> None:
    run_until(bench, None)


def _selected(bench: Workbench, asks: Asks) -> None:
    run_until(bench, bench.selection.stage)


def _alone(bench: Workbench, asks: Asks) -> None:
    assert bench.selection.stage is not None
    run_stage(bench, bench.selection.stage)


def _no_stage(bench: Workbench) -> str:
    return "" if bench.selection.stage in bench.board.names else "no stage is selected"


def lacking(bench: Workbench, stage: str | None = None) -> str:
    """Why a stage, or any at all, cannot be run with the files there are; empty where it can."""
    board = bench.board
    if stage is None and board.runnable:
        return ""
    problem = board.problem_of(board.names if stage is None else [stage])
    return "" if problem is None else str(problem).rstrip(".")


def _selected_lacks(bench: Workbench) -> str:
    return lacking(bench, bench.selection.stage)


def _stop(bench: Workbench, asks: Asks) -> None:
    bench.runner.cancel()
    bench.say(Said("note", "Stopped; what was finished stays"))


def _nothing_runs(bench: Workbench) -> str:
    return "" if bench.runner.running else "nothing runs"


def _method(method: Method, name: str, help: str) -> Action:
    def run(bench: Workbench, asks: Asks) -> None:
        bench.document.apply(edits.set_method(bench.document.session, method))

    def on(bench: Workbench) -> bool:
        return bench.document.is_open and bench.document.session.run.method == method

    def why_not(bench: Workbench) -> str:
        return needs_session(bench) or ("it is the session's method already" if on(bench) else "")

    return Action(f"method.{method}", name, "Run", help, run, why_not=why_not, checked=on)


_READY = first(needs_session, needs_idle)


def _not_to_run(bench: Workbench, stage: str) -> str:
    if reason := _READY(bench):
        return reason
    return lacking(bench, stage) if stage in bench.board.names else "the method has no such stage"


def _at(bench: Workbench, stage: str) -> str:
    """The stage, with its card beside what comes of it."""
    bench.selection.select(stage=stage)
    return stage


RUN_STAGE: ActionWith[str] = ActionWith(
    "run.one", "Run", lambda bench, asks, stage: run_stage(bench, _at(bench, stage)), _not_to_run
)
RUN_TO: ActionWith[str] = ActionWith(
    "run.down_to", "Run to here", lambda bench, asks, stage: run_until(bench, _at(bench, stage)), _not_to_run
)
RUNS_WITH = (RUN_STAGE, RUN_TO)

RUN_ACTIONS = (
    Action(
        "run.all",
        "Run all",
        "Run",
        "Have every result for the settings as they are, the quick ones first.",
        _all,
        "F5 Ctrl+R",
        first(_READY, lacking),
    ),
    Action(
        "run.to",
        "Run to the selected stage",
        "Run",
        "Compute what is missing of the stages down to the selected one.",
        _selected,
        "F6",
        first(_READY, _no_stage, _selected_lacks),
    ),
    Action(
        "run.stage",
        "Run the selected stage",
        "Run",
        "Compute the selected stage, once more if it is there, and what it needs only where that is missing.",
        _alone,
        "Shift+F6",
        first(_READY, _no_stage, _selected_lacks),
    ),
    Action("run.stop", "Stop", "Run", "Stop what runs; what is finished stays.", _stop, "Ctrl+.", _nothing_runs),
    _method("bundle", "Default method", "Fit by bundle adjustment with the video's landmarks."),
    _method("paper", "Published method", "Fit as Milef et al. (2024) did, for comparison."),
    _method("neural", "Network", "Have a trained network read the poses off the markers, then refine them."),
)
