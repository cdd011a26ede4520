"""Named trajectories put in order: one a name, breaks joined and exchanges mended; what is nobody's stays."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.optimize import linear_sum_assignment

from markerscope.solver.core.markers import Markers
from markerscope.solver.markerset.label import Labelled

CERTAIN = 0.95
"""A name of less probability changes no trajectory: the change is proposed."""


@dataclass(frozen=True)
class Stretch:
    """Some frames of a trajectory that hold one marker.

    Attributes
    ----------
    trajectory : its number in the file, from 0
    first, last : frames from 0, both inclusive
    name : of the set, empty where it is nobody's
    probability : that the name is right; NaN where there is none
    what : ``named`` in its own trajectory, ``joined`` from another one into it, ``exchanged`` with another,
        ``proposed`` where the name is not sure enough to move it, ``unlabelled``
    into : number of the trajectory that holds it now
    """

    trajectory: int
    first: int
    last: int
    name: str
    probability: float
    what: Literal["named", "joined", "exchanged", "proposed", "unlabelled"]
    into: int


@dataclass(frozen=True, eq=False)
class Ordered:
    """The trajectories in order.

    Attributes
    ----------
    markers : one trajectory a name; the others as they came; those that were made for what had no place come last
    stretches : everything that was seen, by trajectory and frame
    added : how many trajectories were made
    emptied : numbers of those that hold nothing any more
    """

    markers: Markers
    stretches: tuple[Stretch, ...]
    added: int
    emptied: tuple[int, ...]


def in_order(markers: Markers, labelled: Labelled) -> Ordered:
    """One trajectory for each name that was found."""
    positions, count = markers.positions, markers.positions.shape[1]
    runs = _runs(labelled, markers.present)
    home = _homes(labelled, count, runs)
    sure, moved, kept = [], [], []
    for run in runs:
        column, _, _, name, probability = run
        at_home = name >= 0 and home.get(name) == column
        if name >= 0 and (at_home or probability >= CERTAIN) and name in home:
            sure.append(run)
        else:
            kept.append(run)
    names = list(markers.labels)
    owner = {column: name for name, column in home.items()}
    present = np.asarray(markers.present)
    width = count
    out = np.full((len(positions), count + len(kept), 3), np.nan)
    filled = None if markers.filled is None else np.zeros(out.shape[:2], bool)
    busy = np.zeros(out.shape[:2], bool)
    stretches: list[Stretch] = []

    def put(run: tuple[int, int, int, int, float], into: int, what: str) -> None:
        column, first, last, name, probability = run
        span = slice(first, last + 1)
        there = present[span, column]
        out[span, into][there] = positions[span, column][there]
        busy[span, into] |= there
        if filled is not None and markers.filled is not None:
            filled[span, into] |= markers.filled[span, column] & there
        text = labelled.names[name] if name >= 0 else ""
        stretches.append(Stretch(column, first, last, text, probability, what, into))  # type: ignore[arg-type]

    # Of two samples of one name in one frame the one in its own trajectory stays.
    for run in sorted(sure, key=lambda one: home[one[3]] == one[0]):
        column, first, last, name, _ = run
        into = home[name]
        if into == column:
            put(run, into, "named")
        else:
            other = labelled.name[first : last + 1, into]
            exchanged = bool(((other >= 0) & (other != name)).any())
            moved.append(run)
            put(run, into, "exchanged" if exchanged else "joined")
    for run in kept:
        column, first, last, name, _ = run
        span = slice(first, last + 1)
        there = present[span, column]
        what = "unlabelled" if name < 0 else "proposed"
        free = lambda c: not busy[span, c][there].any()  # noqa: E731,B023
        if column not in owner and free(column):
            put(run, column, what)
            continue
        # Its trajectory is a name's now: it goes to one that is nobody's, or to a new one.
        spare = next((c for c in range(count, width) if free(c)), None)
        if spare is None:
            spare = next((c for c in range(count) if c not in owner and free(c)), width)
        if spare == width:
            width += 1
            names.append(markers.labels[column])
        put(run, spare, what)
    labels = _labels(names[:width], owner, labelled.names)
    was = np.atleast_1d(present.any(axis=0))
    emptied = tuple(int(c) for c in range(count) if was[c] and not busy[:, c].any())
    ordered = replace(
        markers, positions=out[:, :width], labels=labels, filled=None if filled is None else filled[:, :width]
    )
    stretches.sort(key=lambda one: (one.trajectory, one.first))
    return Ordered(ordered, tuple(stretches), width - count, emptied)


def _runs(labelled: Labelled, present: np.ndarray) -> list[tuple[int, int, int, int, float]]:
    """Trajectory, first and last frame, name and probability of all that was seen; gaps within one name do not part."""
    runs = []
    for column in range(present.shape[1]):
        seen = np.flatnonzero(present[:, column])
        if not len(seen):
            continue
        name = labelled.name[seen, column]
        sure = np.round(np.nan_to_num(labelled.probability[seen, column], nan=-1.0), 6)
        change = np.flatnonzero((name[1:] != name[:-1]) | (sure[1:] != sure[:-1])) + 1
        for part in np.split(np.arange(len(seen)), change):
            probability = float(labelled.probability[seen[part[0]], column])
            runs.append((column, int(seen[part[0]]), int(seen[part[-1]]), int(name[part[0]]), probability))
    return runs


def _homes(labelled: Labelled, count: int, runs: list[tuple[int, int, int, int, float]]) -> dict[int, int]:
    """Name -> the trajectory that holds most of it, one to one."""
    held = np.zeros((len(labelled.names), count))
    for column, first, last, name, _ in runs:
        if name >= 0:
            held[name, column] += last - first + 1
    found = np.flatnonzero(held.any(axis=1))
    rows, columns = linear_sum_assignment(-held[found])
    return {int(found[r]): int(c) for r, c in zip(rows, columns) if held[found[r], c] > 0}


def _labels(names: list[str], owner: dict[int, int], of_set: tuple[str, ...]) -> tuple[str, ...]:
    """The set's names for their trajectories, the file's own for others, unless the set means somebody else by it."""
    taken = {of_set[name] for name in owner.values()}
    out: list[str] = []
    for column, own in enumerate(names):
        if column in owner:
            out.append(of_set[owner[column]])
            continue
        text = f"unlabelled_{own}" if own in of_set or own in taken else own
        again = 2
        free = text
        while free in taken:
            free, again = f"{text}_{again}", again + 1
        taken.add(free)
        out.append(free)
    return tuple(out)


def contradictions(markers: Markers, labelled: Labelled) -> tuple[str, ...]:
    """What the file's own names and the set's disagree about, one sentence each: two of them exchanged, or one that
    means another place.
    """
    known = {name: u for u, name in enumerate(labelled.names)}
    means: dict[str, str] = {}
    for column, own in enumerate(markers.labels):
        name = labelled.name[:, column]
        seen = name >= 0
        if own not in known or not seen.any():
            continue
        most = int(np.bincount(name[seen]).argmax())
        sure = labelled.probability[name == most, column] if (name == most).any() else np.zeros(1)
        long = (name == most).sum() > 0.8 * markers.present[:, column].sum()
        if most != known[own] and long and np.nanmedian(sure) >= CERTAIN:
            means[own] = labelled.names[most]
    said, done = [], set()
    for own, other in means.items():
        if own in done:
            continue
        if means.get(other) == own:
            done |= {own, other}
            said.append(f"The file and the marker set have {own} and {other} exchanged.")
        else:
            said.append(f"What the file calls {own} lies where the marker set has {other}.")
    return tuple(said)
