"""Marker trajectories: the one input every stage starts from."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from markerscope.solver.core.errors import InputError

UpAxis = Literal["x", "y", "z"]

_R_LAB_INTERNAL = {
    "z": np.eye(3),
    # A y-up file shows the internal point (x, y, z) as (x, z, -y).
    "y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "x": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
}


def lab_rotation(up: UpAxis) -> np.ndarray:
    """``R_lab_internal`` (3, 3) of a file whose vertical axis is ``up``."""
    return _R_LAB_INTERNAL[up].copy()


@dataclass(frozen=True)
class Markers:
    """Trajectories of one subject's markers.

    Attributes
    ----------
    positions : (T, M, 3) m, internal lab frame, z up, NaN = lost
    rate : frames a second, Hz
    labels : M names as the file has them (unique; may mean nothing)
    first_time : s, time of the first frame in the marker file's own clock
    R_lab_internal : (3, 3), turns an internal vector into the file's axes
    filled : (T, M) True where a position was interpolated or modelled, not measured
    source : path of the file
    notes : what was assumed or left out while reading, one sentence each
    """

    positions: np.ndarray
    rate: float
    labels: tuple[str, ...]
    first_time: float = 0.0
    R_lab_internal: np.ndarray = field(default_factory=lambda: np.eye(3))
    filled: np.ndarray | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    @property
    def time(self) -> np.ndarray:
        """(T,) s in the marker file's clock."""
        return self.first_time + np.arange(len(self.positions)) / self.rate

    @property
    def present(self) -> np.ndarray:
        """(T, M) True where the marker was seen."""
        return np.isfinite(self.positions).all(axis=2)

    def select(self, frames: slice = slice(None), markers: np.ndarray | slice = slice(None)) -> Markers:
        """The same trajectories restricted to a range of frames and some markers."""
        labels = tuple(np.asarray(self.labels, dtype=object)[markers])
        start = frames.indices(len(self.positions))[0]
        return replace(
            self,
            positions=self.positions[frames][:, markers],
            labels=labels,
            first_time=self.first_time + start / self.rate,
            filled=None if self.filled is None else self.filled[frames][:, markers],
        )

    def between(self, start: float | None, stop: float | None) -> Markers:
        """The frames from ``start`` to ``stop`` s in the file's clock; None leaves that end open."""
        if start is None and stop is None:
            return self
        inside = np.ones(len(self.positions), bool)
        slack = 1e-6 / self.rate
        if start is not None:
            inside &= self.time >= start - slack
        if stop is not None:
            inside &= self.time <= stop + slack
        frames = np.flatnonzero(inside)
        if not len(frames):
            raise InputError(
                "no frame lies in the range asked for; the recording runs "
                f"from {self.time[0]:g} s to {self.time[-1]:g} s",
                self.source,
                "choose a range inside it",
            )
        return self.select(slice(int(frames[0]), int(frames[-1]) + 1))
