"""The board: states from keys, never stale without saying so, earlier results gone back to at once, groups at once."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models import edits, group_edits
from markerscope.app.models.document import Document
from markerscope.app.models.home import Home
from markerscope.app.models.results import Ref
from markerscope.app.models.stages import Failure, StageBoard, states_of
from markerscope.solver.clustering.segment import segment
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.inputs import SyncSettings
from markerscope.solver.pipeline.run import run_session
from markerscope.solver.pipeline.session import InputFile, Session, save_session
from markerscope.solver.sync.offset import Sync

FITTED = {"localize", "orient", "fit", "neutral", "angles", "errors", "surface", "check"}


@pytest.fixture
def document(session: Session, tmp_path: Path) -> Document:
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    return document


@pytest.fixture
def board(document: Document) -> StageBoard:
    return StageBoard(document)


def stale(board: StageBoard) -> set[str]:
    return {name for name, state in states_of(board).items() if state == "stale"}


def test_a_solved_session_is_cached_throughout(board: StageBoard) -> None:
    assert set(states_of(board).values()) == {"cached"}
    assert board.names[:4] == ("markers", "clean", "landmarks", "prior")
    assert board.names[-6:] == ("fit", "neutral", "angles", "errors", "surface", "check")
    card = board.card("fit")
    assert "frames, markers" in card.headline
    assert card.seconds is not None
    assert card.seconds > 0
    assert card.help.startswith("The chosen answer carried to every frame")
    assert [earlier.current for earlier in card.earlier] == [True]
    assert set(board.current) == set(board.names)


def test_no_result_is_in_force_after_a_setting_changed(document: Document, board: StageBoard) -> None:
    document.apply(edits.set_value(document.session, "orient", "offset_mm", 12.0))
    assert stale(board) == FITTED - {"localize"}
    assert not set(board.current) & stale(board)
    assert board.current.get("fit") is None
    key, in_force = board.latest("fit") or ("", True)
    assert not in_force
    assert board.results.has("fit", key)
    card = board.card("fit")
    assert (card.state, card.earlier[0].current) == ("stale", False)
    assert card.earlier[0].settings == "Orientation: offset 9.5 mm"
    document.undo()
    assert stale(board) == set()


def test_an_input_that_changed_makes_stale_what_stands_on_it(
    document: Document, board: StageBoard, tmp_path: Path
) -> None:
    copy = tmp_path / "session.c3d"
    shutil.copy(document.session.inputs["marker_file"].path, copy)
    document.apply(edits.set_input(document.session, "marker_file", copy))
    assert stale(board) == set(), "the same content under another name"
    copy.write_bytes(copy.read_bytes() + b"\0")
    board.refresh()
    assert stale(board) == {"markers", "clean", "segment", "sync"} | FITTED
    assert board.card("markers").earlier[0].settings == "other files"


def test_an_input_that_has_gone_leaves_its_results_to_be_looked_at(session: Session, tmp_path: Path) -> None:
    copy = tmp_path / "session.c3d"
    shutil.copy(session.inputs["marker_file"].path, copy)
    from markerscope.solver.pipeline.digest import file_digest

    inputs = {**session.inputs, "marker_file": InputFile(copy, file_digest(copy))}
    save_session(replace(session, inputs=inputs))
    copy.unlink()
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    board = StageBoard(document)
    assert set(states_of(board).values()) == {"cached"}
    assert "there is no such file" in board.card("fit").why_not
    copy.write_bytes(b"other")
    board.refresh()
    assert board.problem_of(board.names) is None
    assert "markers" in stale(board)


def test_groups_change_at_once_and_are_what_the_stage_would_find(document: Document, board: StageBoard) -> None:
    markers, labels = board.current["markers"], board.current["markers"].labels
    document.apply(group_edits.cut_at(document.session, 0.02))
    assert stale(board) == FITTED
    found = board.current["segment"]
    document.apply(group_edits.split(document.session, found, [int(np.flatnonzero(found.clusters == 0)[0])], labels))
    wanted = segment(markers, board.settings["segment"])
    assert np.array_equal(board.current["segment"].clusters, wanted.clusters)
    assert board.current["segment"].count == wanted.count
    document.apply(edits.set_value(document.session, "segment", "far", 0.0))
    assert "segment" in stale(board), "another tree has to be computed"


def test_an_earlier_result_is_gone_back_to_at_once(document: Document, board: StageBoard) -> None:
    before, key = document.session, board.keys["fit"]
    document.apply(edits.set_value(document.session, "orient", "offset_mm", 12.0))
    document.apply(edits.set_offset(document.session, 0.4))
    document.apply(board.go_back("fit", key))
    assert board.keys["fit"] == key
    assert stale(board) == set()
    assert document.session.edits == before.edits, "what was decided is decided again"
    document.undo()
    assert board.keys["fit"] != key


def test_going_back_to_another_method(document: Document, board: StageBoard) -> None:
    key = board.keys["orient"]
    document.apply(edits.set_method(document.session, "paper"))
    assert "solve" in board.names
    assert stale(board) >= {"localize", "orient", "fit"}
    assert {e.settings for e in board.card("localize").earlier} == {"another method"}
    document.apply(board.go_back("orient", key))
    assert document.session.run.method == "bundle"
    assert (board.keys["orient"], stale(board)) == (key, set())


def test_what_cannot_be_gone_back_to_says_why(document: Document, board: StageBoard, tmp_path: Path) -> None:
    key = board.keys["segment"]
    other = tmp_path / "other.c3d"
    other.write_bytes(document.session.inputs["marker_file"].path.read_bytes() + b"\0")
    document.apply(edits.set_input(document.session, "marker_file", other))
    with pytest.raises(InputError, match="other files"):
        board.go_back("segment", key)
    document.undo()
    shutil.rmtree(board.results.store.root / "markers")
    with pytest.raises(InputError, match="not there any more"):
        board.go_back("segment", key)


def test_two_offsets_can_be_compared(document: Document, board: StageBoard) -> None:
    first = board.keys["sync"]
    document.apply(edits.set_offset(document.session, 0.5))
    run_session(document.session, ["sync"])
    heard: list[int] = []
    board.changed.connect(lambda: heard.append(1))
    board.refresh()
    board.compare("sync", first, True)
    board.compare("sync", first, True)
    board.compare("sync", "no such result", True)
    assert len(heard) == 2
    assert board.compared == {Ref("sync", first)}
    rows = board.card("sync").earlier
    assert {(row.current, row.compared, row.settings) for row in rows} == {
        (True, False, ""),
        (False, True, "offset 0.37 s"),
    }
    document.close()
    assert board.compared == set()


def test_a_failure_belongs_to_its_settings(document: Document, board: StageBoard) -> None:
    document.apply(edits.set_value(document.session, "orient", "offset_mm", 12.0))
    board.begin("orient", board.keys["orient"])
    assert board.state("orient") == "running"
    board.end(Failure("orient", board.keys["orient"], "marker 3 jumps", "frame 17", "leave it out"))
    assert board.state("orient") == "failed"
    assert board.card("orient").headline == "frame 17: marker 3 jumps; leave it out."
    document.apply(edits.set_value(document.session, "orient", "prior_deg", 13.0))
    assert board.state("orient") == "stale"
    document.undo()
    assert board.state("orient") == "failed"


def test_a_stage_that_runs_with_other_settings_is_not_running(document: Document, board: StageBoard) -> None:
    board.begin("orient", "another key")
    assert board.state("orient") == "cached"


def test_decisions_are_marked_in_the_forms(board: StageBoard) -> None:
    fields = {field.name: field for field in board.card("sync").fields}
    assert (fields["offset"].value, fields["offset"].decided) == (0.37, True)
    assert not fields["rate_ratio"].decided


def test_each_stage_asks_only_for_what_it_needs(document: Document, board: StageBoard) -> None:
    document.apply(edits.set_input(document.session, "video_file", None))
    assert "neither a video nor a pose prior" in board.card("fit").why_not
    assert board.runnable == ("markers", "clean", "segment")
    assert board.card("segment").why_not == ""


def test_a_board_follows_the_document(document: Document, board: StageBoard) -> None:
    results = board.results
    document.close()
    assert (board.names, board.results is results) == ((), False)


def test_results_of_a_stage_are_its_type(board: StageBoard) -> None:
    assert isinstance(board.current["sync"], Sync)
    assert isinstance(board.settings["sync"], SyncSettings)
