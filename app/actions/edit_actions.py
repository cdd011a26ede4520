"""Decisions: undo and redo, groups of markers, the pinned candidate, the offset, the range."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.actions.action import Action, Asks, Reason, first, needs, needs_idle, needs_session
from markerscope.app.actions.run_actions import run_until
from markerscope.app.models import edits, group_edits
from markerscope.app.models.edits import Edit
from markerscope.app.models.workbench import Workbench
from markerscope.solver.fit.results import Localization
from markerscope.solver.pipeline.names import LOCALIZE, MARKERS, SEGMENT

_needs_groups = needs("segment", "the groups of markers are not there")


def _selected(count: int, what: str) -> Reason:
    def why_not(bench: Workbench) -> str:
        return "" if len(bench.selection.markers) >= count else what

    return why_not


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
    bench.selection.select_markers(range(len(bench.board.current[MARKERS].labels)))


def _none(bench: Workbench, asks: Asks) -> None:
    bench.selection.clear()


def _invert(bench: Workbench, asks: Asks) -> None:
    bench.selection.select_markers(range(len(bench.board.current[MARKERS].labels)), "toggle")


def _whole_groups(bench: Workbench, asks: Asks) -> None:
    groups = bench.board.current[SEGMENT].clusters
    touched = {int(groups[m]) for m in bench.selection.markers} - {-1}
    bench.selection.select_markers(np.flatnonzero(np.isin(groups, list(touched))), "add")


GroupEdit = Callable[..., Edit]


def _group(edit: GroupEdit) -> Callable[[Workbench, Asks], object]:
    def run(bench: Workbench, asks: Asks) -> None:
        found = bench.board.current[SEGMENT]
        labels = bench.board.current[MARKERS].labels
        bench.document.apply(edit(bench.document.session, found, bench.selection.markers, labels))

    return run


def _move(bench: Workbench, asks: Asks) -> None:
    found = bench.board.current[SEGMENT]
    labels, chosen = bench.board.current[MARKERS].labels, bench.selection.markers
    own = {int(found.clusters[m]) for m in chosen}
    targets = [k for k in range(found.count) if own != {k}]
    members = {k: [labels[m] for m in np.flatnonzero(found.clusters == k)] for k in targets}
    options = [f"Group {k + 1}: {', '.join(members[k][:4])}{' …' if len(members[k]) > 4 else ''}" for k in targets]
    place = asks.choice("Move the selected markers to", options)
    if place is not None:
        host = int(np.flatnonzero(found.clusters == targets[place])[0])
        bench.document.apply(group_edits.move(bench.document.session, found, chosen, host, labels))


def _take_in(bench: Workbench, asks: Asks) -> None:
    labels = bench.board.current[MARKERS].labels
    bench.document.apply(group_edits.take_in(bench.document.session, bench.selection.markers, labels))


def _as_cut(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(group_edits.undo_all(bench.document.session))


def _pin(bench: Workbench, asks: Asks) -> None:
    row = bench.selection.candidate
    assert row is not None
    bench.document.apply(edits.pin_candidate(bench.document.session, row))


def _no_candidate(bench: Workbench) -> str:
    if reason := needs("orient", "there are no ranked candidates")(bench):
        return reason
    return "" if bench.selection.candidate is not None else "no candidate is selected"


def _leave_ghosts(bench: Workbench, asks: Asks) -> None:
    bench.selection.select(iteration=None, candidate=None, hypothesis=None)


def _no_ghost(bench: Workbench) -> str:
    chosen = bench.selection
    shown = (chosen.iteration, chosen.candidate, chosen.hypothesis) != (None, None, None)
    return "" if shown else "the fit is shown as it is"


def _pin_and_run(bench: Workbench, asks: Asks) -> None:
    _pin(bench, asks)
    run_until(bench, None)


def _unpin(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(edits.unpin_candidate(bench.document.session))


def _not_pinned(bench: Workbench) -> str:
    if reason := needs_session(bench):
        return reason
    return "" if getattr(bench.board.settings.get("fit"), "candidate", None) is not None else "no candidate is pinned"


def _clouds(bench: Workbench) -> np.ndarray:
    """(M,) number of the cloud that each marker belongs to; (0,) where the method makes out none."""
    found = bench.board.current[LOCALIZE]
    return found.cloud if isinstance(found, Localization) else np.zeros(0, dtype=int)


def _cloud(bench: Workbench, asks: Asks) -> None:
    cloud, labels = _clouds(bench), bench.board.current[MARKERS].labels
    sizes = np.bincount(cloud[cloud >= 0])
    members = [[labels[m] for m in np.flatnonzero(cloud == c)] for c in range(len(sizes))]
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
    return "" if _clouds(bench).max(initial=0) > 0 else "the markers form one cloud"


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


_ONE = _selected(1, "no marker is selected")
_TWO = _selected(2, "fewer than two markers are selected")
_MARKERS = needs("markers", "the markers have not been read")

EDIT_ACTIONS = (
    Action("edit.undo", "Undo", "Edit", "Take the last decision back.", _undo, "Ctrl+Z", _nothing_undone),
    Action("edit.redo", "Redo", "Edit", "Decide again what was undone.", _redo, "Ctrl+Shift+Z Ctrl+Y", _nothing_redone),
    Action("select.all", "Select all markers", "Edit", "Select every marker.", _all, "Ctrl+A", _MARKERS),
    Action("select.none", "Select nothing", "Edit", "Let go of the selection.", _none, "Esc"),
    Action("select.invert", "Invert selection", "Edit", "Select the other markers.", _invert, "Ctrl+I", _MARKERS),
    Action(
        "select.groups",
        "Select whole groups",
        "Edit",
        "Select all markers of the groups that selected markers belong to.",
        _whole_groups,
        "G",
        first(_needs_groups, _ONE),
    ),
    Action(
        "groups.merge",
        "Merge groups",
        "Edit",
        "Make one group of the groups of the selected markers.",
        _group(group_edits.merge),
        "M",
        first(_needs_groups, _TWO),
    ),
    Action(
        "groups.split",
        "Split off",
        "Edit",
        "Give the selected markers a group of their own.",
        _group(group_edits.split),
        "S",
        first(_needs_groups, _ONE),
    ),
    Action(
        "groups.move",
        "Move to group...",
        "Edit",
        "Put the selected markers into another group.",
        _move,
        "Shift+M",
        first(_needs_groups, _ONE),
    ),
    Action(
        "groups.leave_out",
        "Leave out",
        "Edit",
        "Leave the selected markers out of the solve.",
        _group(group_edits.leave_out),
        "Del",
        first(_needs_groups, _ONE),
    ),
    Action(
        "groups.take_in",
        "Put back in",
        "Edit",
        "Have selected markers back that were left out.",
        _take_in,
        "Shift+Del",
        first(_needs_groups, _ONE),
    ),
    Action(
        "groups.as_cut",
        "Groups as the cut makes them",
        "Edit",
        "Take back every merge, split, move and marker left out.",
        _as_cut,
        why_not=_needs_groups,
    ),
    Action("candidate.pin", "Pin candidate", "Edit", "Go on from the selected candidate.", _pin, "P", _no_candidate),
    Action(
        "candidate.pin_run",
        "Pin candidate and run on",
        "Edit",
        "Go on from the selected candidate, and compute what follows from it at once.",
        _pin_and_run,
        "Shift+P",
        first(_no_candidate, needs_idle),
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
