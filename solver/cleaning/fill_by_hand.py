"""Gaps that the user asked to be filled: by a method, or by places that a fitted body had for the marker."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.cleaning.fill.one import fill_gap, gaps_in
from markerscope.solver.cleaning.gaps import Fill, confidence_of
from markerscope.solver.cleaning.request import Method
from markerscope.solver.core.markers import Markers

Part = tuple[Fill, np.ndarray]


@dataclass(frozen=True)
class PlacedFill:
    """Places of a marker in frames in which it was lost; they stay what they are when the body is fitted again.

    Attributes
    ----------
    marker : index
    first : frame of the first place, from 0
    places : m, internal lab frame, one a frame
    error : m, distance from the truth to be expected on average; infinite where that is not known
    """

    marker: int
    first: int
    places: tuple[tuple[float, float, float], ...]
    error: float = float("inf")

    @property
    def last(self) -> int:
        """Frame of the last place."""
        return self.first + len(self.places) - 1


def parts_by_hand(
    markers: Markers, fills: Iterable[tuple[int, int, int, Method]], placed: Iterable[PlacedFill]
) -> tuple[list[Part], tuple[str, ...]]:
    """Every fill that was asked for and can be made, and a sentence for each that cannot.

    Parameters
    ----------
    markers : outliers cut, nothing filled
    fills : (marker, first, last, method): the whole gaps of the marker that these frames touch
    placed : where samples of them are there by now, these count
    """
    from markerscope.solver.cleaning.fill import METHODS

    parts: dict[tuple[int, int], Part] = {}
    notes: list[str] = []
    for marker, first, last, method in fills:
        for gap in gaps_in(markers.positions, marker, first, last):
            made = fill_gap(markers.positions, markers.rate, gap, METHODS[method])
            if made is None:
                said = f"frames {gap.first} to {gap.last} cannot be filled by {method} there, and stay lost"
                notes.append(f"{markers.labels[marker]}: {said}.")
            else:
                parts[marker, gap.first] = made[0], made[1]
    for given in placed:
        span = np.arange(given.first, min(given.last + 1, len(markers.positions)))
        lost = ~np.isfinite(markers.positions[span, given.marker]).all(axis=1)
        values = np.array(given.places, dtype=float).reshape(-1, 3)[: len(span)]
        for stretch in np.split(np.flatnonzero(lost), np.flatnonzero(np.diff(np.flatnonzero(lost)) > 1) + 1):
            if len(stretch):
                first, last = int(span[stretch[0]]), int(span[stretch[-1]])
                parts[given.marker, first] = (
                    Fill(given.marker, first, last, "body", 0.0, given.error),
                    values[stretch],
                )
    made_by_hand = [
        (replace(f, by_hand=True, confidence=confidence_of(f.error)), values) for f, values in parts.values()
    ]
    return made_by_hand, tuple(notes)


def put_in(
    positions: np.ndarray, fills: tuple[Fill, ...], parts: Iterable[Part]
) -> tuple[np.ndarray, tuple[Fill, ...]]:
    """Positions (T, M, 3) m and fills with those by hand in the place of others that overlap them."""
    positions, kept = positions.copy(), list(fills)
    for fill, values in parts:
        kept = [f for f in kept if f.marker != fill.marker or f.last < fill.first or f.first > fill.last] + [fill]
        positions[fill.first : fill.last + 1, fill.marker] = values
    return positions, tuple(sorted(kept, key=lambda f: (f.marker, f.first)))
