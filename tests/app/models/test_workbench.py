"""The models joined: a session opens as it was left, clock and selection follow the results, files are read at once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models import edits, group_edits
from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
from markerscope.app.models.display import Display
from markerscope.app.models.home import Home
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.session import Session


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Workbench]:
    bench = Workbench(Home(tmp_path / "config", tmp_path / "data"))
    yield bench
    bench.close()


def wait(bench: Workbench, until: Callable[[], object]) -> None:
    for _ in range(50_000):
        if until():
            return
        bench.tick()
        time.sleep(0.005)
    raise AssertionError("it never came")


def settle(bench: Workbench, video: bool = False) -> None:
    wait(bench, lambda: bench.clock.timing.frames > 0 and not bench.reading)
    if video:
        wait(bench, lambda: not bench.busy)


def test_a_marker_file_is_there_to_look_at_before_anything_is_run(bench: Workbench) -> None:
    bench.document.new({"marker_file": DEMO_MARKERS, "video_file": DEMO_VIDEO})
    assert bench.reading
    settle(bench, video=True)
    assert bench.board.state("markers") == "cached"
    assert bench.board.state("segment") == "not run"
    assert bench.clock.span == pytest.approx((0.0, 9.99))
    assert bench.frames is not None
    assert len(bench.clock.timing.video) == len(bench.frames.times) > 0


def test_another_range_is_read_at_once(bench: Workbench) -> None:
    bench.document.new({"marker_file": DEMO_MARKERS})
    settle(bench)
    bench.apply(edits.set_range(bench.document.session, 2.0, 3.0))
    wait(bench, lambda: bench.board.state("markers") == "cached" and bench.clock.timing.frames == 101)
    assert bench.clock.span == pytest.approx((2.0, 3.0))


def test_what_cannot_be_read_is_said_once(bench: Workbench, tmp_path: Path) -> None:
    file = tmp_path / "broken.c3d"
    file.write_bytes(b"no markers at all")
    said: list[Said] = []
    bench.said.connect(said.append)
    bench.document.new({"marker_file": file})
    wait(bench, lambda: not bench.reading)
    bench.tick()
    (error,) = said
    assert (error.level, error.where) == ("error", str(file))
    assert error.remedy
    assert bench.board.state("markers") == "failed"


def test_clock_and_selection_stand_on_the_results(bench: Workbench, session: Session) -> None:
    assert bench.open(session.folder)
    settle(bench, video=True)
    wait(bench, lambda: bench.board.results.is_loaded("fit", bench.board.keys["fit"]))
    bench.tick()
    assert bench.clock.timing.offset == 0.37
    assert bench.clock.marker_frame == 0
    assert bench.clock.video_frame == round((2.0 - 0.37) * 30)
    bench.apply(edits.set_offset(bench.document.session, 0.5))
    assert bench.clock.timing.offset == 0.5, "an offset that is given holds before anything is run"
    bench.document.undo()
    assert bench.clock.timing.offset == 0.37
    bones = bench.board.current["fit"].marker_joint
    bench.selection.select_bone(int(bones[bones >= 0][0]))
    assert bench.selection.markers == set(np.flatnonzero(bones == bench.selection.bone).tolist())
    found, labels = bench.board.current["segment"], bench.board.current["markers"].labels
    bench.selection.select_markers(np.flatnonzero(found.clusters <= 1))
    assert bench.selection.cluster is None
    bench.apply(group_edits.merge(bench.document.session, found, bench.selection.markers, labels))
    assert bench.selection.cluster is not None, "the selection follows the groups at once"
    bench.document.undo()
    assert bench.selection.cluster is None


def test_it_opens_as_it_was_left(bench: Workbench, session: Session, tmp_path: Path) -> None:
    bench.open(session.folder)
    settle(bench)
    bench.clock.seek(2.5)
    bench.clock.set_loop((2.2, 2.8))
    bench.clock.set_speed(0.5)
    bench.selection.select_markers([3, 4])
    bench.display.set(colour_by="bone", opacity=0.3)
    bench.display.toggle("trails")
    bench.board.compare("fit", bench.board.keys["fit"], True)
    bench.remember(camera={"from": [1.0, 2.0, 3.0]})
    compared = set(bench.board.compared)
    bench.close()
    again = Workbench(Home(tmp_path / "config", tmp_path / "data"))
    again.open(session.folder)
    settle(again)
    assert (again.clock.time, again.clock.loop, again.clock.speed) == (2.5, (2.2, 2.8), 0.5)
    assert again.selection.markers == {3, 4}
    assert (again.display.colour_by, again.display.opacity, again.display.layers["trails"]) == ("bone", 0.3, True)
    assert again.board.compared == compared
    assert again.document.view["camera"] == {"from": [1.0, 2.0, 3.0]}
    again.close()


def test_errors_are_said_and_nothing_is_lost(bench: Workbench, session: Session) -> None:
    said: list[Said] = []
    bench.said.connect(said.append)
    assert not bench.open(session.folder / "nothing")
    assert said[-1].level == "error"
    bench.open(session.folder)
    before = bench.document.session
    assert not bench.apply(edits.set_value(before, "orient", "refine", -1))
    assert said[-1].sentence.endswith(".")
    assert bench.document.session == before

    def stumble() -> None:
        raise InputError("jumps", "marker 3", "leave it out")

    assert not bench.attempt(stumble)
    assert said[-1] == Said("error", "jumps", "marker 3", "leave it out")


def test_closing_lets_go_of_everything(bench: Workbench, session: Session) -> None:
    heard: list[bool] = []
    bench.opened.connect(lambda: heard.append(bench.document.is_open))
    bench.open(session.folder)
    settle(bench)
    bench.close()
    assert heard == [True, False]
    assert (bench.frames, bench.board.names, bench.clock.timing.frames) == (None, (), 0)
    assert not bench.busy


def test_recovery_is_told(bench: Workbench, session: Session, tmp_path: Path) -> None:
    bench.open(session.folder)
    bench.apply(edits.set_offset(bench.document.session, 0.5))
    bench.document._writer.flush()
    again = Workbench(Home(tmp_path / "config", tmp_path / "data"))
    said: list[Said] = []
    again.said.connect(said.append)
    again.open(session.folder)
    assert said[-1].level == "note"
    assert "is back" in said[-1].what
    again.close()


def test_the_display_takes_only_what_can_be() -> None:
    display = Display()
    heard: list[set[str]] = []
    display.changed.connect(lambda names: heard.append(set(names)))
    display.restore({"colour_by": "rainbow", "opacity": 7, "follow": 1, "layers": {"body": 0, "nothing": True}})
    assert heard == []
    display.set(opacity=0.25)
    display.toggle("body")
    assert heard == [{"opacity"}, {"layer.body"}]
    other = Display()
    other.restore(display.state())
    assert other.state() == display.state()
