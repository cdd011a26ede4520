"""Residuals at the ends of a gap carried through it, and what error that leaves."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.gaps import Gap

_TRIALS = 150
"""Places at which a gap of the same length is tried, at most."""
_INSIDE = (0.25, 0.5, 0.75)
"""Where in such a gap its error is looked at."""
STRAIN = 0.15
"""``strain`` of a frame that rides with the neighbours: a marker that was elsewhere among them afterwards has moved."""
_TRUST_IN_ENDS, _LIKENESS = 0.25, (1 / 16, 16.0)
"""The error rises with this power of how much more than usual the ends of a gap differ, between these limits."""


def throughout(there: np.ndarray, gap: Gap) -> np.ndarray:
    """(M,) True for the markers that are ``there`` (T, M) in every frame of a gap."""
    return np.asarray(there[gap.first : gap.last + 1].all(axis=0))


def ends_of(gap: Gap, seen: np.ndarray) -> np.ndarray:
    """The frames just before and after a gap that are ``seen`` (T,): two, one or none."""
    return np.array([t for t in (gap.first - 1, gap.last + 1) if 0 <= t < len(seen) and seen[t]], dtype=np.intp)


def blend(gap: Gap, ends: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Residuals (E, 3) at the ends, linearly through the gap, (L, 3); one end holds, none is nothing."""
    span = np.arange(gap.first, gap.last + 1)
    if len(ends) == 0:
        return np.zeros((len(span), 3))
    if len(ends) == 1:
        return np.repeat(residual, len(span), axis=0)
    share = ((span - ends[0]) / (ends[1] - ends[0]))[:, None]
    return (1 - share) * residual[0] + share * residual[1]


def drift(frames: np.ndarray, residual: np.ndarray, gap: Gap, ends: np.ndarray, strain: float = 0.0) -> float:
    """Mean error, m, that blending leaves in gaps of this length, tried out where the residual is known.

    More than that where the two ends of this gap differ more than elsewhere, less where they agree.

    Parameters
    ----------
    frames : (N,) frames in which it is known, rising
    residual : (N, 3) m, zero where the method is right
    ends : the frames beside the gap that are seen, as ``ends_of`` has them
    strain : share of the way from end to end that the error is never below
    """
    if len(frames) < 2:
        return np.inf
    if len(ends) == 0:
        return float(np.linalg.norm(residual - residual.mean(axis=0), axis=1).mean())
    way = _end_to_end(frames, residual, ends)
    length, times = gap.length, 1
    while length >= 1:
        tried = _tried(frames, residual, length + (len(ends) == 2), (gap.first + gap.last) / 2, len(ends))
        if tried is not None:
            error, usual = times * tried[0], times * tried[1]
            if way is not None and usual > 0:
                error *= float(np.clip(way / usual, *_LIKENESS)) ** _TRUST_IN_ENDS
            return max(error, strain * (way or 0.0))
        # Never seen for as long as that: what half the length leaves, and as much again.
        length, times = length // 2, times * 2
    return np.inf


def _end_to_end(frames: np.ndarray, residual: np.ndarray, ends: np.ndarray) -> float | None:
    """m, how far the residual moves from one end of a gap to the other; None where it is not known at both."""
    rows = np.searchsorted(frames, ends)
    if len(ends) < 2 or rows[1] >= len(frames) or (frames[rows] != ends).any():
        return None
    return float(np.linalg.norm(residual[rows[1]] - residual[rows[0]]))


def _tried(frames: np.ndarray, residual: np.ndarray, lag: int, near: float, ends: int) -> tuple[float, float] | None:
    """Mean error of blending over ``lag`` frames, and mean way from end to end, at the places nearest to ``near``.

    None where none is known.
    """
    starts = frames[frames + lag <= frames[-1]]
    if len(starts) > 4 * _TRIALS:
        starts = starts[np.argsort(np.abs(starts + lag / 2 - near), kind="stable")[: 4 * _TRIALS : 4]]
    elif len(starts) > _TRIALS:
        starts = starts[:: len(starts) // _TRIALS]
    if len(starts) == 0:
        return None
    # Whole frames: between two of them a line would be taken for the truth.
    inside = np.unique(np.clip(np.round(lag * np.array(_INSIDE)), 1, max(1, lag - (ends == 2))))
    times = starts[:, None] + np.array([0.0, *inside, lag])
    after = np.clip(np.searchsorted(frames, times), 1, len(frames) - 1)
    left, right = frames[after - 1], frames[after]
    # Where frames are further apart there is a gap, about which nothing can be tried.
    whole = (right - left).max(axis=1) <= max(1, lag // 4)
    if not whole.any():
        return None
    share = ((times - left) / (right - left))[whole, :, None]
    value = (1 - share) * residual[after[whole] - 1] + share * residual[after[whole]]
    first, last = value[:, 0], value[:, -1]
    errors = [
        np.linalg.norm(value[:, k] - ((1 - f / lag) * first + f / lag * last if ends == 2 else first), axis=1)
        for k, f in enumerate(inside, start=1)
    ]
    return float(np.mean(errors)), float(np.linalg.norm(last - first, axis=1).mean())
