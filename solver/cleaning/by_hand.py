"""Hand edits of trajectories: samples taken out, trajectories cut in two, exchanged, joined; nothing is lost by it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.core.markers import Markers

NOWHERE = -1
"""As a source: the trajectory shows no sample of the file in that frame."""


@dataclass(frozen=True)
class TrackEdits:
    """What was decided about trajectories; frames count from 0, both ends inclusive.

    The first two name trajectories as the file has them: the same samples are meant whatever is exchanged later.

    Attributes
    ----------
    deletes : (marker, first, last), samples taken out
    cuts : (marker, first, last, number), samples that go to a new trajectory; numbers follow those of the file
    swaps : (marker, marker, frame), trajectories exchanged from that frame on
    joins : (marker, other, first, last), samples of the other given to the marker
    """

    deletes: tuple[tuple[int, int, int], ...] = ()
    cuts: tuple[tuple[int, int, int, int], ...] = ()
    swaps: tuple[tuple[int, int, int], ...] = ()
    joins: tuple[tuple[int, int, int, int], ...] = ()

    def __bool__(self) -> bool:
        """Whether anything is edited."""
        return bool(self.deletes or self.cuts or self.swaps or self.joins)

    def count(self, columns: int) -> int:
        """How many trajectories there are afterwards, of a file with ``columns`` of them."""
        return max([columns - 1, *(number for *_, number in self.cuts)]) + 1


def sources(edits: TrackEdits, frames: int, columns: int) -> np.ndarray:
    """(T, M') int, which of the file's M trajectories each one shows in each frame, ``NOWHERE`` for none.

    Parameters
    ----------
    frames, columns : T and M of the file
    """
    count = edits.count(columns)
    goes_to = np.tile(np.arange(columns, dtype=np.int32), (frames, 1))
    for marker, first, last, number in edits.cuts:
        goes_to[first : last + 1, marker] = number
    for marker, first, last in edits.deletes:
        goes_to[first : last + 1, marker] = NOWHERE
    found = np.full((frames, count), NOWHERE, dtype=np.int32)
    kept, column = np.nonzero(goes_to != NOWHERE)
    found[kept, goes_to[kept, column]] = column
    moves = [(first, "swap", a, b, frames - 1) for a, b, first in edits.swaps]
    moves += [(first, "join", a, b, last) for a, b, first, last in edits.joins]
    for first, kind, a, b, last in sorted(moves, key=lambda move: move[0]):
        span = slice(first, last + 1)
        if kind == "swap":
            found[span, [a, b]] = found[span, [b, a]]
        else:
            found[span, a] = found[span, b]
            found[span, b] = NOWHERE
    return found


def edited(markers: Markers, edits: TrackEdits) -> Markers:
    """The trajectories after hand edits; new ones are named after what they were cut from."""
    if not edits:
        return markers
    frames, columns = markers.positions.shape[:2]
    found = sources(edits, frames, columns)
    count = found.shape[1]
    positions = np.full((frames, count, 3), np.nan)
    filled = np.zeros((frames, count), dtype=bool)
    for column in range(count):
        shown = found[:, column]
        if column < columns and (shown == column).all():
            positions[:, column] = markers.positions[:, column]
            filled[:, column] = False if markers.filled is None else markers.filled[:, column]
            continue
        frame = np.flatnonzero(shown != NOWHERE)
        positions[frame, column] = markers.positions[frame, shown[frame]]
        filled[frame, column] = False if markers.filled is None else markers.filled[frame, shown[frame]]
    names = list(markers.labels)
    for number in range(columns, count):
        source = next((marker for marker, *_, to in edits.cuts if to == number), number)
        names.append(_new_name(names[source] if source < len(names) else f"{number}", names))
    return replace(markers, positions=positions, labels=tuple(names), filled=None if markers.filled is None else filled)


def _new_name(name: str, taken: list[str]) -> str:
    number = 2
    while f"{name}_{number}" in taken:
        number += 1
    return f"{name}_{number}"
