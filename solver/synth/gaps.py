"""Where markers are lost: by a heavy-tailed law, by the paper's, or as they were in real recordings."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.gap_statistics import GapStatistics, heavy_tail

HIDDEN_FRAMES = 10
"""How long a marker stays hidden in the paper's trial (Milef et al. 2024, appendix E.3)."""


def heavy_tailed_gaps(shape: tuple[int, int], share: float, longest: int, rng: np.random.Generator) -> np.ndarray:
    """(T, M) True where lost: exactly a share of all samples, some markers far more often than others.

    Lengths up to ``longest`` frames are drawn as real gaps have them (``heavy_tail``).
    """
    frames, count = shape
    lost = np.zeros(shape, dtype=bool)
    wanted = round(share * lost.size)
    lengths = np.arange(1, max(2, min(longest, frames // 2)) + 1)
    chance = heavy_tail(len(lengths))
    prone = rng.gamma(0.7, size=count) + 0.02
    gone, most = np.zeros(count), frames * min(0.95, 3 * share + 0.1)
    while wanted > 0:
        # A marker that is hardly seen any more is spared, else the chosen few would be lost for good.
        free = prone * (gone < most)
        marker, length = int(rng.choice(count, p=free / free.sum())), int(rng.choice(lengths, p=chance))
        start = int(rng.integers(1 - length, frames))
        gap = np.arange(max(start, 0), min(start + length, frames))
        gap = gap[~lost[gap, marker]][:wanted]
        lost[gap, marker] = True
        gone[marker] += len(gap)
        wanted -= len(gap)
    return lost


def hidden_by_chance(shape: tuple[int, int], chance: float, rng: np.random.Generator) -> np.ndarray:
    """(T, M) True where lost: in each frame each marker begins with a chance to be hidden for 10 frames."""
    begins = rng.random(shape) < chance
    lost = begins.copy()
    for later in range(1, min(HIDDEN_FRAMES, shape[0])):
        lost[later:] |= begins[:-later]
    return lost


def gaps_like(
    real: GapStatistics, shape: tuple[int, int], rng: np.random.Generator, *, times: float = 1.0
) -> np.ndarray:
    """(T, M) True where lost: each marker behaves as one of the real ones, drawn at random, no one twice before all.

    A marker is lost and seen in turns. Lengths of gaps are those counted, waiting times such that the share of lost
    frames is the real one; the recording begins anywhere in this course, also within a gap.

    Parameters
    ----------
    times : how many times as frequent gaps are
    """
    frames, count = shape
    lost = np.zeros(shape, dtype=bool)
    rounds = -(-count // len(real.frames))
    who = np.concatenate([rng.permutation(len(real.frames)) for _ in range(rounds)])[:count]
    for m, marker in enumerate(who):
        lost[:, m] = _course(real, int(marker), frames, rng, times)
    return lost


def _course(real: GapStatistics, marker: int, frames: int, rng: np.random.Generator, times: float) -> np.ndarray:
    """(T,) True where one marker is lost."""
    lost = np.zeros(frames, dtype=bool)
    counts = real.lengths[marker].astype(float)
    counts[0] = 0
    if counts.sum() == 0 or times == 0:
        return lost
    lengths = np.arange(len(counts))
    lengths[-1] = real.mean_of_last(marker)
    chance = counts / counts.sum()
    mean = float(chance @ lengths)
    gone, total = real.frames[marker]
    wait = float(total - gone) / float(gone) * mean / times  # frames seen for each gap
    place = 0
    if rng.random() < mean / (mean + wait):  # the start falls into a gap, more likely into a long one
        length = int(rng.choice(lengths, p=chance * lengths / mean))
        place = int(rng.integers(1, length + 1))
        lost[:place] = True
    while True:
        place += max(1, int(rng.geometric(min(1.0, 1 / max(wait, 1.0)))))
        if place >= frames:
            return lost
        length = int(rng.choice(lengths, p=chance))
        lost[place : place + length] = True
        place += length
