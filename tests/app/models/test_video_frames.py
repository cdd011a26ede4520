"""The frame shown is the frame of that time: after decoding, before it, and for what is no video."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models.frames import VideoFrames
from markerscope.solver.video.frames import index_video, read_near
from tests.video.test_frames import number, write

STAMPS = np.cumsum([0, *([33, 34, 33, 66] * 40)]).tolist()
"""ms; every fourth frame stays twice as long."""


@pytest.fixture(scope="module")
def video(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("video") / "long.mp4", STAMPS, gop=500)


@pytest.fixture
def frames(video: Path, tmp_path: Path) -> Iterator[VideoFrames]:
    frames = VideoFrames(video, tmp_path)
    yield frames
    frames.close()


def finish(frames: VideoFrames) -> None:
    while not frames.done:
        time.sleep(0.005)


def test_every_time_shows_its_frame_in_any_order(frames: VideoFrames, video: Path) -> None:
    finish(frames)
    known = index_video(video).time
    assert frames.times == pytest.approx(known)
    for i in np.random.default_rng(0).permutation(len(known))[:60]:
        shown = frames.at(known[i] + 0.004)
        assert shown is not None
        assert (shown.number, number(shown.picture)) == (i, i)
        assert shown.time == pytest.approx(known[i])
    assert frames.part == 1.0


def test_before_and_after_the_video_its_ends_are_shown(frames: VideoFrames) -> None:
    finish(frames)
    first, last = frames.at(-5.0), frames.at(1e6)
    assert first is not None
    assert last is not None
    assert (first.number, last.number) == (0, len(STAMPS) - 1)
    assert frames.frame(len(STAMPS)) is None


@pytest.mark.parametrize("i", [0, 1, 37, 100, len(STAMPS) - 1])
def test_a_frame_can_be_had_before_all_are_decoded(video: Path, i: int) -> None:
    found, picture = read_near(video, STAMPS[i] / 1000 + 0.003)
    assert found == pytest.approx(STAMPS[i] / 1000, abs=1e-4)
    assert number(picture) == i


def test_what_is_asked_for_early_arrives(video: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import markerscope.solver.video.frames as source

    read, go = source.read_frames, []

    def slowly(path: Path) -> Iterator:
        for row in read(path):
            yield row
            while row[0] >= 3 and not go:
                time.sleep(0.005)

    monkeypatch.setattr(source, "read_frames", slowly)
    frames, heard = VideoFrames(video, tmp_path), []
    frames.arrived.connect(lambda: heard.append(1))
    try:
        wanted = STAMPS[120] / 1000
        assert frames.at(wanted) is None
        while not heard:
            frames.poll()
            time.sleep(0.005)
        shown = frames.at(wanted)
        assert shown is not None
        assert (shown.number, number(shown.picture)) == (None, 120)
        assert frames.at(STAMPS[60] / 1000) is None, "another frame is not shown in its place"
        assert len(frames.times) == pytest.approx(len(STAMPS), abs=1)
    finally:
        go.append(1)
        finish(frames)
        shown = frames.at(wanted)
        assert shown is not None
        assert shown.number == 120
        frames.close()


def test_growing_is_told_to_who_polls(frames: VideoFrames) -> None:
    heard: list[int] = []
    frames.grown.connect(lambda: heard.append(1))
    finish(frames)
    frames.poll()
    frames.poll()
    assert heard == [1]


def test_what_is_no_video_is_said(tmp_path: Path) -> None:
    path = tmp_path / "text.mp4"
    path.write_text("no video")
    frames = VideoFrames(path)
    finish(frames)
    assert "not a video" in str(frames.problem)
    assert frames.at(0.0) is None
    frames.close()


def test_closing_at_once_is_no_mistake(video: Path) -> None:
    VideoFrames(video).close()
