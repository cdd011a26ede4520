"""The one clock of the window: every picture, curve and row is drawn for its time, on the markers' clock."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass, replace

import numpy as np

from markerscope.app.models.signal import Signal

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Times as fast as recorded."""


@dataclass(frozen=True)
class Timing:
    """How the streams lie on the clock.

    Attributes
    ----------
    first : s, time of the first marker frame
    rate : Hz, of the markers
    frames : number of marker frames
    video : (F,) s, time of every video frame in the video's own clock, ascending; empty without a video
    offset, rate_ratio : s and 1: marker time = rate_ratio * video time + offset
    """

    first: float = 0.0
    rate: float = 100.0
    frames: int = 0
    video: tuple[float, ...] | np.ndarray = ()
    offset: float = 0.0
    rate_ratio: float = 1.0

    @property
    def span(self) -> tuple[float, float]:
        """s, time of the first and the last marker frame."""
        return self.first, self.first + max(self.frames - 1, 0) / self.rate

    def marker_frame(self, time: float) -> int | None:
        """The marker frame shown at a time: the nearest; None where there is none within half a frame."""
        frame = math.floor((time - self.first) * self.rate + 0.5)
        return frame if 0 <= frame < self.frames else None

    def time_of_marker(self, frame: int) -> float:
        """s, of a marker frame; beyond the ends, of the first or last."""
        return self.first + min(max(frame, 0), max(self.frames - 1, 0)) / self.rate

    def video_time(self, time: float) -> float:
        """S in the video's clock."""
        return (time - self.offset) / self.rate_ratio

    def video_frame(self, time: float) -> int | None:
        """The video frame shown at a time: the one nearest; None before and after the video."""
        count = len(self.video)
        if not count:
            return None
        sought = self.video_time(time)
        after = int(bisect_left(self.video, sought))
        if after == 0:
            spacing = self.video[1] - self.video[0] if count > 1 else 1 / self.rate
            return 0 if self.video[0] - sought <= spacing / 2 else None
        if after == count:
            spacing = self.video[-1] - self.video[-2] if count > 1 else 1 / self.rate
            return count - 1 if sought - self.video[-1] <= spacing / 2 else None
        return after if self.video[after] - sought < sought - self.video[after - 1] else after - 1

    def time_of_video(self, frame: int) -> float:
        """S on the markers' clock, of a video frame."""
        return float(self.rate_ratio * self.video[frame] + self.offset)


class Clock:
    """Time, and whether it runs.

    Attributes
    ----------
    moved : emitted with the new time, s
    changed : emitted when anything else about the clock changed: span, speed, loop, playing, how the streams lie
    """

    def __init__(self, timing: Timing | None = None) -> None:
        self.moved: Signal[[float]] = Signal()
        self.changed: Signal[[]] = Signal()
        self.timing = timing or Timing()
        self.time = self.timing.span[0]
        self.speed = 1.0
        self.loop: tuple[float, float] | None = None
        self.playing = False
        self._from: tuple[float, float] | None = None  # the moment (s of the computer's clock) and time it ran from

    @property
    def span(self) -> tuple[float, float]:
        """s, between which the time moves."""
        return self.timing.span

    @property
    def marker_frame(self) -> int | None:
        """The marker frame shown now."""
        return self.timing.marker_frame(self.time)

    @property
    def video_frame(self) -> int | None:
        """The video frame shown now."""
        return self.timing.video_frame(self.time)

    @property
    def video_time(self) -> float:
        """S in the video's clock, now."""
        return self.timing.video_time(self.time)

    def set_timing(self, timing: Timing) -> None:
        """Lay the streams anew; the time stays where it is, as far as it can."""
        self.timing = timing
        if self.loop is not None:
            self.loop = self._inside(self.loop)
        self.changed.emit()
        self.seek(self.time)

    def set_sync(self, offset: float, rate_ratio: float = 1.0) -> None:
        """Move the video against the markers, s and 1; the picture changes, the time does not."""
        if (offset, rate_ratio) != (self.timing.offset, self.timing.rate_ratio):
            self.timing = replace(self.timing, offset=offset, rate_ratio=rate_ratio)
            self.changed.emit()

    def seek(self, time: float) -> None:
        """Go to the marker frame nearest to a time, s."""
        start, stop = self.span
        if not math.isfinite(time):
            return
        self._from = None
        frame = self.timing.marker_frame(min(max(time, start), stop))
        self._move(start if frame is None else self.timing.time_of_marker(frame))

    def seek_marker_frame(self, frame: int) -> None:
        """Go to a marker frame."""
        self.seek(self.timing.time_of_marker(frame))

    def seek_video_frame(self, frame: int) -> None:
        """Go to the marker frame nearest to a video frame."""
        if 0 <= frame < len(self.timing.video):
            self.seek(self.timing.time_of_video(frame))

    def step(self, frames: int) -> None:
        """Go some marker frames on or back, and stop playing."""
        self.stop()
        here = self.marker_frame
        self.seek_marker_frame((0 if here is None else here) + frames)

    def home(self) -> None:
        """Go to the start of the loop, else of the recording."""
        self.seek(self.loop[0] if self.loop else self.span[0])

    def end(self) -> None:
        """Go to the end of the loop, else of the recording."""
        self.seek(self.loop[1] if self.loop else self.span[1])

    def play(self) -> None:
        """Run, from the start again where the end has been reached."""
        start, stop = self._bounds()
        if self.playing or stop <= start:
            return
        self.playing, self._from = True, None
        if not start <= self.time < stop - 0.5 / self.timing.rate:
            self._move(start)
        self.changed.emit()

    def stop(self) -> None:
        """Stand still, on a marker frame."""
        if self.playing:
            self.playing = False
            self.seek(self.time)
            self.changed.emit()

    def toggle(self) -> None:
        """Play or stop."""
        if self.playing:
            self.stop()
        else:
            self.play()

    def tick(self, now: float) -> None:
        """Let the time be what it has to be by now; frames that there was no time to show are dropped.

        Parameters
        ----------
        now : s, of a clock of the computer's that never goes back
        """
        if not self.playing:
            return
        if self._from is None:
            self._from = now, self.time
            return
        start, stop = self._bounds()
        time = self._from[1] + (now - self._from[0]) * self.speed
        if time < stop:
            self._move(time)
        elif self.loop is not None:
            time = start + (time - start) % (stop - start)
            self._from = now, time
            self._move(time)
        else:
            self._move(stop)
            self.stop()

    def set_speed(self, speed: float) -> None:
        """Run so many times as fast as recorded."""
        if speed > 0 and speed != self.speed:
            self.speed, self._from = speed, None
            self.changed.emit()

    def faster(self) -> None:
        """The next speed above."""
        self.set_speed(SPEEDS[min(bisect_right(SPEEDS, self.speed), len(SPEEDS) - 1)])

    def slower(self) -> None:
        """The next speed below."""
        self.set_speed(SPEEDS[max(bisect_left(SPEEDS, self.speed) - 1, 0)])

    def set_loop(self, loop: tuple[float, float] | None) -> None:
        """Play a range again and again, s; None plays to the end."""
        loop = None if loop is None else self._inside(loop)
        if loop != self.loop:
            self.loop, self._from = loop, None
            self.changed.emit()

    def _inside(self, loop: tuple[float, float]) -> tuple[float, float] | None:
        """A range in order and inside the recording; None if less than a frame of it is."""
        start, stop = (min(max(end, self.span[0]), self.span[1]) for end in sorted(loop))
        return (start, stop) if stop - start >= 1 / self.timing.rate else None

    def _bounds(self) -> tuple[float, float]:
        return self.loop or self.span

    def _move(self, time: float) -> None:
        if time != self.time:
            self.time = time
            self.moved.emit(time)
