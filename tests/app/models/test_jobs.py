"""Runs in a real worker process: progress, results as they land, stopping, failures that say what and where."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import pytest

from markerscope.app.models import edits
from markerscope.app.models.document import Document
from markerscope.app.models.home import Home
from markerscope.app.models.jobs import Runner, Running
from markerscope.app.models.results import Ref
from markerscope.app.models.stages import Failure, StageBoard, states_of
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Found
from markerscope.solver.pipeline.session import Session, save_session
from markerscope.solver.pipeline.stage import Event
from markerscope.solver.pipeline.worker import Progressed


@pytest.fixture
def document(session: Session, tmp_path: Path) -> Document:
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    return document


@pytest.fixture
def runner(document: Document) -> Runner:
    return Runner(StageBoard(document))


def finish(runner: Runner) -> None:
    while runner.running:
        runner.poll()
        time.sleep(0.01)


def test_nothing_to_do_starts_nothing(runner: Runner) -> None:
    assert runner.run() is False
    assert not runner.running


def test_what_is_stale_is_run_and_lands(document: Document, runner: Runner) -> None:
    document.apply(edits.set_value(document.session, "angles", "convention", "isb"))
    document.apply(edits.set_value(document.session, "prior", "rate", 25.0))
    landed: list[str] = []
    states: list[str] = []
    seen: list[Running] = []
    runner.landed.connect(lambda ref: landed.append(ref.stage))
    runner.board.changed.connect(lambda: states.append(runner.board.state("prior")))
    runner.progressed.connect(seen.append)
    assert runner.run(["prior"]) is True
    with pytest.raises(InputError, match="running already"):
        runner.run()
    finish(runner)
    assert landed == ["prior"]
    assert "running" in states
    assert states[-1] == "cached"
    assert all(0 <= at.part <= 1 and 0 <= at.whole <= 1 for at in seen)
    assert runner.board.state("angles") == "stale", "only what was asked for"
    assert not (document.folder / "angles.csv").exists(), "a run writes no outputs"


def test_what_is_decided_meanwhile_counts_from_the_next_run_on(document: Document, runner: Runner) -> None:
    document.apply(edits.set_value(document.session, "prior", "rate", 25.0))
    key = runner.board.keys["prior"]
    runner.run(["prior"])
    document.apply(edits.set_value(document.session, "prior", "rate", 26.0))
    finish(runner)
    assert runner.board.state("prior") == "stale"
    assert runner.board.results.has("prior", key)


def test_stopping_leaves_the_store_whole(document: Document, runner: Runner) -> None:
    document.apply(edits.set_value(document.session, "landmarks", "rate", 25.0))
    runner.run()
    while not (runner.at and runner.at.stage == "landmarks"):
        runner.poll()
    assert runner.board.state("landmarks") == "running"
    heard: list[Failure] = []
    runner.failed.connect(heard.append)
    runner.cancel()
    assert (runner.running, heard) == (False, [])
    assert runner.board.state("landmarks") == "stale"
    assert not list(document.folder.rglob(".tmp-*"))
    document.undo()
    assert set(states_of(runner.board).values()) == {"cached"}


def test_a_failure_says_what_where_and_what_to_do(document: Document, runner: Runner) -> None:
    document.apply(edits.set_range(document.session, 900.0, 901.0))
    heard: list[Failure] = []
    runner.failed.connect(heard.append)
    runner.run()
    finish(runner)
    (failure,) = heard
    assert (failure.stage, failure.key) == ("markers", runner.board.keys["markers"])
    assert "no frame lies in the range" in failure.what
    assert failure.where.endswith("session.c3d")
    assert failure.remedy == "choose a range inside it"
    assert runner.board.state("markers") == "failed"
    assert runner.board.card("markers").headline == failure.sentence
    document.undo()
    assert runner.board.state("markers") == "cached"


def test_a_file_that_has_gone_is_said_before_anything_runs(session: Session, tmp_path: Path) -> None:
    gone = {name: replace(file, path=tmp_path / "gone" / file.path.name) for name, file in session.inputs.items()}
    save_session(replace(session, inputs=gone))
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    runner = Runner(StageBoard(document))
    with pytest.raises(InputError, match="there is no such file"):
        runner.run()
    assert not runner.running


class Played:
    """A job whose messages are given."""

    def __init__(self) -> None:
        self.messages: list = []

    def poll(self) -> list:
        arrived, self.messages = self.messages, []
        return arrived


def test_time_left_goes_by_past_runs_and_then_by_this_one(document: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    runner = Runner(StageBoard(document), clock=lambda: now[0])
    job = Played()
    monkeypatch.setattr("markerscope.app.models.jobs.Job", lambda *args, **kwargs: job)
    document.apply(edits.set_value(document.session, "fit", "video_share", 0.5))
    runner.run(["fit", "angles"])
    board = runner.board
    assert runner._work is not None
    runner._work.expected = {"fit": 20.0, "neutral": 0.0, "angles": 10.0}
    cost = {stage.name: stage.cost for stage in board.graph}
    job.messages = [Event("fit", "running", board.keys["fit"])]
    runner.poll()
    assert runner.at is not None
    assert (runner.at.stage, runner.at.seconds_left, runner.at.stage_left) == ("fit", 30.0, 20.0)
    now[0] = 10.0
    half = 0.5 * cost["fit"] / (cost["fit"] + cost["neutral"] + cost["angles"])
    job.messages = [Progressed(half, "half")]
    runner.poll()
    assert runner.at.part == pytest.approx(0.5)
    assert (runner.at.stage_left, runner.at.seconds_left) == (10.0, 20.0)
    job.messages = [Found("candidate", 0, {"energy": 1.0}, "fit", board.keys["fit"])]
    runner.poll()
    assert runner.notes == {
        Ref("fit", board.keys["fit"]): [Found("candidate", 0, {"energy": 1.0}, "fit", board.keys["fit"])]
    }
    job.messages = [Event("fit", "cached", board.keys["fit"], 11.0, computed=True)]
    runner.poll()
    assert runner.notes == {}
