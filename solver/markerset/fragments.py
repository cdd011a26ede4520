"""Trajectories cut into fragments, within which it is one marker that is seen: at gaps and where they jump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_HARD_M = 0.012
"""A second difference above this, and unusual for the trajectory, is a jump."""
_SOFT_M = 0.003
_UNUSUAL = 6.0
_NEAR_M = 0.030
"""Markers that come nearer than this may be exchanged without a jump that stands out."""
_USUAL_HZ = 100.0
_LINK_M, _LINK_CLEAR = 0.010, 0.4
"""m beside the way, and share of the next best, within which a fragment goes on from one that ended a frame before."""
HARD, SOFT, START = 2, 1, 3


@dataclass(frozen=True, eq=False)
class Fragments:
    """F fragments of the trajectories.

    Attributes
    ----------
    column : (F,) trajectory that each is cut from
    first, last : (F,) frames, both inclusive
    cut : (F,) what parts it from the one before it in its trajectory: ``START`` nothing is before it, ``HARD`` a gap
        or a jump, ``SOFT`` a step that only a close neighbour explains
    """

    column: np.ndarray
    first: np.ndarray
    last: np.ndarray
    cut: np.ndarray
    before: np.ndarray

    def __len__(self) -> int:
        return len(self.column)

    @property
    def length(self) -> np.ndarray:
        """(F,) frames."""
        return self.last - self.first + 1

    def of_sample(self, shape: tuple[int, int]) -> np.ndarray:
        """(T, N) fragment of each sample, -1 where nothing was seen."""
        where = np.full(shape, -1)
        for f, (column, first, last) in enumerate(zip(self.column, self.first, self.last)):
            where[first : last + 1, column] = f
        return where


def cut_up(positions: np.ndarray, rate: float) -> Fragments:
    """Fragments of trajectories (T, N, 3) m, NaN = lost.

    Cuts cost nothing where the same marker goes on behind them: both pieces then get its name.
    """
    present = np.isfinite(positions).all(axis=2)
    hard, soft = _jumps(positions, present, rate)
    rows = []
    for n in range(positions.shape[1]):
        seen = np.flatnonzero(present[:, n])
        if not len(seen):
            continue
        kinds = np.zeros(len(seen), int)
        kinds[0] = START
        kinds[1:][np.diff(seen) > 1] = HARD
        kinds = np.where((kinds == 0) & hard[seen, n], HARD, kinds)
        kinds = np.where((kinds == 0) & soft[seen, n], SOFT, kinds)
        starts = np.flatnonzero(kinds)
        ends = np.append(starts[1:], len(seen)) - 1
        rows += [(n, seen[a], seen[b], kinds[a]) for a, b in zip(starts, ends)]
    table = np.array(rows, int).reshape(-1, 4)
    column, first, last, cut = table.T
    before, cut = _linked(positions, column, first, last, cut.copy(), rate)
    return Fragments(column, first, last, cut, before)


def _linked(
    positions: np.ndarray, column: np.ndarray, first: np.ndarray, last: np.ndarray, cut: np.ndarray, rate: float
) -> tuple[np.ndarray, np.ndarray]:
    """(F,) what each fragment goes on from, and (F,) the cuts, ``SOFT`` where one goes on from another's end without a
    gap, the only one of either to do so.
    """
    before = np.full(len(column), -1)
    own = np.flatnonzero(column[1:] == column[:-1]) + 1
    before[own] = own - 1
    scale = max(1.0, _USUAL_HZ / rate)
    for frame in np.unique(first[cut != SOFT]):
        begun = np.flatnonzero((first == frame) & (cut != SOFT) & (last > frame))
        ended = np.flatnonzero((last == frame - 1) & (last > first))
        if not len(begun) or not len(ended):
            continue
        step = positions[frame - 1, column[ended]] - positions[frame - 2, column[ended]]
        ahead = positions[frame - 1, column[ended]] + step
        off = np.linalg.norm(positions[frame, column[begun]][:, None] - ahead, axis=2)
        for i, f in enumerate(begun):
            k = int(off[i].argmin())
            others = np.concatenate([np.delete(off[i], k), np.delete(off[:, k], i), [np.inf]])
            if off[i, k] < _LINK_M * scale and off[i, k] < _LINK_CLEAR * others.min():
                # whoever followed that end in its own trajectory follows it no more
                before[before == ended[k]] = -1
                before[f], cut[f] = int(ended[k]), SOFT
    return before, cut


def _jumps(positions: np.ndarray, present: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """(T, N) True at the first sample behind a jump, plain ones and those beside a close neighbour."""
    frames, count = present.shape
    hard, soft = np.zeros((frames, count), bool), np.zeros((frames, count), bool)
    if frames < 4:
        return hard, soft
    scale = max(1.0, _USUAL_HZ / rate)  # a cut too many costs nothing, one too few a wrong name
    # How far each step leaves the way before it, and the way behind it the step.
    step = np.diff(positions, axis=0)
    bend = np.full((frames, count), np.nan)
    bend[1:-1] = np.linalg.norm(step[1:] - step[:-1], axis=2)
    usual = np.array([np.median(own[np.isfinite(own)]) if np.isfinite(own).any() else 0.0 for own in bend.T])
    # A jump between t - 1 and t bends the way at t - 1 and at t, both by its length.
    both = np.full((frames, count), np.nan)
    both[1:] = np.fmin(bend[:-1], bend[1:])
    both[1] = bend[1]
    both[-1] = bend[-2]
    with np.errstate(invalid="ignore"):
        hard = (both > np.maximum(_HARD_M * scale, _UNUSUAL * usual)) & present
        odd = (both > np.maximum(_SOFT_M * scale, _UNUSUAL / 2 * usual)) & present & ~hard
    for t in np.flatnonzero(odd.any(axis=1)):
        for n in np.flatnonzero(odd[t]):
            away = np.linalg.norm(positions[t] - positions[t, n], axis=1)
            away[n] = np.inf
            soft[t, n] = np.nanmin(np.where(np.isfinite(away), away, np.inf)) < _NEAR_M
    return np.asarray(hard), soft
