"""Values over time: from many markers to one, from one clock to another, thinned to what a plot can show."""

from __future__ import annotations

from typing import Literal

import numpy as np


def over_markers(values: np.ndarray, statistic: Literal["mean", "median", "p95", "worst"]) -> np.ndarray:
    """(T,) of (T, M), lost ones left out; NaN where all are."""
    out = np.full(len(values), np.nan)
    known = np.isfinite(values)
    some = known.any(axis=1)
    if statistic == "mean":
        out[some] = np.where(known, values, 0.0).sum(axis=1)[some] / known.sum(axis=1)[some]
    elif statistic == "worst":
        out[some] = np.where(known, values, -np.inf).max(axis=1)[some]
    else:
        out[some] = _quantile(values[some], known[some], 0.5 if statistic == "median" else 0.95)
    return out


def on_clock(wanted: np.ndarray, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(n,) values at the frames nearest to ``wanted`` (n,) s; NaN where none is within half a frame."""
    if len(wanted) == len(time) and np.array_equal(wanted, time):
        return values
    right = np.clip(np.searchsorted(time, wanted), 0, len(time) - 1)
    left = np.maximum(right - 1, 0)
    near = np.where(np.abs(time[left] - wanted) < np.abs(time[right] - wanted), left, right)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    return np.where(np.abs(time[near] - wanted) <= 0.5 * step + 1e-6, values[near], np.nan)


def thinned(time: np.ndarray, values: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Time and values (n,) with n <= most whose curve looks the same: the least and the greatest of every bin.

    A bin without any value is NaN, so that a gap stays a gap.
    """
    count = len(values)
    if count <= most:
        return time, values
    bins = max(1, most // 2)
    starts = np.arange(bins) * count // bins
    known = np.isfinite(values)
    low = np.minimum.reduceat(np.where(known, values, np.inf), starts)
    high = np.maximum.reduceat(np.where(known, values, -np.inf), starts)
    empty = low > high
    pair = np.where(empty[:, None], np.nan, np.stack([low, high], axis=1))
    return np.repeat(time[starts], 2), pair.ravel()


def _quantile(values: np.ndarray, known: np.ndarray, share: float) -> np.ndarray:
    """(T,) quantile of the known values (T, M) of each row, interpolated between the two nearest."""
    ranked = np.sort(np.where(known, values, np.inf), axis=1)
    last = known.sum(axis=1) - 1
    place = share * last
    low = np.floor(place).astype(int)
    rows = np.arange(len(values))
    part = place - low
    quantile: np.ndarray = (1 - part) * ranked[rows, low] + part * ranked[rows, np.minimum(low + 1, last)]
    return quantile
