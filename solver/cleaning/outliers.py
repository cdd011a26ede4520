"""Samples that jump out of their track."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.cleaning.beside import beside_neighbours
from markerscope.solver.cleaning.request import OutlierMethod

_FLOOR_M = 0.0003
"""Below this nothing is out of the ordinary, however still the marker was."""
_AGREE = 0.5
"""Of a jump: the way back may differ from the way out by this share, and what is between may move by as much."""
_SMOOTH = 7
"""Frames about one from which its usual velocity is taken."""
_LEAST_BESIDE, _MOST_BESIDE = 0.2, 0.85
_ROUNDS = 6
_JUMP_SHARE = 2 / 3
"""Of ``ratio``: there and back again by the same way is sign enough for less."""


@dataclass(frozen=True)
class OutlierSettings:
    """How outliers are found.

    Attributes
    ----------
    method : ``local``: acceleration over its own local median; ``prominence``: peaks of acceleration, as published;
        ``none``
    ratio : local: how many times what is usual there is too much
    least : m, local: a sample this near to where the samples before and after have it is never an outlier
    window : s, local: over which the usual acceleration is taken
    longest : frames, local: an excursion that comes back within so many is an outlier as a whole
    prominence : m/s^2, of a published peak
    around : frames cut to either side of a published peak
    passes : of the published search
    """

    method: OutlierMethod = "local"
    ratio: float = 9.0
    least: float = 0.005
    window: float = 0.5
    longest: int = 5
    prominence: float = 100.0
    around: int = 2
    passes: int = 2

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        for name in ("ratio", "least", "window", "prominence"):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name):g} and has to be above 0")
        for name, lowest in (("around", 0), ("passes", 1), ("longest", 1)):
            if getattr(self, name) < lowest:
                raise ValueError(f"{name} is {getattr(self, name)} and has to be {lowest} or more")


def find_outliers(positions: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """Samples that are outliers, (T, M) True; never one that is lost.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    rate : Hz
    """
    found = np.zeros(positions.shape[:2], dtype=bool)
    if settings.method == "prominence":
        found = _by_prominence(positions, rate, settings)
    elif settings.method == "local" and len(positions) > 2:
        found = _by_local_usage(positions, rate, settings)
    return np.asarray(found & np.isfinite(positions).all(axis=2))


def _by_local_usage(positions: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """Excursions and single samples; then excursions from where the neighbours, mended by the first pass, lead."""
    first = _excursions(positions, rate, settings)
    first |= _peaks(_bridged(positions, first), rate, settings)
    beside = beside_neighbours(positions, _bridged(positions, first))
    return first | _excursions(beside, rate, settings)


def _usual(size: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """(T, M) m, what is usual there: the marker's median about that time, and all markers' in that frame.

    The second is what tells a landing, which all markers feel, from a marker that jumps alone.
    """
    from scipy.ndimage import median_filter

    # An even number of frames would look further back than ahead.
    window = max(3, round(settings.window * rate) // 2 * 2 + 1)
    own: np.ndarray = median_filter(np.nan_to_num(size), size=(window, 1), mode="nearest")
    return np.asarray(np.hypot(own, _median_of_frame(size)[:, None]) + _FLOOR_M)


def _median_of_frame(size: np.ndarray) -> np.ndarray:
    """(T,) median over the markers, 0 where all are NaN."""
    count = np.isfinite(size).sum(axis=1)
    rising = np.sort(size, axis=1)  # NaN last
    return np.where(count > 0, np.nan_to_num(rising[np.arange(len(size)), np.maximum(count - 1, 0) // 2]), 0.0)


def _peaks(positions: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """Single samples: peaks of the distance from where the samples about them lead."""
    positions = positions.copy()
    found = np.zeros(positions.shape[:2], dtype=bool)
    usual: np.ndarray | None = None
    for _ in range(_ROUNDS):
        off = _off(positions)
        size = np.linalg.norm(off, axis=2)
        usual = _usual(size, rate, settings) if usual is None else usual
        # The samples beside an outlier are off by two thirds of it: only the top of each peak is cut.
        padded = np.pad(np.nan_to_num(size), ((2, 2), (0, 0)))
        top = np.max([padded[k : k + len(size)] for k in (0, 1, 3, 4)], axis=0)
        new = (size > settings.ratio * usual) & (size > settings.least) & (size >= top) & _comes_back(size) & ~found
        if not new.any():
            break
        found |= new
        positions[new] -= off[new]
    return found


def _off(positions: np.ndarray) -> np.ndarray:
    """(T, M, 3) m from the cubic through two samples on either side, or from the middle of one on either side."""
    off = np.full_like(positions, np.nan)
    off[1:-1] = positions[1:-1] - 0.5 * (positions[:-2] + positions[2:])
    if len(positions) > 4:
        cubic = positions[2:-2] - (4 * (positions[1:-3] + positions[3:-1]) - (positions[:-4] + positions[4:])) / 6
        off[2:-2] = np.where(np.isfinite(cubic), cubic, off[2:-2])
    return off


def _comes_back(size: np.ndarray) -> np.ndarray:
    """(T, M) True where the samples beside are off by a half or two thirds: at a step that stays, one is as much."""
    beside = np.pad(size, ((1, 1), (0, 0)), constant_values=np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = [beside[k : k + len(size)] / size for k in (0, 2)]
    return np.all([~(share < _LEAST_BESIDE) & ~(share > _MOST_BESIDE) for share in shares], axis=0)


def _excursions(positions: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """Spans of two frames and more that a marker spends elsewhere: it jumps away, and by the same way back."""
    from scipy.ndimage import median_filter

    found = np.zeros(positions.shape[:2], dtype=bool)
    step = np.diff(positions, axis=0)
    jump = step - median_filter(np.nan_to_num(step), size=(_SMOOTH, 1, 1), mode="nearest")
    size = np.linalg.norm(jump, axis=2)
    usual = _usual(size, rate, settings)
    jump, size = np.nan_to_num(jump), np.nan_to_num(size)
    big = (size > _JUMP_SHARE * settings.ratio * usual) & (size > settings.least)
    for length in range(2, min(settings.longest, len(size) - 1) + 1):
        smaller = _AGREE * np.minimum(size[:-length], size[length:])
        returns = np.linalg.norm(jump[:-length] + jump[length:], axis=2) < smaller
        between = np.max([size[k : len(size) - length + k] for k in range(1, length)], axis=0)
        hit = big[:-length] & big[length:] & returns & (between < smaller)
        for k in range(1, length + 1):
            found[k : k + len(hit)] |= hit
    return found


def _by_prominence(positions: np.ndarray, rate: float, settings: OutlierSettings) -> np.ndarray:
    """Peaks of acceleration by prominence and the frames about them, searched again after a spline replaced them."""
    from scipy.signal import find_peaks

    positions, present = positions.copy(), np.isfinite(positions).all(axis=2)
    found = np.zeros(present.shape, dtype=bool)
    for _ in range(settings.passes):
        new = np.zeros_like(found)
        pull = np.zeros(present.shape)
        pull[1:-1] = np.linalg.norm(positions[2:] - 2 * positions[1:-1] + positions[:-2], axis=2) * rate**2
        for m in range(present.shape[1]):
            for peak in find_peaks(np.nan_to_num(pull[:, m]), prominence=settings.prominence)[0]:
                new[max(0, peak - settings.around) : peak + settings.around + 1, m] = True
        new &= present
        found |= new
        positions = _bridged(positions, new, spline=True)
    return found


def _bridged(positions: np.ndarray, out: np.ndarray, spline: bool = False) -> np.ndarray:
    """The tracks with some samples replaced by a line, or a spline, through the others."""
    from scipy.interpolate import CubicSpline

    positions = positions.copy()
    kept = np.isfinite(positions).all(axis=2) & ~out
    for m in np.flatnonzero(out.any(axis=0)):
        good, bad = np.flatnonzero(kept[:, m]), np.flatnonzero(out[:, m])
        if len(good) < 2:
            continue
        bad = bad[(bad > good[0]) & (bad < good[-1])]
        if spline:
            positions[bad, m] = CubicSpline(good, positions[good, m], axis=0)(bad)
        else:
            positions[bad, m] = np.stack([np.interp(bad, good, positions[good, m, k]) for k in range(3)], axis=1)
    return positions
