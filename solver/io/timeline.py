"""From the time stamps of a table's rows to an even frame grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MOST_STRETCH = 20  # rows may be missing, but a grid 20 times the rows comes from a damaged time column


@dataclass(frozen=True)
class Timeline:
    """Where each row belongs on an even grid.

    Attributes
    ----------
    index : (rows,) frame of each row, rising from 0
    rate : Hz, None where it cannot be told
    first_time : s, None where there is no time column
    notes : what was found, one sentence each
    """

    index: np.ndarray
    rate: float | None
    first_time: float | None
    notes: tuple[str, ...] = ()

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Rows (rows, ...) laid out on the grid (T, ...); frames without a row are NaN (False for flags)."""
        if len(self.index) == 0 or self.index[-1] == len(values) - 1:
            return values
        shape = (int(self.index[-1]) + 1, *values.shape[1:])
        grid = np.zeros(shape, dtype=bool) if values.dtype == bool else np.full(shape, np.nan)
        grid[self.index] = values
        return grid


def even_grid(time: np.ndarray | None, frame: np.ndarray | None, declared: float | None) -> Timeline:
    """Find rate, start and missing rows from a time column, a frame column and a declared rate, each optional.

    Parameters
    ----------
    time : (rows,) s
    frame : (rows,) frame numbers
    declared : Hz
    """
    declared = declared if declared is not None and np.isfinite(declared) and declared > 0 else None
    if time is not None and len(time) > 1 and np.isfinite(time).all() and 0 < np.ptp(time) < 1e12:
        return _from_time(time, declared)
    first = float(time[0]) if time is not None and len(time) and np.isfinite(time[0]) else None
    rows = len(time) if time is not None else len(frame) if frame is not None else 0
    if frame is not None and len(frame) > 1 and np.isfinite(frame).all():
        steps = np.diff(frame)
        stride = np.median(steps)
        if stride >= 1 and (steps >= 1).all() and np.allclose(steps, np.round(steps)):
            return _gridded(np.round(steps / stride), declared, first, ())
    return Timeline(np.arange(rows), declared, first)


def _from_time(time: np.ndarray, declared: float | None) -> Timeline:
    gaps = np.diff(time)
    usual = float(np.quantile(gaps, 0.25, method="lower"))  # the step from a row to the very next
    if (gaps < 0).any():
        note = "The time column runs backwards and was ignored."
        return Timeline(np.arange(len(time)), declared, float(time[0]), (note,))
    notes: tuple[str, ...] = ()
    # A rounded time column (0.01, 0.02, 0.03 at 120 Hz) says the rate badly step by step, but well as a whole.
    coarse = float((len(time) - 1) / (time[-1] - time[0]))
    if (gaps == 0).any():
        return Timeline(np.arange(len(time)), declared or coarse, float(time[0]))
    likely = declared is not None and (abs(declared * usual - 1) < 0.3 or abs(declared / coarse - 1) < 0.05)
    guess = declared if declared is not None and likely else 1 / usual
    steps = np.maximum(np.round(gaps * guess), 1)
    measured = float(steps.sum() / (time[-1] - time[0]))
    tolerance = 5e-4 + 2 * _resolution(time) / (time[-1] - time[0])
    whole = float(np.round(measured))
    rate = whole if whole and abs(measured / whole - 1) <= tolerance else measured
    if declared is not None and abs(measured / declared - 1) <= tolerance:
        rate = declared
    elif declared is not None:
        notes = (f"The header says {declared:g} Hz but the time column {rate:g} Hz, which was taken.",)
    if np.abs(gaps * rate - steps).max() > 0.5:
        notes += ("The time steps are uneven; the frames were taken as evenly spaced.",)
    return _gridded(steps, rate, float(time[0]), notes)


def _gridded(steps: np.ndarray, rate: float | None, first: float | None, notes: tuple[str, ...]) -> Timeline:
    rows = len(steps) + 1
    if steps.sum() > _MOST_STRETCH * rows:
        return Timeline(np.arange(rows), rate, first, (*notes, "Jumps in the time or frame column were ignored."))
    index = np.concatenate([[0], np.cumsum(steps)]).astype(int)
    missing = int(index[-1]) + 1 - rows
    if missing:
        notes += (f"{missing} frames have no row in the file and count as lost.",)
    return Timeline(index, rate, first, notes)


def _resolution(time: np.ndarray) -> float:
    """Rounding step of a column, s: the power of ten that all its values are multiples of."""
    for decimals in range(7):
        scaled = time * 10.0**decimals
        if np.abs(scaled - np.round(scaled)).max() < 1e-5:
            return float(10.0**-decimals)
    return 0.0
