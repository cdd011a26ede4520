"""Watching a video that is stopped: what was seen is kept, and the end is the same, bit for bit."""

from __future__ import annotations

import os
import shutil
import signal
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.resources import resource
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import run_graph
from markerscope.solver.pipeline.store import Store
from markerscope.solver.pipeline.worker import Job, WorkerDied
from markerscope.solver.video import blazepose, watched
from tests.pipeline import jobs

VIDEO = resource("demo", "video.mp4")
PART = "landmarks.part"


def look(root: Path, progress: Progress = silent, video: Path = VIDEO) -> Landmarks:
    source = {"video_file": Source.file(video)}
    found = run_graph(jobs.LANDMARKS, source, jobs.RARELY, Store(root), progress=progress)["landmarks"]
    assert isinstance(found, Landmarks)
    return found


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Landmarks:
    return look(tmp_path_factory.mktemp("whole"))


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watched, "PIECE", 4)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One entry for every picture that the network looks at."""
    pictures: list[int] = []
    follow = blazepose.Tracker.__call__

    def noted(self: blazepose.Tracker, picture: np.ndarray) -> Any:
        pictures.append(1)
        return follow(self, picture)

    monkeypatch.setattr(blazepose.Tracker, "__call__", noted)
    return pictures


def same(a: Landmarks, b: Landmarks) -> bool:
    def bits(landmarks: Landmarks) -> list[object]:
        values = [getattr(landmarks, field.name) for field in fields(landmarks)]
        return [(v.dtype, v.shape, v.tobytes()) if isinstance(v, np.ndarray) else v for v in values]

    return bits(a) == bits(b)


def rows(root: Path) -> int:
    """How many rows are kept, in all."""
    store = Store(root)
    return sum(len(store.get(PART, e.key, watched.Piece).landmarks.frame) for e in store.list(PART))


@pytest.mark.parametrize("error", [Cancelled, KeyboardInterrupt])
@pytest.mark.parametrize("after", [1, 8, 11])
def test_a_run_that_was_stopped_goes_on(
    tmp_path: Path, whole: Landmarks, seen: list[int], after: int, error: type[BaseException]
) -> None:
    def stop(fraction: float, text: str) -> None:
        if len(seen) >= after:
            raise error()

    with pytest.raises(error):
        look(tmp_path, stop)
    assert rows(tmp_path) == len(seen) == after
    assert not list(tmp_path.rglob(".tmp-*"))
    told: list[tuple[float, str]] = []
    again = look(tmp_path, lambda fraction, text: told.append((fraction, text)))
    assert len(seen) == len(whole.frame), "nothing was looked at twice"
    assert same(again, whole)
    assert any(text.startswith("going on from video frame") for _, text in told)
    assert [fraction for fraction, _ in told] == sorted(fraction for fraction, _ in told)
    assert not (tmp_path / PART).exists(), "the pieces are of no more use"


def test_a_run_that_is_stopped_again_and_again_ends_the_same(tmp_path: Path, whole: Landmarks, seen: list[int]) -> None:
    stops = iter(range(3, len(whole.frame), 7))
    target = next(stops)

    def stop(fraction: float, text: str) -> None:
        nonlocal target
        if len(seen) >= target:
            target = next(stops, 10**9)
            raise Cancelled()

    for _ in range(len(whole.frame)):
        try:
            found = look(tmp_path, stop)
            break
        except Cancelled:
            continue
    assert same(found, whole) and len(seen) == len(whole.frame)


def test_a_process_that_is_killed_leaves_whole_pieces(tmp_path: Path, whole: Landmarks, seen: list[int]) -> None:
    store = Store(tmp_path)
    job = Job(jobs.watch, tmp_path, VIDEO, store=store)
    while job.running and len(store.list(PART)) < 2:
        time.sleep(0.005)
    os.kill(job._process.pid, signal.SIGKILL)
    with pytest.raises(WorkerDied):
        job.result()
    assert not list(tmp_path.rglob(".tmp-*"))
    kept = rows(tmp_path)
    assert 8 <= kept < len(whole.frame) and kept % 4 == 0
    assert len(store.list(PART)) == len(list((tmp_path / PART).iterdir())), "none is half-written"
    assert same(look(tmp_path), whole)
    assert len(seen) == len(whole.frame) - kept


def test_a_damaged_piece_is_seen_again(tmp_path: Path, whole: Landmarks, seen: list[int]) -> None:
    def stop(fraction: float, text: str) -> None:
        if len(seen) >= 12:
            raise Cancelled()

    with pytest.raises(Cancelled):
        look(tmp_path, stop)
    second = Store(tmp_path).list(PART)[1]
    arrays = second.folder / "arrays.npz"
    arrays.write_bytes(arrays.read_bytes()[:-1])
    seen.clear()
    assert same(look(tmp_path), whole)
    assert len(seen) == len(whole.frame) - 4


def test_pieces_of_another_video_or_rate_are_not_gone_on_from(tmp_path: Path, seen: list[int]) -> None:
    def stop(fraction: float, text: str) -> None:
        if len(seen) >= 5:
            raise Cancelled()

    with pytest.raises(Cancelled):
        look(tmp_path, stop)
    other = tmp_path / "other.mp4"
    other.write_bytes(VIDEO.read_bytes() + b"\0")
    seen.clear()
    with pytest.raises(Cancelled):
        look(tmp_path, stop, other)
    assert len(seen) == 5 and rows(tmp_path) == 10


def test_what_is_kept_of_a_video_that_changes_was_seen_before(
    tmp_path: Path, whole: Landmarks, seen: list[int]
) -> None:
    video = tmp_path / "video.mp4"
    shutil.copy(VIDEO, video)

    def spoil(fraction: float, text: str) -> None:
        if len(seen) == 6:
            with video.open("r+b") as file:
                file.seek(-4, os.SEEK_END)
                file.write(b"\xff\xff\xff\xff")

    with pytest.raises(InputError, match="changed while it was read"):
        look(tmp_path, spoil, video)
    (piece,) = Store(tmp_path).list(PART)
    kept = Store(tmp_path).get(PART, piece.key, watched.Piece).landmarks
    np.testing.assert_array_equal(kept.image, whole.image[:4])
