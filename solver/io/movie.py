"""Pictures in a row as a video file that plays everywhere."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import chain
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import atomic_path

_QUALITY = "18"  # x264's constant rate factor: no loss that is seen


def write_movie(path: str | Path, frames: Iterable[np.ndarray], rate: float) -> int:
    """Write an MP4 file with H.264 video, whole or not at all, and return how many frames it holds.

    Parameters
    ----------
    path : the file to write; its name ends in .mp4
    frames : pictures (H, W, 3) uint8 RGB, all of one size; an odd last row or column is repeated, since H.264 stores
        colours for two by two pixels. They are asked for one by one, and never all held.
    rate : frames a second

    Raises
    ------
    InputError : no frame, frames of different sizes, a rate that is none, or a place that cannot be written to
    """
    path = Path(path)
    if path.suffix.lower() != ".mp4":
        raise InputError("is no name for a video", path, "choose one that ends in .mp4")
    if not (np.isfinite(rate) and 0 < rate <= 1000):
        raise InputError(f"cannot be played at {rate} frames a second", path, "choose a rate from 1 to 1000")
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        raise InputError("would hold no frame", path, "choose a range with at least one frame")
    with atomic_path(path) as temporary:
        return _encode(temporary, path, chain([first], pictures), first.shape, rate)


def _encode(temporary: Path, path: Path, frames: Iterable[np.ndarray], shape: tuple[int, ...], rate: float) -> int:
    import av

    height, width = shape[0] + shape[0] % 2, shape[1] + shape[1] % 2
    count = 0
    # The index goes to the front, so that a browser plays it before it has all of it.
    with av.open(str(temporary), "w", format="mp4", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=Fraction(rate).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": _QUALITY, "preset": "veryfast"}
        for picture in frames:
            if picture.shape != shape:
                raise InputError(
                    f"cannot hold frames of different sizes ({shape[1]} x {shape[0]} px, then "
                    f"{picture.shape[1]} x {picture.shape[0]} px)", path, "keep the window's size while it is written",
                )  # fmt: skip
            whole = np.pad(picture, ((0, height - shape[0]), (0, width - shape[1]), (0, 0)), mode="edge")
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(whole), format="rgb24")
            container.mux(stream.encode(frame))
            count += 1
        container.mux(stream.encode())
    return count
