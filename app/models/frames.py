"""The frames of the video at once, wherever the clock jumps: decoded one time in the background, kept compressed."""

from __future__ import annotations

import tempfile
import threading
from bisect import bisect_left
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from markerscope.app.models.signal import Signal
from markerscope.solver.core.errors import InputError, MarkerscopeError

_LONGEST_SIDE = 1920
"""px; a larger picture would take longer to unpack than a step of the clock may."""
_QUALITY = 90
_UNPACKED = 8
_TOO_FAR_S = 0.5
"""A frame that the decoding reaches sooner than after this much of the video is waited for."""


@dataclass(frozen=True, eq=False)
class VideoFrame:
    """A picture of the video.

    Attributes
    ----------
    picture : (H, W, 3) uint8 RGB, upright; may be smaller than the video's
    time : s in the video's clock, its own
    number : of the frame, counted by decoding; None while that is not known
    size : (width, height) px of the video's frames, which landmarks are measured in
    """

    picture: np.ndarray
    time: float
    number: int | None
    size: tuple[int, int]


class VideoFrames:
    """A video's frames by time. Made once a video; ``close`` ends its thread.

    Parameters
    ----------
    path : the video
    folder : where the compressed frames are kept, the system's temporary folder by default

    Attributes
    ----------
    grown : emitted by ``poll`` when more of the video has been decoded
    arrived : emitted by ``poll`` when a frame that was asked for too early is there
    """

    def __init__(self, path: Path, folder: Path | None = None) -> None:
        self.path = path
        self.grown: Signal[[]] = Signal()
        self.arrived: Signal[[]] = Signal()
        self.problem: MarkerscopeError | None = None
        self.size = (0, 0)
        self._times: list[float] = []
        self._places: list[tuple[int, int]] = []
        self._file: BinaryIO = tempfile.TemporaryFile(dir=folder, prefix="markerscope-")  # noqa: SIM115
        self._unpacked: OrderedDict[int, np.ndarray] = OrderedDict()
        self._wanted: float | None = None
        self._peeked: VideoFrame | None = None
        self._news = self._told = 0
        self._peek_news = False
        self._rate, self._announced = 30.0, 0
        self._done = False
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="video frames", daemon=True)
        self._peeker = threading.Thread(target=self._peek, name="video peek", daemon=True)
        self._thread.start()
        self._peeker.start()

    @property
    def done(self) -> bool:
        """Whether all of the video has been decoded, so that every time is known and no frame is waited for."""
        return self._done

    @property
    def part(self) -> float:
        """0..1 of the video that is decoded, as far as can be told."""
        with self._lock:
            return 1.0 if self._done else min(len(self._times) / max(self._announced, 1), 0.99)

    @property
    def times(self) -> np.ndarray:
        """(F,) s of every frame; those not decoded yet are where the file's announcement puts them."""
        with self._lock:
            known = np.array(self._times)
            more = 0 if self._done else self._announced - len(known)
            if more <= 0:
                return known
            last = known[-1] if len(known) else -1 / self._rate
            return np.concatenate([known, last + np.arange(1, more + 1) / self._rate])

    def at(self, time: float) -> VideoFrame | None:
        """The frame nearest to a time, s in the video's clock; None while it is being fetched (``arrived`` follows)."""
        with self._lock:
            reached = self._done or (bool(self._times) and self._times[-1] >= time)
            if reached and self._times:
                number = _nearest(self._times, time)
                self._wanted = None
            else:
                peeked = self._peeked
                if peeked is not None and abs(peeked.time - time) <= 0.51 / self._rate:
                    return peeked
                self._wanted = time
                return None
        return self._frame(number)

    def frame(self, number: int) -> VideoFrame | None:
        """A frame by its number; None if it has not been decoded, or there is none."""
        with self._lock:
            if not 0 <= number < len(self._times):
                return None
        return self._frame(number)

    def poll(self) -> None:
        """Tell what has arrived since the last call, on the caller's thread."""
        with self._lock:
            grown, arrived = self._news > self._told, self._peek_news
            if self._wanted is not None and self._times and self._times[-1] >= self._wanted:
                arrived, self._wanted = True, None
            self._told, self._peek_news = self._news, False
        if grown:
            self.grown.emit()
        if arrived:
            self.arrived.emit()

    def close(self) -> None:
        """End the threads and give the space back."""
        self._stop.set()
        self._thread.join()
        self._peeker.join()
        with self._lock:
            self._file.close()
            self._unpacked.clear()

    def _frame(self, number: int) -> VideoFrame:
        import cv2

        with self._lock:
            picture = self._unpacked.get(number)
            if picture is None:
                place, length = self._places[number]
                self._file.seek(place)
                packed = self._file.read(length)
            else:
                self._unpacked.move_to_end(number)
        if picture is None:
            stored = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_COLOR)
            assert stored is not None
            picture = cv2.cvtColor(stored, cv2.COLOR_BGR2RGB)
            with self._lock:
                self._unpacked[number] = picture
                if len(self._unpacked) > _UNPACKED:
                    self._unpacked.popitem(last=False)
        return VideoFrame(picture, self._times[number], number, self.size)

    def _run(self) -> None:
        """Decode, compress, keep."""
        from markerscope.solver.video.frames import announced, read_frames

        try:
            rate, count = announced(self.path)
            with self._lock:
                self._rate, self._announced, self._news = rate, count, 1
            for _, time, picture in read_frames(self.path):
                if self._stop.is_set():
                    return
                packed = _packed(picture)
                with self._lock:
                    self.size = picture.shape[1], picture.shape[0]
                    place = self._file.seek(0, 2)
                    self._file.write(packed)
                    self._places.append((place, len(packed)))
                    self._times.append(time)
                    self._news += 1
            if not self._times:
                raise InputError("not one frame of the video decodes", self.path, "convert it to MP4 with H.264")
        except MarkerscopeError as error:
            self.problem = error
        except OSError as error:
            self.problem = InputError(f"its frames cannot be kept: {error.strerror}", self.path, "free some disk space")
        with self._lock:
            self._done = True
            self._news += 1

    def _peek(self) -> None:
        """Fetch the frame that is wanted from where the decoding has not come yet."""
        from markerscope.solver.video.frames import read_near

        while not self._stop.wait(0.02) and not self._done:
            with self._lock:
                wanted = self._wanted
                last = self._times[-1] if self._times else 0.0
                known = self._peeked
            if wanted is None or wanted - last < _TOO_FAR_S:
                continue
            if known is not None and abs(known.time - wanted) <= 0.51 / self._rate:
                continue
            try:
                time, picture = read_near(self.path, wanted)
            except MarkerscopeError:  # the thread that decodes all will say so
                return
            with self._lock:
                self._peeked = VideoFrame(_small(picture), time, None, (picture.shape[1], picture.shape[0]))
                self._peek_news = True
                if self._wanted == wanted:  # what is there is the nearest there is
                    self._wanted = None


def _nearest(times: list[float], time: float) -> int:
    after = min(bisect_left(times, time), len(times) - 1)
    return after - 1 if after > 0 and time - times[after - 1] <= times[after] - time else after


def _small(picture: np.ndarray) -> np.ndarray:
    import cv2

    height, width = picture.shape[:2]
    scale = _LONGEST_SIDE / max(height, width)
    if scale >= 1:
        return picture
    return cv2.resize(picture, (round(scale * width), round(scale * height)), interpolation=cv2.INTER_AREA)


def _packed(picture: np.ndarray) -> bytes:
    import cv2

    stored = cv2.cvtColor(_small(picture), cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".jpg", stored, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1])
