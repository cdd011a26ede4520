"""Columns that are no marker: what cameras take for one."""

from __future__ import annotations

import numpy as np

_KINDS = ("standing", "wandering", "flickering")
_SHARE_SEEN = 0.6  # of the frames, of a reflection that stands or wanders
_SPELL = 2.0  # s, mean length of the spells in which it is seen
_FLASH, _FLASHES = 0.25, 0.5  # s, mean length of a flicker; how many a second
_NEAR = (0.05, 0.30)  # m from a marker, where flickers arise


def ghosts(paths: np.ndarray, rate: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """(T, G, 3) m, NaN where not seen: reflections that stand in the lab, wander through it, flicker near the body.

    Parameters
    ----------
    paths : (T, M, 3) m, the true markers, all of them seen
    """
    one = rng.spawn(count)
    return (
        np.stack([_ghost(_KINDS[g % len(_KINDS)], paths, rate, one[g]) for g in range(count)], axis=1)
        if count
        else np.empty((len(paths), 0, 3))
    )


def _ghost(kind: str, paths: np.ndarray, rate: float, rng: np.random.Generator) -> np.ndarray:
    """(T, 3) m."""
    frames = len(paths)
    if kind == "flickering":
        return _flicker(paths, rate, rng)
    low, high = paths.reshape(-1, 3).min(axis=0), paths.reshape(-1, 3).max(axis=0)
    margin = np.array([1.0, 1.0, 0.0])
    place = rng.uniform(low - margin, high + margin)
    found = np.tile(place, (frames, 1)) + rng.normal(0, 0.2e-3, (frames, 3))
    if kind == "wandering":
        found += _walk(frames, rate, rng)
    found[~_seen(frames, rate, rng)] = np.nan
    return found


def _walk(frames: int, rate: float, rng: np.random.Generator) -> np.ndarray:
    """(T, 3) m, a smooth wandering of some 0.2 m/s."""
    from scipy.ndimage import gaussian_filter1d

    speed = gaussian_filter1d(rng.normal(size=(frames, 3)), 0.5 * rate, axis=0, mode="nearest")
    speed *= 0.2 / np.maximum(np.linalg.norm(speed, axis=1).mean(), 1e-12)
    return np.cumsum(speed, axis=0) / rate


def _seen(frames: int, rate: float, rng: np.random.Generator) -> np.ndarray:
    """(T,) on and off in spells, on at some time."""
    on, place, seen = bool(rng.random() < _SHARE_SEEN), 0, np.zeros(frames, dtype=bool)
    while place < frames:
        mean = _SPELL if on else _SPELL * (1 - _SHARE_SEEN) / _SHARE_SEEN
        length = 1 + int(rng.exponential(mean * rate))
        seen[place : place + length] = on
        place, on = place + length, not on
    if not seen.any():
        seen[: max(1, frames // 4)] = True
    return seen


def _flicker(paths: np.ndarray, rate: float, rng: np.random.Generator) -> np.ndarray:
    """(T, 3) m, short tracks, each beside another marker and moving roughly with it."""
    frames, count = paths.shape[:2]
    found = np.full((frames, 3), np.nan)
    for _ in range(1 + rng.poisson(_FLASHES * frames / rate)):
        length = 2 + int(rng.exponential(_FLASH * rate))
        start, marker = int(rng.integers(frames)), int(rng.integers(count))
        beside = rng.normal(size=3)
        beside *= rng.uniform(*_NEAR) / np.linalg.norm(beside)
        span = slice(start, start + length)
        found[span] = paths[span, marker] + beside + rng.normal(0, 2e-3, paths[span, marker].shape)
    return found
