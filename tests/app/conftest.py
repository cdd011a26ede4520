"""One short session, solved once a test run: what the models and views of the window are tried on."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
from markerscope.app.models.results import Results, StageResults
from markerscope.solver.core.request import Method
from markerscope.solver.pipeline.methods import graph_of, with_method
from markerscope.solver.pipeline.run import keys_of, run_session
from markerscope.solver.pipeline.session import InputFile, Session, load_session, save_session

RANGE = 2.0, 3.0
"""s of the embedded session."""
OFFSET = 0.37
"""s, its true one: a second is too short to find it in."""
_SETTINGS: dict[Method, Mapping[str, Mapping[str, Any]]] = {
    "bundle": {
        "landmarks": {"rate": 10.0},
        "localize": {"few": 6, "many": 10, "keep": 8},
        "orient": {"refine": 2},
    },
    "paper": {
        "landmarks": {"rate": 10.0},
        "localize": {"rate": 5.0, "iterations": 3, "search_always": True},
        "solve": {"yaws": 2, "iterations": 4},
    },
}


def _once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """A folder made once a test run, whichever of the processes that share the run comes first."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    done, lock = folder.with_suffix(".done"), folder.with_suffix(".lock")
    while not done.exists():
        try:
            lock.mkdir()
        except FileExistsError:
            time.sleep(0.1)
            continue
        try:
            if not done.exists():
                make(folder)
                done.touch()
        finally:
            lock.rmdir()
    return folder


def _solve(folder: Path, method: Method, known: Path | None = None) -> None:
    if known is not None:  # what both methods have in common is not computed twice
        shutil.copytree(known / "results", folder / "results")
    inputs = {"marker_file": InputFile(DEMO_MARKERS), "video_file": InputFile(DEMO_VIDEO)}
    edits = {"markers": dict(zip(("start", "stop"), RANGE)), "sync": {"offset": OFFSET}}
    session = with_method(Session(folder, inputs, edits=edits), method)
    session = replace(session, settings=_SETTINGS[method])
    run_session(session)
    save_session(session)


def _copy(made: Path, to: Path) -> Session:
    """A copy of a session that may be changed; paths in its file are relative and are written anew."""
    shutil.copytree(made, to)
    session = replace(load_session(made), folder=to)
    save_session(session)
    return session


@pytest.fixture(scope="session")
def solved_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Session folder with the results of every stage of the default method; not to be changed."""
    return _once(tmp_path_factory, "solved.markerscope", lambda folder: _solve(folder, "bundle"))


@pytest.fixture(scope="session")
def paper_folder(solved_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same by the published method, after a few iterations; not to be changed."""
    return _once(tmp_path_factory, "paper.markerscope", lambda folder: _solve(folder, "paper", solved_folder))


@pytest.fixture
def session(solved_folder: Path, tmp_path: Path) -> Session:
    """A solved session to change at will."""
    return _copy(solved_folder, tmp_path / "mine.markerscope")


@pytest.fixture
def paper_session(paper_folder: Path, tmp_path: Path) -> Session:
    """One solved by the published method, to change at will."""
    return _copy(paper_folder, tmp_path / "paper.markerscope")


@pytest.fixture(scope="session")
def results(solved_folder: Path) -> StageResults:
    """The results of every stage of the default method, by name."""
    return results_of(load_session(solved_folder))


@pytest.fixture(scope="session")
def paper_results(paper_folder: Path) -> StageResults:
    """The results of every stage of the published method, by name."""
    return results_of(load_session(paper_folder))


def results_of(session: Session) -> StageResults:
    """What a session's settings, as they are, have for results."""
    keys = keys_of(session)
    assert keys.keys() == {stage.name for stage in graph_of(session)}
    return Results(session.store).of(keys)
