"""Tracks that change places: what a tracker makes of two markers that come near each other."""

from __future__ import annotations

import numpy as np

_NEAREST = 3  # the partner is one of so many
_SPAN = (0.3, 3.0)  # s, of a swap that is undone again; every other one is never undone


def draw_swaps(paths: np.ndarray, rate: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """(S, 4) columns a, b and the first and the end frame between which they are exchanged, by first frame.

    Parameters
    ----------
    paths : (T, M, 3) m, the true markers, all of them seen
    """
    frames, markers = paths.shape[:2]
    found = []
    for one in rng.spawn(count):
        start = int(one.integers(max(1, frames // 10), max(2, frames - frames // 10)))
        a = int(one.integers(markers))
        order = np.argsort(np.linalg.norm(paths[start] - paths[start, a], axis=1))[1 : 1 + _NEAREST]
        b = int(one.choice(order))
        span = max(1, round(float(one.uniform(*_SPAN)) * rate))
        stop = frames if one.random() < 0.5 else min(start + span, frames)
        found.append((a, b, start, stop))
    return np.array(sorted(found, key=lambda swap: swap[2]), dtype=np.intp).reshape(-1, 4)


def holders(swaps: np.ndarray, frames: int, count: int) -> np.ndarray:
    """(T, M) which marker is in each column, the columns having been right at first."""
    held = np.tile(np.arange(count), (frames, 1))
    for a, b, start, stop in swaps:
        held[start:stop, [a, b]] = held[start:stop, [b, a]]
    return held
