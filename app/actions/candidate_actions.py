"""Candidates, their ghosts, and the cloud of markers that is solved."""

from __future__ import annotations

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs, needs_idle, needs_session
from markerscope.app.actions.run_actions import run_until
from markerscope.app.models import edits
from markerscope.app.models.workbench import Workbench


def pinned(bench: Workbench) -> int | None:
    """The row that the settings pin, None for the best."""
    if not bench.document.is_open:
        return None
    row: int | None = getattr(bench.board.settings.get("fit"), "candidate", None)
    return row


def _unranked(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    if "orient" not in bench.board.current and bench.board.latest("orient") is not None:
        return "these candidates are out of date; run the stage Orientation first"
    return needs("orient", "there are no ranked candidates")(bench)


def _not_to_pin(bench: Workbench, row: int) -> str:
    if reason := _unranked(bench):
        return reason
    if not 0 <= row < len(bench.board.current["orient"].candidates):
        return "this one was not ranked, so there is nothing to go on from"
    return "it is pinned already" if row == pinned(bench) else ""


def _pin(bench: Workbench, row: int) -> None:
    bench.document.apply(edits.pin_candidate(bench.document.session, row))


PIN: ActionWith[int] = ActionWith("candidate.pin_row", "Pin", lambda bench, asks, row: _pin(bench, row), _not_to_pin)
"""Go on from a row of the ranked candidates."""
CANDIDATES_WITH = (PIN,)


def _chosen(bench: Workbench) -> int:
    row = bench.selection.candidate
    assert row is not None
    return row


def _no_candidate(bench: Workbench) -> str:
    if reason := _unranked(bench):
        return reason
    row = bench.selection.candidate
    return "no candidate is selected" if row is None else _not_to_pin(bench, row)


def _nothing_to_run(bench: Workbench) -> str:
    """A candidate that is pinned already can still be run on from."""
    reason = _no_candidate(bench)
    return "" if bench.selection.candidate is not None and bench.selection.candidate == pinned(bench) else reason


def _pin_and_run(bench: Workbench, asks: Asks) -> None:
    _pin(bench, _chosen(bench))
    run_until(bench, None)


def _unpin(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(edits.unpin_candidate(bench.document.session))


def _not_pinned(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if pinned(bench) is not None else "no candidate is pinned"


def _leave_ghosts(bench: Workbench, asks: Asks) -> None:
    bench.selection.select(iteration=None, candidate=None, hypothesis=None)


def _no_ghost(bench: Workbench) -> str:
    chosen = bench.selection
    shown = (chosen.iteration, chosen.candidate, chosen.hypothesis) != (None, None, None)
    return "" if shown else "the fit is shown as it is"


def _cloud(bench: Workbench, asks: Asks) -> None:
    found, labels = bench.board.current["localize"], bench.labels
    sizes = np.bincount(found.cloud[found.cloud >= 0])
    members = [[labels[m] for m in np.flatnonzero(found.cloud == c)] for c in range(len(sizes))]
    options = [
        f"Cloud {c + 1}, {len(own)} markers: {', '.join(own[:4])}{' …' if len(own) > 4 else ''}"
        for c, own in enumerate(members)
    ]
    place = asks.choice("Solve the markers of", options)
    if place is not None:
        bench.document.apply(edits.choose_cloud(bench.document.session, place + 1))


def _one_cloud(bench: Workbench) -> str:
    if reason := needs("localize", "the markers have not been placed yet")(bench):
        return reason
    cloud = getattr(bench.board.current["localize"], "cloud", np.zeros(0, dtype=int))
    return "" if cloud.max(initial=0) > 0 else "the markers form one cloud"


CANDIDATE_ACTIONS = (
    Action(
        "candidate.pin",
        "Pin candidate",
        "Edit",
        "Go on from the selected candidate.",
        lambda bench, asks: _pin(bench, _chosen(bench)),
        "P",
        _no_candidate,
    ),
    Action(
        "candidate.pin_run",
        "Pin candidate and run on",
        "Edit",
        "Go on from the selected candidate, and compute what follows from it at once.",
        _pin_and_run,
        "Shift+P",
        first(_nothing_to_run, needs_idle),
    ),
    Action("candidate.unpin", "Unpin candidate", "Edit", "Go on from the best candidate.", _unpin, "", _not_pinned),
    Action(
        "ghosts.leave",
        "Back to the fit",
        "View",
        "Show the fitted body alone again: no candidate, no hypothesis, no iteration on the way to it.",
        _leave_ghosts,
        "Shift+Esc",
        _no_ghost,
    ),
    Action(
        "cloud.choose",
        "Solve another cloud of markers...",
        "Edit",
        "Where the markers form several clouds (two people in one file), choose the one that is solved.",
        _cloud,
        why_not=_one_cloud,
    ),
)
