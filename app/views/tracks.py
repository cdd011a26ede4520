"""What there is of every marker in every frame: measured, filled, taken out, or lost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.core.markers import Markers
from markerscope.solver.fit.results import FittedMotion

if TYPE_CHECKING:
    from markerscope.solver.cleaning.clean import Cut

MEASURED, FILLED, OUTLIER, LOST = range(4)
STATE_NAMES = ("measured", "filled", "outlier taken out", "lost")
"""What each state of a sample is called."""


@dataclass(frozen=True, eq=False)
class MarkerTracks:
    """Trajectories to be drawn; the large arrays are the results' own, not copies.

    Attributes
    ----------
    markers : as the solve sees them
    state : (T, M) uint8, one of MEASURED, FILLED, OUTLIER, LOST
    placed : (T, M, 3) m, where a fit puts the markers, to stand in where they are lost; None without a fit
    """

    markers: Markers
    state: np.ndarray
    placed: np.ndarray | None = None

    def seen(self, frame: int) -> np.ndarray:
        """(M, 3) m, what is known of each marker in a frame; NaN where lost."""
        return self.markers.positions[frame]

    def complete(self, frame: int) -> np.ndarray:
        """(M, 3) m, the same with the fit's places where markers are lost."""
        here = self.markers.positions[frame]
        if self.placed is None:
            return here
        return np.where(np.isfinite(here).all(axis=1)[:, None], here, self.placed[frame])

    def time(self, frame: int) -> float:
        """Time of a frame, s of the marker clock."""
        return self.markers.first_time + frame / self.markers.rate

    def nearest(self, time: float) -> int:
        """The frame nearest to a time of the marker clock, s; the first or last beyond the ends."""
        frame = round((time - self.markers.first_time) * self.markers.rate)
        return min(max(frame, 0), len(self.markers.positions) - 1)

    def at(self, time: float) -> np.ndarray:
        """(M, 3) m between two frames, s of the marker clock; NaN where either is lost, or beyond the ends."""
        place = (time - self.markers.first_time) * self.markers.rate
        last = len(self.markers.positions) - 1
        if not -1e-6 <= place <= last + 1e-6:
            return np.full(self.markers.positions.shape[1:], np.nan)
        left = min(max(int(place), 0), max(last - 1, 0))
        share = min(max(place - left, 0.0), 1.0)
        if share < 1e-6 or last == 0:
            return self.markers.positions[left].copy()
        if share > 1 - 1e-6:
            return self.markers.positions[left + 1].copy()
        return (1 - share) * self.markers.positions[left] + share * self.markers.positions[left + 1]


def tracks_of(markers: Markers, motion: FittedMotion | None = None, cut: Cut | None = None) -> MarkerTracks:
    """The markers of a solve with the state of every sample.

    Parameters
    ----------
    markers : after cleaning, where there was any
    motion : a fit of the same frames, to stand in where markers are lost
    cut : what cleaning took out; what the file itself had filled there was no measurement
    """
    present = _present(markers)
    state = np.where(present, np.uint8(MEASURED), np.uint8(LOST))
    if markers.filled is not None:
        state[markers.filled & present] = FILLED
    if cut is not None:
        own = ~cut.filled
        state[cut.frame[own], cut.marker[own]] = OUTLIER
    return MarkerTracks(markers, state, None if motion is None else motion.placed)


def _present(markers: Markers) -> np.ndarray:
    """(T, M) ``Markers.present``, several times as fast over a long recording."""
    x, y, z = np.moveaxis(markers.positions, 2, 0)
    return np.isfinite(x) & np.isfinite(y) & np.isfinite(z)


def pooled(states: np.ndarray, most: int) -> np.ndarray:
    """(n, M) uint8 with n <= most: the frames (T, M) in even bins, each with the worst state in it.

    A strip a thousand pixels wide must show a gap of one frame in sixty thousand.
    """
    count = len(states)
    if count <= most:
        return states
    starts = np.arange(most) * count // most
    worst: np.ndarray = np.maximum.reduceat(states, starts, axis=0)
    return worst
