"""A cubic spline through the samples about the gap."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.blend import ends_of
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, Gap, gaps_to_fill, together

_KNOTS = 4
"""Samples on either side that the spline goes through."""
_TRIALS = 25


def fill_spline(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """Cubic splines; gaps at the start or end of a recording stay."""
    present = np.isfinite(positions).all(axis=2)
    parts = [spline_part(positions, present, gap) for gap in gaps_to_fill(present, rate, settings)]
    return together(positions, [part for part in parts if part is not None], settings)


def spline_part(positions: np.ndarray, present: np.ndarray, gap: Gap) -> tuple[Fill, np.ndarray] | None:
    """The fill of one gap and its (L, 3) m; None where the marker is not seen on both sides."""
    track, seen = positions[:, gap.marker], present[:, gap.marker]
    if len(ends_of(gap, seen)) < 2:
        return None
    start = max(0, gap.first - 3 * _KNOTS)
    before = np.flatnonzero(seen[start : gap.first])[-_KNOTS:] + start
    after = np.flatnonzero(seen[gap.last + 1 : gap.last + 1 + 3 * _KNOTS])[:_KNOTS] + gap.last + 1
    knots = np.concatenate([before, after])
    values = _through(knots, track[knots], np.arange(gap.first, gap.last + 1))
    return Fill(gap.marker, gap.first, gap.last, "spline", 0.0, _expected(track, seen, gap)), values


def _expected(track: np.ndarray, seen: np.ndarray, gap: Gap) -> float:
    """Mean error, m, of a spline over gaps of this length, tried out where the track is seen; infinite if nowhere."""
    whole = 2 * _KNOTS + gap.length
    run = np.concatenate([[0], np.cumsum(seen)])
    starts = np.flatnonzero(run[whole:] - run[:-whole] == whole)
    if len(starts) == 0:
        return np.inf
    nearest = starts[np.argsort(np.abs(starts + _KNOTS - gap.first), kind="stable")]
    tried = nearest[:: max(1, len(nearest) // _TRIALS)][:_TRIALS]
    pieces = track[tried[:, None] + np.arange(whole)]  # (trials, whole, 3)
    inside = np.arange(_KNOTS, _KNOTS + gap.length)
    knots = np.setdiff1d(np.arange(whole), inside)
    guess = _through(knots, pieces[:, knots].transpose(1, 0, 2), inside)
    return float(np.linalg.norm(guess - pieces[:, inside].transpose(1, 0, 2), axis=-1).mean())


def _through(knots: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    from scipy.interpolate import CubicSpline

    if len(knots) == 2:
        share = ((wanted - knots[0]) / (knots[1] - knots[0])).reshape(-1, *(1,) * (values.ndim - 1))
        return (1 - share) * values[0] + share * values[1]
    return np.asarray(CubicSpline(knots, values, axis=0)(wanted))
