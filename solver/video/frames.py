"""Exact video frames: counted by decoding, timed by their presentation stamps, turned upright.

Time zero of a video is its first *decoded* frame. Containers are not believed: they may announce frames that an edit
list drops or that a truncated file no longer holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.video.upright import IDENTITY, Upright

if TYPE_CHECKING:
    from av import VideoFrame

_CONVERT = "convert it to an MP4 file with H.264 video"
NO_STAMP = int(np.iinfo(np.int64).min)
_SEQUENTIAL_REACH = 48  # frames; a jump ahead shorter than this decodes faster than a seek


@dataclass(frozen=True)
class VideoIndex:
    """What decoding a whole video once says of it.

    Attributes
    ----------
    time : (F,) s after the first decoded frame, strictly increasing
    pts : (F,) presentation stamps as stored, ``NO_STAMP`` where the file has none that can be used
    size : (width, height) px of the upright frame, with square pixels
    turned : degrees, clockwise, that the display matrix turns the stored picture
    rate : Hz, from the median time between frames (a variable rate has no better one)
    codec : the name of the codec
    notes : what is damaged or was assumed, one sentence each
    source : path of the file
    """

    time: np.ndarray
    pts: np.ndarray
    size: tuple[int, int]
    turned: int
    rate: float
    codec: str
    notes: tuple[str, ...] = ()
    source: str = ""

    def nearest(self, time: float) -> int:
        """Index of the frame shown nearest to ``time``, s."""
        after = int(np.clip(np.searchsorted(self.time, time), 1, max(1, len(self.time) - 1)))
        candidates = [after - 1, min(after, len(self.time) - 1)]
        return min(candidates, key=lambda i: abs(self.time[i] - time))


def index_video(path: str | Path) -> VideoIndex:
    """Decode every frame once; raise ``InputError`` where there is none."""
    with _Decoder(path) as decoder:
        stamps = [(time, pts) for _, time, pts in decoder]
        return decoder.index(np.array([t for t, _ in stamps]), np.array([p for _, p in stamps], dtype=np.int64))


def read_frames(
    path: str | Path,
    wanted: Iterable[int] | None = None,
    *,
    stride: int = 1,
    start: int = 0,
    passed: Callable[[int], None] = lambda index: None,
) -> Iterator[tuple[int, float, np.ndarray]]:
    """Decode a video in order and yield ``(index, time in s, upright picture (H, W, 3) uint8 RGB)``.

    Parameters
    ----------
    wanted : the indices to yield; all where it is None. Indices past the end are left out.
    stride : yield every so many of all frames (with ``wanted`` None)
    start : index of the first frame to yield (with ``wanted`` None); those before are decoded only, to be counted
    passed : told the index of every frame before ``start``
    """
    chosen = None if wanted is None else {int(i) for i in wanted}
    last = None if chosen is None else max(chosen, default=-1)
    with _Decoder(path) as decoder:
        for i, (frame, time, _) in enumerate(decoder):
            if last is not None and i > last:
                return
            if chosen is None and i < start:
                passed(i)
            elif i % stride == 0 if chosen is None else i in chosen:
                yield i, time, decoder.picture(frame)


def announced(path: str | Path) -> tuple[float, int]:
    """What the container says, at a glance: the mean rate in Hz and the number of frames (0 = unknown)."""
    with _Decoder(path) as decoder:
        return decoder.nominal, decoder.announced


def read_near(path: str | Path, time: float) -> tuple[float, np.ndarray]:
    """The frame nearest to a time of a video that has not been indexed: ``(time in s, upright picture)``.

    Exact where the file has time stamps; what its number is only decoding all frames before it would tell.
    """
    with _Decoder(path) as decoder:
        first = next(iter(decoder), None)
        if first is None:
            raise InputError("not one frame of the video decodes", path, _CONVERT)
        frame, start, pts = first
        best = frame, start
        origin, unit = pts, decoder.unit
        if pts != NO_STAMP and unit > 0:
            decoder.seek(pts + round(time / unit))
        for frame, since, pts in decoder:
            here = (pts - origin) * unit if NO_STAMP not in (pts, origin) else since
            if abs(here - time) < abs(best[1] - time):
                best = frame, here
            if here >= time:
                break
        return best[1], decoder.picture(best[0])


class FrameReader:
    """Random access to the frames of an indexed video, exact by presentation stamp."""

    def __init__(self, index: VideoIndex) -> None:
        self.index = index
        self._decoder: _Decoder | None = None
        self._frames: Iterator[tuple[VideoFrame, float, int]] = iter(())
        self._next = 0

    def frame(self, i: int) -> np.ndarray:
        """Upright picture (H, W, 3) uint8 RGB of decoded frame ``i``."""
        if not 0 <= i < len(self.index.time):
            raise IndexError(f"frame {i} of {len(self.index.time)}")
        if self._decoder is None or not self._next <= i < self._next + _SEQUENTIAL_REACH:
            self._restart(i)
        found = self._advance(i)
        if found is None:  # the seek landed past the frame, or on a stamp the index does not have
            self._restart(0)
            found = self._advance(i)
        if found is None or self._decoder is None:
            raise InputError(f"frame {i} no longer decodes", self.index.source, "check that the file has not changed")
        return self._decoder.picture(found)

    def close(self) -> None:
        """Release the file."""
        if self._decoder is not None:
            self._decoder.close()
            self._decoder = None

    def __enter__(self) -> FrameReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _restart(self, i: int) -> None:
        if self._decoder is None or i == 0 or not self._seekable():
            self.close()
            self._decoder = _Decoder(self.index.source)
            self._next = 0
        if i > 0 and self._seekable():
            self._decoder.seek(int(self.index.pts[i]))
            self._next = -1
        self._frames = iter(self._decoder)

    def _advance(self, i: int) -> VideoFrame | None:
        """The decoded frame ``i``, or None where the decoder is already past it."""
        by_stamp = self._next < 0
        for frame, _, pts in self._frames:
            if by_stamp:
                if pts == self.index.pts[i]:
                    self._next = i + 1
                    return frame
                if pts > self.index.pts[i]:
                    return None
            else:
                self._next += 1
                if self._next == i + 1:
                    return frame
        return None

    def _seekable(self) -> bool:
        return bool((self.index.pts != NO_STAMP).all())


class _Decoder:
    """An open video: iterates ``(frame, time in s, pts)`` and repairs missing or repeated time stamps."""

    def __init__(self, path: str | Path) -> None:
        import av

        self.source = str(path)
        self._error: Any = av.error.FFmpegError
        _check_file(Path(path))
        try:
            # A playlist must not make the reader open other files or addresses.
            self._container = av.open(self.source, options={"protocol_whitelist": "file"})
        except (self._error, ValueError, OSError) as error:
            raise InputError("is not a video that can be read", path, _CONVERT) from error
        pictures = [s for s in self._container.streams.video if not s.disposition & av.stream.Disposition.attached_pic]
        if not pictures:
            self.close()
            raise InputError("holds no video stream", path, "choose the file with the picture in it")
        self._stream = pictures[0]
        self._stream.thread_type = "AUTO"
        rate = self._stream.average_rate or self._stream.guessed_rate
        self.nominal = float(rate) if rate else 30.0
        self.unit = float(self._stream.time_base or 0)
        self.announced = int(self._stream.frames)
        self._damaged = 0
        self._restamped = 0
        self._size = (0, 0)
        self._upright = IDENTITY

    def __enter__(self) -> _Decoder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._container.close()

    def seek(self, pts: int) -> None:
        """Go to the key frame at or before ``pts``."""
        try:
            self._container.seek(pts, stream=self._stream, backward=True)
        except self._error:  # some containers have no way to seek: the caller then reads from the start
            self._container.seek(0)

    def __iter__(self) -> Iterator[tuple[VideoFrame, float, int]]:
        first: int | None = None
        time = -1.0 / self.nominal
        unit = self.unit
        for frame in self._raw():
            pts, previous = frame.pts, time
            if first is None:
                first = 0 if pts is None else pts
            time = -np.inf if pts is None else (pts - first) * unit
            if time <= previous:
                time, pts = previous + 1.0 / self.nominal, NO_STAMP
                self._restamped += 1
            self._measure(frame)
            yield frame, time, NO_STAMP if pts is None else pts

    def picture(self, frame: VideoFrame) -> np.ndarray:
        """Upright picture (H, W, 3) uint8 RGB with square pixels."""
        width, height = self._size if not self._upright.transpose else self._size[::-1]
        stored = frame.reformat(width=width, height=height, format="rgb24").to_ndarray()
        return self._upright.apply(stored)

    def index(self, time: np.ndarray, pts: np.ndarray) -> VideoIndex:
        if not len(time):
            raise InputError("not one frame of the video decodes", self.source, _CONVERT)
        notes = []
        if self._damaged:
            notes.append(f"{self._damaged} damaged or cut-off parts of the video were left out.")
        if self._restamped:
            notes.append(f"{self._restamped} frames without a usable time stamp were spaced at {self.nominal:g} Hz.")
        if self.announced and self.announced != len(time):
            notes.append(f"The file announces {self.announced} frames and holds {len(time)}.")
        rate = 1.0 / float(np.median(np.diff(time))) if len(time) > 1 else self.nominal
        codec = self._stream.codec_context.name
        return VideoIndex(time, pts, self._size, self._upright.turned, rate, codec, tuple(notes), self.source)

    def _raw(self) -> Iterator[VideoFrame]:
        """Every frame that decodes, whatever is broken between them."""
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets)
                frames = packet.decode()
            except (StopIteration, EOFError):
                return
            except self._error:
                self._damaged += 1
                if self._damaged > 10_000:  # a reader that no longer moves forward
                    return
                continue
            for frame in frames:
                self._damaged += int(frame.is_corrupt)
                yield frame

    def _measure(self, frame: VideoFrame) -> None:
        """Take the shape of the upright picture from the first frame, so that all have the same."""
        if self._size != (0, 0):
            return
        self._upright = Upright.of(frame)
        aspect = float(self._stream.sample_aspect_ratio or 1) or 1.0
        size = (max(1, round(frame.width * aspect)), frame.height)
        self._size = size[::-1] if self._upright.transpose else size


def _check_file(path: Path) -> None:
    if not path.exists():
        raise InputError("there is no such file", path, "check the name of the video")
    if not path.is_file():
        raise InputError("is not a file", path, "choose a video file")
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise InputError("may not be read", path, "check the permissions of the file") from error
    if empty:
        raise InputError("the file is empty", path, "copy the video again")
