"""One clock: times, frames of both streams, playing that goes by the computer's clock, loops and speeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.app.models.clock import SPEEDS, Clock, Timing

VIDEO = np.arange(300) / 30
TIMING = Timing(first=2.0, rate=100.0, frames=301, video=VIDEO, offset=0.37)


@pytest.fixture
def clock() -> Clock:
    return Clock(TIMING)


def test_it_begins_at_the_first_frame(clock: Clock) -> None:
    assert (clock.time, clock.marker_frame, clock.span) == (2.0, 0, (2.0, 5.0))


@given(st.integers(0, 300), st.floats(-0.49, 0.49))
def test_a_time_shows_the_nearest_marker_frame(frame: int, part: float) -> None:
    assert TIMING.marker_frame(2.0 + (frame + part) / 100) == frame
    clock = Clock(TIMING)
    clock.seek(2.0 + (frame + part) / 100)
    assert clock.marker_frame == frame
    assert clock.time == pytest.approx(2.0 + frame / 100, abs=1e-12), "it stands on a frame, not beside it"


@given(st.floats(0.40, 10.2), st.floats(0.99, 1.01))
def test_a_time_shows_the_nearest_video_frame(time: float, ratio: float) -> None:
    timing = Timing(frames=2000, video=VIDEO, offset=0.37, rate_ratio=ratio)
    frame = timing.video_frame(time)
    distances = np.abs(ratio * VIDEO + 0.37 - time)
    assert frame is None or distances[frame] == pytest.approx(distances.min(), abs=1e-9)
    assert (frame is None) <= (distances.min() > 0.5 / 30.5 * ratio)


def test_there_is_no_frame_outside_a_stream() -> None:
    assert TIMING.marker_frame(1.99) is None
    assert TIMING.marker_frame(5.006) is None
    assert TIMING.video_frame(0.37 - 0.02) is None
    assert TIMING.video_frame(0.37 - 0.01) == 0
    assert TIMING.video_frame(0.37 + 299 / 30 + 0.02) is None
    assert Timing(frames=10).video_frame(0.05) is None


@pytest.mark.parametrize("frame", [60, 100, 139])
def test_a_video_frame_that_is_sought_is_shown(clock: Clock, frame: int) -> None:
    clock.seek_video_frame(frame)
    assert clock.video_frame == frame, "markers are three times as frequent, so every video frame can be reached"


def test_a_rate_of_29_97_drifts_as_it_should() -> None:
    timing = Timing(frames=60001, video=np.arange(18000) / 30, rate_ratio=30 / 29.97)
    assert timing.video_frame(600.0) == round(600 * 29.97)


def test_stepping_stops_and_stays_inside(clock: Clock) -> None:
    clock.play()
    clock.step(10)
    assert (clock.playing, clock.marker_frame) == (False, 10)
    clock.step(-1)
    assert clock.marker_frame == 9
    clock.step(-100)
    assert clock.marker_frame == 0
    clock.end()
    clock.step(1)
    assert clock.marker_frame == 300


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("ticks", [(0.01, 0.02, 0.03, 0.5), (0.5,)])
def test_playing_goes_by_the_computers_clock_whatever_it_drops(clock: Clock, speed: float, ticks: tuple) -> None:
    clock.set_speed(speed)
    clock.play()
    for now in (100.0, *(100 + t for t in ticks)):
        clock.tick(now)
    assert clock.time == pytest.approx(2.0 + 0.5 * speed)


def test_it_stops_at_the_end_and_begins_again_from_the_start(clock: Clock) -> None:
    clock.play()
    clock.tick(0.0)
    clock.tick(99.0)
    assert (clock.playing, clock.time) == (False, 5.0)
    clock.play()
    assert (clock.playing, clock.time) == (True, 2.0)


def test_a_loop_goes_round(clock: Clock) -> None:
    clock.set_loop((4.0, 3.0))
    assert clock.loop == (3.0, 4.0)
    clock.play()
    assert clock.time == 3.0
    clock.tick(0.0)
    clock.tick(0.75)
    clock.tick(1.25)
    assert clock.time == pytest.approx(3.25)
    clock.tick(1.50)
    assert clock.time == pytest.approx(3.5)
    clock.set_loop((7.0, 8.0))
    assert clock.loop is None, "nothing of it is in the recording"


def test_seeking_while_it_plays_goes_on_from_there(clock: Clock) -> None:
    clock.play()
    clock.tick(0.0)
    clock.tick(0.5)
    clock.seek(4.0)
    clock.tick(0.6)
    clock.tick(0.7)
    assert clock.playing
    assert clock.time == pytest.approx(4.1)


def test_stopping_stands_on_a_frame(clock: Clock) -> None:
    clock.play()
    clock.tick(0.0)
    clock.tick(0.1234)
    clock.stop()
    assert clock.time == pytest.approx(2.12)


def test_speeds_go_up_and_down_to_their_ends(clock: Clock) -> None:
    for _ in SPEEDS:
        clock.faster()
    assert clock.speed == SPEEDS[-1]
    for _ in range(2 * len(SPEEDS)):
        clock.slower()
    assert clock.speed == SPEEDS[0]


def test_moving_the_video_moves_no_time(clock: Clock) -> None:
    heard: list[str] = []
    clock.seek(3.0)
    clock.moved.connect(lambda time: heard.append("moved"))
    clock.changed.connect(lambda: heard.append("changed"))
    before = clock.video_frame
    clock.set_sync(0.37 + 1.0)
    assert (heard, clock.time) == (["changed"], 3.0)
    assert before is not None
    assert clock.video_frame == before - 30
    clock.set_sync(0.37 + 1.0)
    assert heard == ["changed"]


def test_moved_is_told_once_a_move(clock: Clock) -> None:
    heard: list[float] = []
    clock.moved.connect(heard.append)
    clock.seek(3.0)
    clock.seek(3.0)
    clock.seek(float("nan"))
    assert heard == [3.0]


def test_without_markers_it_does_not_run() -> None:
    clock = Clock()
    clock.play()
    clock.step(1)
    assert (clock.playing, clock.time, clock.marker_frame) == (False, 0.0, None)


def test_other_data_keeps_time_and_loop_inside(clock: Clock) -> None:
    clock.seek(5.0)
    clock.set_loop((2.5, 5.0))
    clock.set_timing(Timing(first=2.0, rate=100.0, frames=101))
    assert (clock.time, clock.loop) == (3.0, (2.5, 3.0))


NTSC = np.arange(18_000) * 1001 / 30_000  # s, the stamps of a video at 29.97 frames a second


def test_29_97_against_30_is_told_apart_at_every_frame() -> None:
    """Markers at 30 Hz and the video at 29.97: after 33.4 s one frame more of the markers has passed."""
    clock = Clock(Timing(rate=30.0, frames=18_001, video=NTSC))
    for frame in (0, 1, 500, 1_000, 1_002, 9_000, 17_999):
        clock.seek_marker_frame(frame)
        assert clock.marker_frame == frame
        assert clock.video_frame == round(frame / 30 * 29.97002997), frame
        assert abs(NTSC[clock.video_frame] - clock.time) <= 1001 / 60_000 + 1e-9
    assert clock.video_frame == 17_981, "the streams are eighteen frames apart, and the readouts say so"


@given(st.floats(0.0, 3.0), st.sampled_from(SPEEDS), st.floats(0.0, 0.02))
def test_playing_shows_what_seeking_shows(seconds: float, speed: float, jitter: float) -> None:
    """Wherever playing is after some seconds, whatever was dropped, both streams show what a seek there shows."""
    playing, sought = Clock(TIMING), Clock(TIMING)
    playing.set_speed(speed)
    playing.play()
    playing.tick(50.0)
    playing.tick(50.0 + seconds / speed * 0.4 + jitter)
    playing.tick(50.0 + seconds / speed)
    assert playing.time == pytest.approx(min(2.0 + seconds, 5.0), abs=1e-9)
    sought.seek(playing.time)  # to the last bit: half-way between two frames it decides
    playing.stop()
    assert (playing.marker_frame, playing.video_frame) == (sought.marker_frame, sought.video_frame)


@given(st.floats(2.0, 4.5), st.floats(0.05, 0.5), st.sampled_from(SPEEDS), st.lists(st.floats(0.001, 0.4), max_size=30))
def test_a_loop_is_never_left(start: float, length: float, speed: float, steps: list[float]) -> None:
    clock = Clock(TIMING)
    clock.set_loop((start, start + length))
    clock.set_speed(speed)
    clock.play()
    now = 0.0
    assert clock.loop is not None
    for step in steps:
        now += step
        clock.tick(now)
        assert clock.playing and clock.loop[0] - 1e-9 <= clock.time <= clock.loop[1] + 1e-9
    assert clock.home() is None and clock.time == pytest.approx(clock.loop[0], abs=0.006)
    clock.end()
    assert clock.time == pytest.approx(clock.loop[1], abs=0.006)
