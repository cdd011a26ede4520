"""Whatever cannot be read or written is said in the window in one sentence, and nothing is lost by it."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from markerscope.app.models import edits
from markerscope.app.models.demo import DEMO_MARKERS
from markerscope.app.models.imports import new_session
from markerscope.app.window.main import MainWindow
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.export_csv import write_markers_csv
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.pipeline.session import InputFile, Session, save_session

Spin = Callable[..., None]


def only_error(window: MainWindow) -> str:
    """The one error that the window shows, which is put away."""
    shown = [message for message in window.messages.messages() if message.level == "error"]
    assert len(shown) == 1, [message.what for message in shown]
    sentence = next(row.sentence() for row in window.messages.rows() if row.message is shown[0])
    assert window.messages.isVisible() and "Traceback" not in sentence and "\n" not in sentence
    assert shown[0].remedy, f"what to do is said too: {sentence}"
    window.messages.clear()
    return sentence


def decided(window: MainWindow, folder: Path, spin: Spin) -> Session:
    """A session with a decision that was not saved."""
    window.open_path(folder)
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    session = window.bench.document.session
    window.bench.document.apply(edits.set_value(session, "fit", "video_share", 0.3))
    return window.bench.document.session


def test_files_that_cannot_be_opened(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    window = open_window(real=True)
    mine = decided(window, session.folder, spin)
    window.asks.save_first = lambda: False  # type: ignore[method-assign]
    whole = DEMO_MARKERS.read_bytes()
    (tmp_path / "half.c3d").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "head.c3d").write_bytes(whole[:300])
    (tmp_path / "empty.trc").write_bytes(b"")
    (tmp_path / "words.csv").write_text("a,b,c\n1,2,3\n")
    newer = tmp_path / "newer.markerscope"
    newer.mkdir()
    text = (session.folder / "session.toml").read_text()
    (newer / "session.toml").write_text(text.replace("schema = 1", "schema = 99"))
    broken = tmp_path / "broken.markerscope"
    broken.mkdir()
    (broken / "session.toml").write_text(text[: len(text) // 2] + "\n[[[")
    for path, words in {
        tmp_path / "half.c3d": "is cut off after frame",
        tmp_path / "head.c3d": "is cut off within the C3D header",
        tmp_path / "empty.trc": "the file is empty",
        tmp_path / "words.csv": "has no header that names markers",
        tmp_path / "absent.c3d": "there is no such marker file",
        newer: "update Markerscope",
        broken: "is not a session file",
    }.items():
        window.open_path(path)
        sentence = only_error(window)
        assert words.lower() in sentence.lower() and path.name in sentence, sentence
        assert window.bench.document.session == mine, "what was open stays as it was"


def test_a_video_that_cannot_be_decoded(open_window: Callable[..., MainWindow], spin: Spin, tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    film.write_bytes(b"not a video" * 1000)
    window = open_window()
    window.asks.how_to_import = lambda path: new_session(path, video=film)  # type: ignore[attr-defined,method-assign]
    window.open_path(DEMO_MARKERS)
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    spin(lambda: window.bench.frames is not None and window.bench.frames.done, "the video")
    assert "film.mp4: is not a video that can be read" in only_error(window)
    assert window.bench.runner.run(["landmarks"])
    spin(lambda: not window.bench.runner.running, "the run")
    assert window.bench.board.state("landmarks") == "failed"
    assert "film.mp4: is not a video that can be read" in only_error(window)
    spin(lambda: window.stages.card("landmarks") is not None)
    window.bench.document.apply(edits.set_input(window.bench.document.session, "video_file", None))
    assert window.bench.frames is None and window.bench.board.state("markers") == "cached"
    window.bench.document.undo()
    assert window.bench.document.session.inputs["video_file"].path == film


def test_a_video_that_is_gone_when_its_session_is_opened_again(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    film = Path(shutil.copy(session.inputs["video_file"].path, tmp_path / "film.mp4"))
    save_session(replace(session, inputs={**session.inputs, "video_file": InputFile(film)}))
    moved = film.rename(tmp_path / "moved.mp4")
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: window.bench.frames is None or window.bench.frames.done, "the video")
    sentence = only_error(window)
    assert "film.mp4: there is no such file" in sentence
    assert window.bench.document.is_open and not window.bench.document.dirty
    window.table.trigger("run.all")
    assert any("film.mp4" in message.what + message.where for message in window.messages.messages())
    window.asks.file_to_open = lambda what: moved  # type: ignore[method-assign]
    assert window.table.trigger("input.video")
    states = {name: window.bench.board.state(name) for name in window.bench.board.names}
    assert set(states.values()) == {"cached"}, f"nothing has to be computed again: {states}"
    spin(lambda: window.shown.track is not None, "the fit")


def test_a_marker_file_that_has_other_markers_than_the_results_speak_of(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    markers = load_markers(session.inputs["marker_file"].path)
    few = tmp_path / "few.csv"
    write_markers_csv(few, Markers(markers.positions[:, :7], markers.rate, markers.labels[:7]))
    window = open_window()
    window.open_path(session.folder)  # where the results were in force once
    spin(lambda: window.shown.track is not None, "the fit")
    assert window.table.trigger("session.close")
    save_session(replace(session, inputs={**session.inputs, "marker_file": InputFile(few)}))
    window.open_path(session.folder)
    spin(lambda: window.shown.markers is not None, "the markers")
    window.bench.selection.select(candidate=1)
    for name in window.docks.docks:
        window.raise_dock(name)
        spin()
    spin(lambda: window.shown.get("angles") is not None, "what can still be shown")
    assert not window.messages.messages(), "nothing that is shown counts on markers that are gone"
    assert window.shown.markers is not None and window.shown.markers.positions.shape[1] == 7
    assert window.shown.track is None and window.bench.board.state("fit") == "stale"


def test_places_that_cannot_be_written_to(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    window = open_window()
    mine = decided(window, session.folder, spin)
    in_the_way = tmp_path / "file"
    in_the_way.write_text("no folder")
    window.asks.folder_to_save = lambda name: in_the_way / "x.markerscope"  # type: ignore[method-assign]
    assert not window.table.trigger("session.save_as")
    assert "a part of its path is a file" in only_error(window)
    assert window.bench.document.session == mine and window.bench.document.dirty
    window.bench.document.undo()
    spin(lambda: window.shown.get("angles") is not None, "the results")
    window.asks.what_to_export = lambda: (in_the_way / "out", ["angles"])  # type: ignore[method-assign]
    assert not window.table.trigger("export.files")
    assert "file" in only_error(window)
    for action, name in (("export.picture", "a.png"), ("export.turntable", "a.mp4"), ("export.angles", "a.csv")):
        window.asks.file_to_save = lambda proposed, name=name: in_the_way / name  # type: ignore[method-assign,misc]
        assert not window.table.trigger(action)
        sentence = only_error(window)
        assert len(re.findall("cannot be", sentence)) == 1 and sentence.startswith(str(in_the_way)), sentence


def test_a_folder_that_may_only_be_read(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a read-only share; what refuses is put in the place of the system, since an administrator may do all."""
    window = open_window()
    mine = decided(window, session.folder, spin)
    kept = (session.folder / "session.toml").read_bytes()
    really = os.replace

    def refuse(source: str | Path, target: str | Path) -> None:
        if Path(target).parent == session.folder:
            raise OSError(30, "Read-only file system")
        really(source, target)

    monkeypatch.setattr(os, "replace", refuse)
    assert not window.table.trigger("session.save")
    assert "the disk is read-only" in only_error(window)
    assert window.bench.document.dirty and window.bench.document.session == mine
    assert (session.folder / "session.toml").read_bytes() == kept
    assert not [path for path in session.folder.iterdir() if path.name.startswith(".session")]
    monkeypatch.undo()
    assert window.table.trigger("session.save") and not window.bench.document.dirty


def test_a_wrong_body_is_said_once_and_not_taken(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    wrong = tmp_path / "body.npz"
    wrong.write_bytes(b"no body")
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: window.shown.track is not None, "the fit")
    before = window.bench.document.session
    window.asks.file_to_open = lambda what: wrong  # type: ignore[method-assign]
    assert not window.table.trigger("input.body")
    assert "body.npz" in only_error(window)
    assert window.bench.document.session == before and not window.bench.document.dirty
    for _ in range(5):
        window.bench.clock.step(1)
        spin()
    assert not window.messages.messages()


def test_a_body_that_is_spoilt_later_is_said_once(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    wrong = tmp_path / "body.npz"
    wrong.write_bytes(b"no body")
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: window.shown.track is not None, "the fit, which was in force")
    window.bench.close()
    save_session(replace(session, inputs={**session.inputs, "body_file": InputFile(wrong)}))
    window.open_path(session.folder)
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    for _ in range(8):
        window.bench.clock.step(1)
        spin()
    assert "body.npz" in only_error(window)
    assert window.shown.track is None and window.shown.get("markers") is not None
    window.bench.document.apply(edits.set_input(window.bench.document.session, "body_file", None))
    spin(lambda: window.shown.track is not None, "the fit on the program's own body")
