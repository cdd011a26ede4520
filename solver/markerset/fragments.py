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
    return Fragments(*table.T)


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
