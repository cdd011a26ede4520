"""Groups of markers edited: by keys for the selected markers, by menus and drags for those under the pointer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs, or_without
from markerscope.app.models import group_edits
from markerscope.app.models.edits import Edit
from markerscope.app.models.workbench import Workbench
from markerscope.solver.clustering.segment import Segmentation

Kind = Literal["merge", "split", "move", "leave_out", "take_in"]
needs_groups = needs("segment", "the groups of markers are not there")


@dataclass(frozen=True)
class GroupEdit:
    """What is to be done to which markers; ``target`` is the group they are moved to, counted from 0."""

    kind: Kind
    markers: tuple[int, ...]
    target: int = -1


def _edited(bench: Workbench, asked: GroupEdit) -> None:
    found: Segmentation = bench.board.current["segment"]
    session, labels = bench.document.session, bench.labels
    if asked.kind == "move":
        host = int(np.flatnonzero(found.clusters == asked.target)[0])
        edit = group_edits.move(session, found, asked.markers, host, labels)
    elif asked.kind == "take_in":
        edit = group_edits.take_in(session, asked.markers, labels)
    else:
        edits: dict[str, Callable[..., Edit]] = {
            "merge": group_edits.merge, "split": group_edits.split, "leave_out": group_edits.leave_out,
        }  # fmt: skip
        edit = edits[asked.kind](session, found, asked.markers, labels)
    bench.document.apply(edit)


def _why_not(bench: Workbench, asked: GroupEdit) -> str:
    """Why it cannot be done; what only the edit itself can find out it says when it is tried."""
    if reason := needs_groups(bench):
        return reason
    if asked.kind == "merge" and len(asked.markers) < 2:
        return "fewer than two markers are selected"
    if not asked.markers:
        return "no marker is selected"
    clusters = bench.board.current["segment"].clusters
    if max(asked.markers) >= len(clusters):
        return "the groups are of other markers"
    groups = {int(clusters[m]) for m in asked.markers} - {-1}
    if asked.kind == "merge":
        return "" if len(groups) > 1 else "the markers are of one group already"
    if asked.kind == "take_in":
        return "" if (clusters[list(asked.markers)] < 0).any() else "the markers are not left out"
    if not groups:
        return "the markers are in no group"
    if asked.kind == "move":
        if not (clusters == asked.target).any():
            return "there is no such group"
        return "" if groups != {asked.target} else "the markers are in that group already"
    return ""


EDIT_GROUPS: ActionWith[GroupEdit] = ActionWith(
    "groups.edit", "Groups", lambda bench, asks, asked: _edited(bench, asked), _why_not
)
CUT_GROUPS: ActionWith[float] = ActionWith(
    "groups.cut",
    "Cut the tree",
    lambda bench, asks, height: bench.document.apply(group_edits.cut_at(bench.document.session, height)),
    or_without(needs_groups),
)
GROUPS_WITH = (EDIT_GROUPS, CUT_GROUPS)


def _selected(bench: Workbench, kind: Kind) -> GroupEdit:
    return GroupEdit(kind, tuple(sorted(bench.selection.markers)))


def _by_key(kind: Kind, title: str, help: str, shortcut: str) -> Action:
    return Action(
        f"groups.{kind}",
        title,
        "Edit",
        help,
        lambda bench, asks: _edited(bench, _selected(bench, kind)),
        shortcut,
        lambda bench: _why_not(bench, _selected(bench, kind)),
    )


def _move(bench: Workbench, asks: Asks) -> None:
    found: Segmentation = bench.board.current["segment"]
    labels, chosen = bench.labels, _selected(bench, "move").markers
    own = {int(found.clusters[m]) for m in chosen}
    targets = [k for k in range(found.count) if own != {k}]
    members = {k: [labels[m] for m in np.flatnonzero(found.clusters == k)] for k in targets}
    options = [f"Group {k + 1}: {', '.join(members[k][:4])}{' …' if len(members[k]) > 4 else ''}" for k in targets]
    place = asks.choice("Move the selected markers to", options)
    if place is not None:
        _edited(bench, GroupEdit("move", chosen, targets[place]))


def _as_cut(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(group_edits.undo_all(bench.document.session))


def none_selected(bench: Workbench) -> str:
    """Whether no marker is selected."""
    return "" if bench.selection.markers else "no marker is selected"


def _in_no_group(bench: Workbench) -> str:
    clusters = bench.board.current["segment"].clusters
    return "" if any(clusters[m] >= 0 for m in bench.selection.markers) else "the markers are in no group"


def _as_cut_already(bench: Workbench) -> str:
    settings = bench.board.settings["segment"]
    by_hand = any(getattr(settings, name) for name in group_edits.BY_HAND)
    return "" if by_hand else "the groups are as the cut makes them already"


GROUP_ACTIONS = (
    _by_key("merge", "Merge groups", "Make one group of the groups of the selected markers.", "M"),
    _by_key("split", "Split off", "Give the selected markers a group of their own.", "S"),
    Action(
        "groups.move",
        "Move to group...",
        "Edit",
        "Put the selected markers into another group.",
        _move,
        "Shift+M",
        first(needs_groups, none_selected, _in_no_group),
    ),
    _by_key("leave_out", "Leave out", "Leave the selected markers out of the solve.", "Del"),
    _by_key("take_in", "Put back in", "Have selected markers back that were left out.", "Shift+Del"),
    Action(
        "groups.as_cut",
        "Groups as the cut makes them",
        "Edit",
        "Take back every merge, split, move and marker left out.",
        _as_cut,
        why_not=first(needs_groups, _as_cut_already),
    ),
)
