"""Long recordings cut down to the pixels that show them, such that nothing short is lost from sight; no Qt."""

from __future__ import annotations

import numpy as np

BLOCK = 8
"""Frames that are summed once and for all, for pictures in which a pixel is wider than that."""
_FAINTEST = 0.35
"""How strongly a pixel shows something that is true in only one of its frames."""


def edges(time: np.ndarray, start: float, end: float, width: int) -> np.ndarray:
    """Frame at which each pixel begins, and one past the last: (width + 1,). A frame reaches halfway to its neighbours.

    Outside the recording, pixels are empty: their bounds are equal.
    """
    if len(time) == 0:
        return np.zeros(width + 1, np.intp)
    at = np.linspace(start, end, width + 1)
    if len(time) == 1:
        return np.where(at > time[0], 1, 0).astype(np.intp)
    half = 0.5 * float(np.median(np.diff(time[: min(len(time), 1001)])))
    return np.searchsorted(time + half, at, side="left").astype(np.intp)


def shown_frames(time: np.ndarray, start: float, end: float, width: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First and one past the last frame of each pixel, at least one frame a pixel; and which pixels lie inside."""
    bounds = edges(time, start, end, width)
    first, last = bounds[:-1], np.maximum(bounds[1:], bounds[:-1] + 1)
    if len(time) > 1:
        half = 0.5 * float(np.median(np.diff(time[: min(len(time), 1001)])))
    else:
        half = 0.5
    at = np.linspace(start, end, width + 1)
    inside = (at[1:] > time[0] - half) & (at[:-1] < time[-1] + half) if len(time) else np.zeros(width, bool)
    count = max(len(time), 1)
    return np.clip(first, 0, count - 1), np.clip(last, 1, count), inside


class Counts:
    """How many of the frames behind a pixel hold a flag, for (T, M) flags of any length.

    Sums over blocks of frames are kept, so that a picture of the whole recording touches an eighth of it.
    """

    def __init__(self, flags: np.ndarray) -> None:
        self.flags = np.ascontiguousarray(flags).view(np.uint8)
        whole = len(flags) // BLOCK * BLOCK
        blocks = self.flags[:whole].reshape(whole // BLOCK, BLOCK, flags.shape[1]).sum(axis=1, dtype=np.uint8)
        rest = self.flags[whole:].sum(axis=0, dtype=np.uint8)[None]
        self.blocks = np.concatenate([blocks, rest]) if len(flags) > whole else blocks

    def share(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Part of the frames ``first..last`` of each pixel that are flagged: (W, M) float32."""
        values, size = self.flags, 1
        if len(first) and np.median(last - first) > BLOCK:
            values, size = self.blocks, BLOCK
            first, last = first // BLOCK, np.maximum(-(-last // BLOCK), first // BLOCK + 1)
        low, high = int(first.min()), int(last.max())
        sums = np.zeros((high - low + 1, values.shape[1]), np.int32)
        np.cumsum(values[low:high], axis=0, dtype=np.int32, out=sums[1:])
        frames = (np.minimum(last * size, len(self.flags)) - first * size).astype(np.float32)
        return (sums[last - low] - sums[first - low]) / np.maximum(frames, 1)[:, None]


def strength(share: np.ndarray) -> np.ndarray:
    """How strongly a flag is drawn: 0 if it holds nowhere, plainly visible if in one frame, 1 if in all."""
    return np.where(share > 0, _FAINTEST + (1 - _FAINTEST) * share, 0.0).astype(np.float32)


def presence_picture(
    layers: list[tuple[np.ndarray, np.ndarray]], background: np.ndarray, inside: np.ndarray
) -> np.ndarray:
    """Flags laid over each other as colours: (M, W, 3) uint8.

    Parameters
    ----------
    layers : (strength (W, M), colours (3,) or (M, 3)), the later over the earlier
    background : (3,) uint8
    inside : (W,) which pixels the recording covers
    """
    width, markers = layers[0][0].shape
    picture = np.empty((markers, width, 3), np.float32)
    picture[:] = background
    for shown, colours in layers:
        colour = np.broadcast_to(np.asarray(colours, np.float32), (markers, 3))[:, None]
        weight = (shown * inside[:, None]).T[..., None]
        picture += weight * (colour - picture)
    return np.rint(picture).astype(np.uint8)


def envelope(
    time: np.ndarray, values: np.ndarray, start: float, end: float, width: int
) -> tuple[np.ndarray, np.ndarray]:
    """A curve as few points that look the same: lowest and highest value of each pixel where frames are dense.

    Returns
    -------
    time, values : (n,); NaN where the line is interrupted
    """
    low = max(0, int(np.searchsorted(time, start)) - 1)
    high = min(len(time), int(np.searchsorted(time, end, side="right")) + 1)
    time, values = time[low:high], values[low:high]
    if len(time) <= 3 * width:
        return time, values
    bounds = np.linspace(0, len(time), width + 1).astype(np.intp)[:-1]
    least, most = np.fmin.reduceat(values, bounds), np.fmax.reduceat(values, bounds)
    # a pixel that holds a gap breaks the line only if nothing of it was seen
    return np.repeat(time[bounds], 2), np.stack([least, most], 1).ravel()
