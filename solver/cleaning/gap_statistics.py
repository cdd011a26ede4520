"""How real markers were lost: statistics counted in recordings, and the law that their lengths follow."""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError


def heavy_tail(longest: int) -> np.ndarray:
    """(longest,) chance of a gap of 1, 2.. frames: as (l + 0.6)^-1.4, which real statistics follow."""
    chance = (np.arange(1, longest + 1) + 0.6) ** -1.4
    return np.asarray(chance / chance.sum())


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

    @property
    def share(self) -> np.ndarray:
        """(N,) of its frames in which each marker was lost."""
        return np.asarray(self.frames[:, 0] / self.frames[:, 1])

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
