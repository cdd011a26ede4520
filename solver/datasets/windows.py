"""A recording brought to 30 Hz and cut into windows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.core.markers import Markers
from markerscope.solver.core.metrics import points_at
from markerscope.solver.datasets.recording import RATE

_SLACK = 1e-6


def from_zero(markers: Markers) -> Markers:
    """The recording on a clock that starts with it, without the frames at its end in which nothing was seen."""
    seen = np.flatnonzero(markers.present.any(axis=1))
    stop = int(seen[-1]) + 1 if len(seen) else 0
    return replace(markers.select(slice(0, stop)), first_time=0.0)


def starts(length_s: float, window_s: float, padding_s: float) -> tuple[float, ...]:
    """Start of each window, s: as many as fit one behind the other between the paddings at both ends."""
    count = int((length_s - 2 * padding_s + _SLACK) // window_s)
    return tuple(padding_s + i * window_s for i in range(max(count, 0)))


def cut(markers: Markers, start: float, window_s: float) -> Markers:
    """The window at 30 Hz, linear between the recording's frames; a marker lost in either of two is lost between.

    Parameters
    ----------
    markers : on a clock that starts with them
    start : s
    """
    time = start + np.arange(round(window_s * RATE)) / RATE
    frame = time * markers.rate
    nearest = np.round(frame)
    # a rounding error must not ask for the neighbour of a frame that is met exactly
    time = np.where(np.abs(frame - nearest) < 1e-6, nearest / markers.rate, time)
    return replace(
        markers,
        positions=points_at(markers.time, markers.positions, time),
        rate=RATE,
        first_time=start,
        filled=None,
    )
