"""Which markers are pinned to landmarks and which pairs are refused, by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from markerscope.solver.core.errors import InputError

Pair = tuple[int, str]
"""A marker by its column and a landmark by its name; "" means every landmark where it is refused."""


def check_pairs(pinned: Sequence[Pair], refused: Sequence[Pair]) -> None:
    """Refuse decisions that contradict each other.

    Raises
    ------
    InputError : a marker is pinned to two landmarks, a landmark to two markers, or a pair is pinned and refused
    """
    for said in ([f"marker {m}" for m, _ in pinned], [f"landmark {name}" for _, name in pinned]):
        twice = [what for what in said if said.count(what) > 1]
        if twice:
            raise InputError(f"{twice[0]} is pinned twice", "pinned landmarks", "take one of the two out")
    both = [pair for pair in pinned if pair in refused or (pair[0], "") in refused]
    if both:
        raise InputError(
            f"marker {both[0][0]} is pinned to {both[0][1]} and refused there", "pinned landmarks", "take one out"
        )


def decided(
    pinned: Sequence[Pair], refused: Sequence[Pair], names: Sequence[str], used: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Two arrays (U, L): True where a pair is pinned, and where it may be.

    Parameters
    ----------
    names : L landmarks
    used : (U,) columns of the markers that the fit uses; decisions about others count for nothing
    count : of all markers

    Raises
    ------
    InputError : there is no such landmark or marker
    """
    fixed, allowed = np.zeros((len(used), len(names)), dtype=bool), np.ones((len(used), len(names)), dtype=bool)
    for pairs, where in ((pinned, "a pinned landmark"), (refused, "a refused landmark")):
        for marker, name in pairs:
            if name not in names and (name or pairs is pinned):
                raise InputError(f'there is no landmark "{name}"', where, f"use one of: {', '.join(names)}")
            if not 0 <= marker < count:
                raise InputError(f"there is no marker {marker}", where, f"use 0 to {count - 1}")
    row = {int(m): i for i, m in enumerate(used)}
    for marker, name in refused:
        if marker in row:
            allowed[row[marker], [names.index(name)] if name else slice(None)] = False
    for marker, name in pinned:
        if marker in row:
            fixed[row[marker], names.index(name)] = True
    allowed[fixed.any(axis=1)] = False
    allowed[:, fixed.any(axis=0)] = False
    return fixed, allowed | fixed
