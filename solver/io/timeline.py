"""From the time stamps of a table's rows to an even frame grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

_MOST_STRETCH = 20  # rows may be missing, but a grid 20 times the rows comes from a damaged time column
_CLEAN = 0.35  # steps that a gap between stamps may be off a whole number for missing rows to be told gap by gap
_JITTER = 0.75  # steps that a stamp may be off an even grid and still belong to its place
_USUAL_HZ = 5.0, 2000.0
_TYPICAL_HZ = 100.0
_UNITS = ((1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds"))
_LONG_UNITS = ((60.0, "minutes"), (3600.0, "hours"), (86400.0, "days"))
_A_DATE_S = 1e6  # no recording is so long: the clock counts from a date


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


def even_grid(
    time: np.ndarray | None, frame: np.ndarray | None, declared: float | None, *, unit_known: bool = False
) -> Timeline:
    """Find rate, start and missing rows from a time column, a frame column and a declared rate, each optional.

    They are held against each other: stamps that jitter make no frames where frame numbers, the declared rate or an
    even spacing of the rows explain them, and what disagrees is said.

    Parameters
    ----------
    time : (rows,) s, or in a unit that nobody named
    frame : (rows,) frame numbers
    declared : Hz
    unit_known : whether the file says that time is in seconds (or in what it was turned into seconds from)
    """
    declared = declared if declared is not None and np.isfinite(declared) and declared > 0 else None
    rows = len(time) if time is not None else len(frame) if frame is not None else 0
    by_frame, notes = _frame_steps(frame)
    if time is None or rows < 2:
        first = float(time[0]) if time is not None and len(time) and np.isfinite(time[0]) else None
        return (
            _gridded(by_frame, declared, first, notes) if by_frame is not None else _even(rows, declared, first, notes)
        )
    problem = _problem(time)
    if problem is not None:
        first = float(time[0]) if np.isfinite(time[0]) and abs(time[0]) < 1e12 else None
        notes += (problem,) if problem else ()
        return (
            _gridded(by_frame, declared, first, notes) if by_frame is not None else _even(rows, declared, first, notes)
        )
    time, unit_notes = in_seconds(time, declared, unit_known=unit_known)
    notes += unit_notes
    if by_frame is not None:
        found = _by_frames(time, by_frame, declared)
        if found is not None:
            return _joined(found, notes)
        by_time = _from_time(time, declared)
        told = "The frame numbers and the time column disagree; {} was taken."
        if "uneven" in " ".join(by_time.notes):
            rate = declared or float(by_frame.sum() / (time[-1] - time[0]))
            notes += (told.format("the count of frames"),)
            return _gridded(by_frame, rate, float(time[0]), notes)
        return _joined(by_time, (*notes, told.format("the time column")))
    return _joined(_from_time(time, declared), notes)


def _joined(line: Timeline, notes: tuple[str, ...]) -> Timeline:
    return replace(line, notes=notes + line.notes)


def _even(rows: int, rate: float | None, first: float | None, notes: tuple[str, ...]) -> Timeline:
    return Timeline(np.arange(rows), rate, first, notes)


def _problem(time: np.ndarray) -> str | None:
    """Why a time column says nothing: blank where there is nothing to tell, None where it is sound."""
    if not np.isfinite(time).any():
        return ""
    if not np.isfinite(time).all():
        return "The time column has rows without a number and was ignored."
    gaps = np.diff(time)
    if (gaps < 0).any():
        return "The time column runs backwards and was ignored."
    if not (gaps > 0).any():
        return ""
    return None if np.ptp(time) < 1e25 and not np.isinf(1 / np.median(gaps[gaps > 0])) else ""


def _frame_steps(frame: np.ndarray | None) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """(rows - 1,) steps from frame to frame by their numbers; None where these are no count."""
    if frame is None or len(frame) < 2 or not np.isfinite(frame).any():
        return None, ()
    if not np.isfinite(frame).all():
        return None, ("The column of frame numbers has gaps and was ignored.",)
    steps = np.diff(frame)
    stride = float(np.quantile(steps, 0.25, method="lower"))
    if stride < 1 or not (steps >= 1).all() or not np.allclose(steps, np.round(steps)):
        return None, () if not steps.any() else ("The frame numbers do not rise by whole numbers and were ignored.",)
    return np.maximum(np.round(steps / stride), 1), ()


def in_seconds(
    time: np.ndarray, declared: float | None, *, unit_known: bool = False
) -> tuple[np.ndarray, tuple[str, ...]]:
    """Ascending times (rows,) in s, and what was assumed: a unit that makes the rate a possible one.

    Parameters
    ----------
    declared : Hz, where something else says the rate
    unit_known : whether the times are known to be in s; a clock that counts from a date starts at 0 all the same
    """
    gaps = np.diff(time)
    rate = float(1 / np.median(gaps[gaps > 0]))
    notes: tuple[str, ...] = ()
    strange = rate < 0.999 or rate > _USUAL_HZ[1] if declared is None else abs(rate / declared - 1) > 0.5
    if strange and not unit_known:
        units = _UNITS if rate < _USUAL_HZ[1] else _LONG_UNITS
        off, scale, name = min(
            (abs(np.log(rate / scale / (declared or _TYPICAL_HZ))), scale, name) for scale, name in units
        )
        if off < 0.3 if declared is not None else _USUAL_HZ[0] <= rate / scale <= _USUAL_HZ[1]:
            by = f"{np.median(gaps):.4g}"
            notes = (f"The time column names no unit and counts by {by}; it was taken for {name}.",)
            start = time[0] if abs(time[0]) * scale > _A_DATE_S else 0.0  # less rounding: a date in ns has 19 digits
            return _from_start((time - start) * scale, start * scale, notes)
    return _from_start(time, 0.0, notes)


def _from_start(time: np.ndarray, shift: float, notes: tuple[str, ...]) -> tuple[np.ndarray, tuple[str, ...]]:
    if shift == 0 and abs(time[0]) > _A_DATE_S:
        shift = float(time[0])
        time = time - shift
    if shift:
        notes += (f"The time column starts at {shift:.0f} s, as dates do; time is counted from the first row.",)
    return time, notes


def _by_frames(time: np.ndarray, steps: np.ndarray, declared: float | None) -> Timeline | None:
    """The grid of the frame numbers, where the stamps lie on it but for jitter."""
    index = np.concatenate([[0.0], np.cumsum(steps)])
    rate, off = _line(time, index)
    if np.abs(off).max() > 1 or not np.isfinite(rate):
        return None
    settled, notes = _settled_rate(rate, time, off, declared)
    return _gridded(steps, settled, float(time[0]) if _clean_start(off) else _start(time, index, settled), notes)


def _clean_start(off: np.ndarray) -> bool:
    """Whether the first stamp is as good as any; a jittering one is not what the clock is set by."""
    return bool(np.abs(off).max() < 0.05)


def _start(time: np.ndarray, index: np.ndarray, rate: float) -> float:
    """s, the first frame's time by all stamps together."""
    start = float(np.mean(time - index / rate))
    return 0.0 if abs(start * rate) < 0.25 else start


def _line(time: np.ndarray, index: np.ndarray) -> tuple[float, np.ndarray]:
    """Rate (Hz) of the straight line through stamps over frames, and how far each is off it, in steps."""
    t, i = time - time.mean(), index - index.mean()
    slope = float((i @ t) / (i @ i))
    return (1 / slope if slope > 0 else np.inf), (t - i * slope) / slope if slope > 0 else np.full(len(t), np.inf)


def _settled_rate(
    rate: float, time: np.ndarray, off: np.ndarray, declared: float | None
) -> tuple[float, tuple[str, ...]]:
    """The rate, rounded to a whole or the declared one within what the stamps can tell."""
    length = float(time[-1] - time[0])
    error = 6 * float(np.std(off)) / rate / length / np.sqrt(len(time) / 12)
    tolerance = 5e-4 + 2 * _resolution(time) / length + error
    if declared is not None and abs(rate / declared - 1) <= tolerance:
        return declared, ()
    whole = float(np.round(rate))
    rate = whole if whole and abs(rate / whole - 1) <= tolerance else rate
    notes: tuple[str, ...] = ()
    if declared is not None:
        notes = (f"The header says {declared:g} Hz but the time column {rate:g} Hz, which was taken.",)
    return rate, notes


def _from_time(time: np.ndarray, declared: float | None) -> Timeline:
    """By the stamps alone, and a declared rate."""
    rows, gaps = np.arange(len(time), dtype=float), np.diff(time)
    even_rate, even_off = _line(time, rows)
    usual = float(np.quantile(gaps, 0.25, method="lower"))  # the step from a row to the very next
    # A rounded time column (0.01, 0.02, 0.03 at 120 Hz) says the rate badly step by step, but well as a whole.
    coarse = float((len(time) - 1) / (time[-1] - time[0]))
    if usual <= 0 or (gaps == 0).any():
        return Timeline(np.arange(len(time)), declared or coarse, float(time[0]))
    rounding = _resolution(time)
    if (
        rounding * even_rate >= 0.3
        and np.abs(even_off).max() <= 0.55 * rounding * even_rate
        and _varied(gaps, rounding)
    ):
        settled, notes = _settled_rate(even_rate, time, even_off, declared)
        return _gridded(np.ones(len(gaps)), settled, float(time[0]), notes)
    likely = declared is not None and (abs(declared * usual - 1) < 0.3 or abs(declared / coarse - 1) < 0.05)
    guess = declared if declared is not None and likely else 1 / usual
    steps = np.maximum(np.round(gaps * guess), 1)
    if np.abs(gaps * guess - steps).max() <= _CLEAN:
        index = np.concatenate([[0.0], np.cumsum(steps)])
        rate, off = _line(time, index)
        if np.abs(off).max() <= 0.5:
            settled, notes = _settled_rate(rate, time, off, declared)
            return _gridded(steps, settled, float(time[0]), notes)
    return _uneven(time, declared)


def _varied(gaps: np.ndarray, rounding: float) -> bool:
    """Whether longer gaps come often enough to be the rounding's, not those of a few rows that are missing."""
    return int((gaps > gaps.min() + rounding / 2).sum()) >= 3


def _uneven(time: np.ndarray, declared: float | None) -> Timeline:
    """Stamps that jitter: rows in a row where an even spacing explains them, else missing where time has moved on."""
    rows = np.arange(len(time), dtype=float)
    rate, off = _line(time, rows)
    steps = np.ones(len(time) - 1)
    if np.abs(off).max() > _JITTER or (declared is not None and abs(rate / declared - 1) > 0.02):
        tracked = _tracked(time, declared or float(1 / np.median(np.diff(time))))
        index = np.concatenate([[0.0], np.cumsum(tracked)])
        found, tracked_off = _line(time, index)
        if np.abs(tracked_off).max() <= _JITTER:
            steps, rate, off = tracked, found, tracked_off
    index = np.concatenate([[0.0], np.cumsum(steps)])
    settled, notes = _settled_rate(rate, time, off, declared)
    jitter = 1000 * float(np.abs(off).max()) / rate
    notes += (f"The time stamps are uneven (by up to {jitter:.3g} ms); the frames were taken as evenly spaced.",)
    return _gridded(steps, settled, _start(time, index, settled), notes)


_FIRST_ROWS = 15


def _tracked(time: np.ndarray, rate: float) -> np.ndarray:
    """(rows - 1,) steps of a clock that follows the stamps slowly: one row's jitter is no step, a lasting shift is."""
    steps = np.ones(len(time) - 1)
    step = 1 / rate
    # The first stamp jitters too: the clock is set by where the first rows lie within their steps on average.
    phase = np.angle(np.exp(2j * np.pi * (time[:_FIRST_ROWS] - time[0]) / step).mean()) / (2 * np.pi)
    at = float(time[0] + phase * step)
    for i, stamp in enumerate(time[1:].tolist()):
        count = max(1, round((stamp - at) / step))
        error = stamp - at - count * step
        at += count * step + 0.2 * error
        step += 0.01 * error / count
        steps[i] = count
    return steps


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
