"""Residuals at the ends of a gap carried through it, and what error that leaves."""

from __future__ import annotations

import numpy as np

from solver.clean.gaps import Gap

_TRIALS = 150
"""Places at which a gap of the same length is tried, at most."""
_INSIDE = (0.25, 0.5, 0.75)
"""Where in such a gap its error is looked at."""


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


def drift(frames: np.ndarray, residual: np.ndarray, gap: Gap, ends: int) -> float:
    """Mean error, m, that blending leaves in gaps of this length, tried out where the residual is known.

    Parameters
    ----------
    frames : (N,) frames in which it is known, rising
    residual : (N, 3) m, zero where the method is right
    ends : how many ends of the gap are seen
    """
    if len(frames) < 2:
        return np.inf
    if ends == 0:
        return float(np.linalg.norm(residual - residual.mean(axis=0), axis=1).mean())
    lag = gap.length + 1 if ends == 2 else gap.length
    known = frames[frames + lag <= frames[-1]]
    if len(known) == 0:  # never seen for as long as that: what it wanders about its mean, and as much again
        return 2 * float(np.linalg.norm(residual - residual.mean(axis=0), axis=1).mean())
    nearest = np.argsort(np.abs(known + lag / 2 - (gap.first + gap.last) / 2), kind="stable")
    tried = known[nearest[: 4 * _TRIALS : 4]] if len(known) > 4 * _TRIALS else known[:: max(1, len(known) // _TRIALS)]

    def at(times: np.ndarray) -> np.ndarray:
        return residual[np.clip(np.searchsorted(frames, times), 0, len(frames) - 1)]

    first, last = at(tried), at(tried + lag)
    errors = [
        np.linalg.norm(at(tried + lag * f) - ((1 - f) * first + f * last if ends == 2 else first), axis=1)
        for f in _INSIDE
    ]
    return float(np.mean(errors))
