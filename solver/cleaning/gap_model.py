"""Gaps and shifts to be made on purpose, as they happen in real recordings (Pan et al. 2023, section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.cleaning.gap_statistics import heavy_tail, load_gap_statistics
from markerscope.solver.core.errors import InputError

LONGEST = 200
"""Frames; real gaps that last longer count as this long (the paper's clip)."""
_MOST_LOST = 0.9
"""Of one marker's samples, however often it is hidden in the statistics."""


@dataclass(frozen=True, eq=False)
class GapModel:
    """How often markers are lost, and for how long.

    Attributes
    ----------
    lengths : (N,) relative number of gaps of 1..N frames, sums to 1
    lost : (K,) how often each of K markers of the recordings behind the model is lost, beside their mean
    """

    lengths: np.ndarray
    lost: np.ndarray

    @property
    def mean_length(self) -> float:
        """Frames of an average gap."""
        return float(self.lengths @ np.arange(1, len(self.lengths) + 1))


def heavy_tailed(longest: int = LONGEST) -> GapModel:
    """Lengths as ``heavy_tail`` has them; every marker lost alike."""
    return GapModel(heavy_tail(longest), np.ones(1))


def read_gap_statistics(path: str | Path, longest: int = LONGEST) -> GapModel:
    """The model behind an npz of real statistics.

    Parameters
    ----------
    path : see ``load_gap_statistics``
    longest : frames; longer gaps count as this long

    Raises
    ------
    InputError : the file is not such an npz, or counts no gap
    """
    real = load_gap_statistics(path)
    counts = real.lengths.sum(axis=0)
    number = np.bincount(np.clip(np.arange(len(counts)), 0, longest), counts, longest + 1)[1:]
    if not (number.any() and real.share.any()):
        raise InputError("counts no gap", path, "give the statistics of recordings in which markers were lost")
    return GapModel(number / number.sum(), real.share / real.share.mean())


def draw_gaps(present: np.ndarray, model: GapModel, share: float, seed: int) -> np.ndarray:
    """Samples to be hidden, (T, M) True; only samples that are there.

    The number of gaps of each length follows the paper's equation (6), with the mean of the markers' rates where it
    prints their sum (else the overall share is not met), and the fraction of a gap that rounding down would lose
    drawn at random (else short recordings would have no long gaps). Longest first, none touching another.

    Parameters
    ----------
    present : (T, M) True where a marker was seen
    model : how often and how long
    share : of the samples that are there, to be hidden
    seed : of every random choice
    """
    rng = np.random.default_rng(seed)
    frames, count = present.shape
    # Which marker is lost how often is drawn anew: those of the statistics are other markers.
    rate = rng.permutation(np.resize(model.lost, max(count, len(model.lost))))[:count]
    rate = rate / max(rate.mean(), 1e-12)
    longest = max(1, min(len(model.lengths), frames // 3))
    lengths = np.bincount(np.clip(np.arange(1, len(model.lengths) + 1), 0, longest), model.lengths, longest + 1)[1:]
    length = np.arange(1, longest + 1)
    weighted = length * lengths / (length @ lengths)
    budget = np.minimum(share * rate, _MOST_LOST) * present.sum(axis=0)
    number = _whole(budget * (weighted / length)[:, None], rng)
    hidden = np.zeros_like(present, dtype=bool)
    for m in range(count):
        for size in np.repeat(length[::-1], number[::-1, m]):
            start = _free_place(present[:, m], hidden[:, m], int(size), rng)
            if start >= 0:
                hidden[start : start + size, m] = True
    return hidden


def _whole(expected: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Numbers of gaps, (lengths, markers), whose sums over markers and like lengths stay within one of ``expected``."""
    order = rng.permuted(np.tile(np.arange(expected.shape[1]), (len(expected), 1)), axis=1)
    running = np.cumsum(np.take_along_axis(expected, order, axis=1).ravel()) + rng.random()
    drawn = np.diff(np.floor(running), prepend=0.0).astype(int).reshape(expected.shape)
    number = np.empty_like(drawn)
    np.put_along_axis(number, order, drawn, axis=1)
    return number


def _free_place(present: np.ndarray, hidden: np.ndarray, size: int, rng: np.random.Generator) -> int:
    """First frame of a random span that is seen throughout and touches no gap made before; -1 if there is none."""
    beside = hidden.copy()
    beside[1:] |= hidden[:-1]
    beside[:-1] |= hidden[1:]
    free = np.concatenate([[0], np.cumsum(present & ~beside)])
    places = np.flatnonzero(free[size:] - free[:-size] == size)
    return int(rng.choice(places)) if len(places) else -1


def draw_shifts(present: np.ndarray, share: float, least: float, most: float, seed: int) -> np.ndarray:
    """Displacements that stand for tracking errors, (T, M, 3) m; zero where nothing is to happen.

    Single samples with a seen one before and after, none within two frames of another of the same marker.

    Parameters
    ----------
    present : (T, M) True where a marker was seen
    share : of the samples that are there, to be displaced
    least, most : m, between which the size is drawn evenly; the direction is any
    seed : of every random choice
    """
    rng = np.random.default_rng(seed)
    chosen = present & (rng.random(present.shape) < share)
    for t in range(len(chosen)):
        if t < 1 or t > len(chosen) - 2:
            chosen[t] = False
        else:
            chosen[t] &= present[t - 1] & present[t + 1] & ~chosen[max(t - 2, 0) : t].any(axis=0)
    direction = rng.normal(size=(*present.shape, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    return np.where(chosen[..., None], direction * rng.uniform(least, most, (*present.shape, 1)), 0.0)
