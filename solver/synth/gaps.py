"""Where markers are lost: by a heavy-tailed law, by the paper's, or as they were in real recordings."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.errors import InputError

HIDDEN_FRAMES = 10
"""How long a marker stays hidden in the paper's trial (Milef et al. 2024, appendix E.3)."""


def heavy_tailed_gaps(shape: tuple[int, int], share: float, longest: int, rng: np.random.Generator) -> np.ndarray:
    """(T, M) True where lost: exactly a share of all samples, some markers far more often than others.

    Lengths l up to ``longest`` frames are drawn with probability ~ (l + 0.6)^-1.4, as real gaps have them.
    """
    frames, count = shape
    lost = np.zeros(shape, dtype=bool)
    wanted = round(share * lost.size)
    lengths = np.arange(1, max(2, min(longest, frames // 2)) + 1)
    chance = (lengths + 0.6) ** -1.4
    chance /= chance.sum()
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


@dataclass(frozen=True, eq=False)
class GapStatistics:
    """How real markers were lost.

    Attributes
    ----------
    frames : (N, 2) of each marker: frames lost, frames recorded
    lengths : (N, L) gaps of each length in frames, by index; the last entry counts all that are as long or longer
    """

    frames: np.ndarray
    lengths: np.ndarray

    def mean_of_last(self, marker: int) -> int:
        """Mean length of the gaps that the last entry counts, in frames."""
        last = self.lengths.shape[1] - 1
        if not self.lengths[marker, last]:
            return last
        shorter = int(self.lengths[marker, :last] @ np.arange(last))
        return max(last, round((int(self.frames[marker, 0]) - shorter) / int(self.lengths[marker, last])))


def load_gap_statistics(path: str | Path) -> GapStatistics:
    """Read an npz with ``missing_arr`` (N, 2), lost and all frames by marker, and ``gap_arr`` (N, L), counts by length.

    Raises
    ------
    InputError : it is not such a file
    """
    remedy = "give an npz with 'missing_arr' (markers x 2) and 'gap_arr' (markers x lengths), both counts"
    try:
        with np.load(path, allow_pickle=False) as data:
            frames, lengths = data["missing_arr"], data["gap_arr"]
    except FileNotFoundError as error:
        raise InputError("there is no such file", path, "check the name and the folder") from error
    except (OSError, KeyError, ValueError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise InputError("the gap statistics cannot be read", path, remedy) from error
    whole = frames.dtype.kind in "iu" and lengths.dtype.kind in "iu"
    fits = frames.ndim == lengths.ndim == 2 and frames.shape[1:] == (2,) and len(frames) == len(lengths) > 0
    if not (whole and fits and lengths.shape[1] > 1 and (frames >= 0).all() and (lengths >= 0).all()):
        raise InputError("its arrays are not counts of lost frames and gap lengths", path, remedy)
    if (frames[:, 0] > 0.95 * frames[:, 1]).any() or (frames[:, 1] == 0).any():
        raise InputError("a marker in it was lost nearly always", path, "leave that marker out")
    return GapStatistics(frames.astype(np.int64), lengths.astype(np.int64))


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
