"""Hand edits of the groups of markers: the cut, and merge, split, move, leave out.

The solver applies edits kind by kind (merges, splits, moves, left out), the user makes them one after the other. So
each edit here is checked against what the user means: the groups as they are now, with this one change. Where the
solver's order would make something else of it, the groups are written down as splits, which say the same in any order.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from markerscope.app.models.edits import Edit, decide
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings, edited, regroup
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session

BY_HAND = ("merges", "splits", "moves", "left_out")


def cut_at(session: Session, height: float) -> Edit:
    """Cut the tree at a height, m."""
    after = decide(session, "segment", {"threshold": float(height), "groups": None})
    return Edit(f"Groups cut at {1000 * height:.1f} mm", after, "cut")


def cut_into(session: Session, groups: int) -> Edit:
    """Cut the tree into so many groups."""
    return Edit(f"Cut into {groups} groups", decide(session, "segment", {"groups": int(groups)}), "cut")


def merge(session: Session, found: Segmentation, markers: Collection[int], labels: Sequence[str]) -> Edit:
    """Make one group of the groups of these markers."""
    settings, groups = _now(session), found.clusters.copy()
    touched = sorted({int(groups[m]) for m in markers} - {-1})
    if len(touched) < 2:
        raise InputError("the markers are of one group already", "merge", "select markers of two groups or more")
    groups[np.isin(groups, touched)] = touched[0]
    names = _names(markers, labels)
    return _edit(
        session,
        found,
        replace(settings, merges=(*settings.merges, _sorted(markers))),
        groups,
        f"Groups of {names} merged",
    )


def split(session: Session, found: Segmentation, markers: Collection[int], labels: Sequence[str]) -> Edit:
    """Take these markers out of their groups, into one of their own."""
    settings, groups = _now(session), found.clusters.copy()
    seen = [m for m in _sorted(markers) if groups[m] >= 0]
    if not seen:
        raise InputError("the markers are in no group", "split", "select markers of a group")
    if len({int(groups[m]) for m in seen}) == 1 and set(np.flatnonzero(groups == groups[seen[0]])) == set(seen):
        raise InputError("the markers are a group of their own already", "split", "select a part of a group")
    groups[seen] = groups.max() + 1
    after = replace(settings, splits=(*settings.splits, tuple(seen)))
    return _edit(session, found, after, groups, f"{_names(seen, labels)} split off")


def move(session: Session, found: Segmentation, markers: Collection[int], host: int, labels: Sequence[str]) -> Edit:
    """Put these markers into the group of another."""
    settings, groups = _now(session), found.clusters.copy()
    if groups[host] < 0:
        raise InputError(f"{labels[host]} is in no group", "move", "choose a marker of a group")
    moved = [m for m in _sorted(markers) if groups[m] != groups[host] and groups[m] >= 0]
    if not moved:
        raise InputError("the markers are in that group already", "move", "choose a marker of another group")
    groups[moved] = groups[host]
    after = replace(settings, moves=(*settings.moves, *((m, int(host)) for m in moved)))
    return _edit(session, found, after, groups, f"{_names(moved, labels)} moved to the group of {labels[host]}")


def leave_out(session: Session, found: Segmentation, markers: Collection[int], labels: Sequence[str]) -> Edit:
    """Let these markers belong to no group, and have no part in the solve."""
    settings, groups = _now(session), found.clusters.copy()
    new = sorted(set(_sorted(markers)) - set(settings.left_out))
    if not new:
        raise InputError("the markers are left out already", "leave out", "select others")
    groups[new] = -1
    after = replace(settings, left_out=_sorted({*settings.left_out, *new}))
    return _edit(session, found, after, groups, f"{_names(new, labels)} left out")


def take_in(session: Session, markers: Collection[int], labels: Sequence[str]) -> Edit:
    """Have markers that were left out back."""
    settings = _now(session)
    back = sorted(set(_sorted(markers)) & set(settings.left_out))
    if not back:
        raise InputError("the markers are not left out", "take in", "select markers that are")
    table = {"left_out": _listed(sorted(set(settings.left_out) - set(back)))}
    return Edit(f"{_names(back, labels)} taken in again", decide(session, "segment", table))


def undo_all(session: Session) -> Edit:
    """Leave the groups as the cut makes them."""
    return Edit("Groups as the cut makes them", decide(session, "segment", {name: [] for name in BY_HAND}))


def _edit(session: Session, found: Segmentation, natural: SegmentSettings, wanted: np.ndarray, sentence: str) -> Edit:
    """The edit that makes the wanted groups (M,), written as the user made it if that is what it makes."""
    base = regroup(found, replace(natural, merges=(), splits=(), moves=(), left_out=())).clusters
    if not _same(edited(base, natural, found.order), wanted):
        natural = replace(natural, merges=(), splits=_as_splits(base, wanted), moves=())
        if not _same(edited(base, natural, found.order), wanted):
            raise InputError("the groups shown are not the settings' any more", "this edit", "run Segmentation first")
    table: dict[str, Any] = {name: _listed(getattr(natural, name)) for name in BY_HAND}
    return Edit(sentence, decide(session, "segment", table))


def _as_splits(base: np.ndarray, wanted: np.ndarray) -> tuple[tuple[int, ...], ...]:
    """The wanted groups that the cut does not make, each as a split."""
    made = {frozenset(np.flatnonzero(base == k).tolist()) for k in set(base.tolist())}
    groups = [np.flatnonzero(wanted == k).tolist() for k in sorted(set(wanted.tolist()) - {-1})]
    return tuple(tuple(group) for group in groups if frozenset(group) not in made)


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two labellings (M,) make the same groups."""
    if not np.array_equal(a < 0, b < 0):
        return False
    pairs = set(zip(a.tolist(), b.tolist()))
    return len(pairs) == len({x for x, _ in pairs}) == len({y for _, y in pairs})


def _now(session: Session) -> SegmentSettings:
    settings = session.stage_settings(graph_of(session))["segment"]
    return SegmentSettings(**{field.name: getattr(settings, field.name) for field in fields(SegmentSettings)})


def _sorted(markers: Collection[int]) -> tuple[int, ...]:
    return tuple(sorted(int(m) for m in markers))


def _listed(value: Any) -> Any:
    """Tuples as lists, as the session file has them."""
    return [_listed(item) for item in value] if isinstance(value, list | tuple) else int(value)


def _names(markers: Collection[int], labels: Sequence[str]) -> str:
    """The markers by name, a few of them."""
    named = [labels[m] for m in sorted(markers)]
    return " and ".join(named) if len(named) < 3 else f"{', '.join(named[:2])} and {len(named) - 2} more"
