"""A session's life in the window: begun, decided, undone, saved, moved, crashed, opened as it was."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models import edits
from markerscope.app.models.document import Document
from markerscope.app.models.history import History, Step
from markerscope.app.models.home import Home
from markerscope.app.models.journal import JOURNAL, VIEW, read_journal
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.session import FILE_NAME, Session, load_session, save_session
from markerscope.solver.pipeline.store import Store


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return Home(tmp_path / "config", tmp_path / "data")


@pytest.fixture
def markers(tmp_path: Path) -> Path:
    file = tmp_path / "trials" / "walk 1.c3d"
    file.parent.mkdir()
    file.write_bytes(b"markers")
    return file


@pytest.fixture
def document(home: Home, markers: Path) -> Document:
    document = Document(home)
    document.new({"marker_file": markers}, {"markers": {"up": "y"}})
    return document


@pytest.fixture
def saved(document: Document, tmp_path: Path) -> Document:
    document.save_as(tmp_path / "walk.markerscope")
    return document


def crash(document: Document) -> None:
    """What a program that ends without a word has had time for: its writing thread."""
    document._writer.flush()


def offset(document: Document, value: float) -> None:
    document.apply(replace(edits.set_offset(document.session, value), merge=""))


def test_a_new_session_is_untitled_and_unsaved(document: Document, home: Home) -> None:
    assert (document.untitled, document.dirty, document.name) == (True, True, "walk 1")
    assert document.folder.parent == home.unsaved
    assert document.session.settings == {"markers": {"up": "y"}}
    with pytest.raises(InputError, match="choose a folder"):
        document.save()


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        ({}, "begins with one"),
        ({"marker_file": Path("/nowhere/a.c3d")}, "there is no such marker file"),
    ],
)
def test_what_cannot_be_opened_leaves_the_open_session(document: Document, inputs, said: str) -> None:
    before = document.session
    with pytest.raises(InputError, match=said):
        document.new(inputs)
    with pytest.raises(InputError):
        document.open(Path("/nowhere"))
    assert document.session == before


def test_every_decision_can_be_undone_and_redone(saved: Document) -> None:
    start = saved.session
    decisions = [
        lambda s: edits.set_value(s, "orient", "offset_mm", 12.0),
        lambda s: edits.set_range(s, 1.0, 2.0),
        lambda s: edits.set_offset(s, 0.4),
        lambda s: edits.pin_candidate(s, 1),
        lambda s: edits.set_method(s, "paper"),
        lambda s: edits.set_seed(s, 3),
        lambda s: edits.reset_stage(s, "markers"),
    ]
    states = [start]
    for decide in decisions:
        saved.apply(decide(saved.session))
        states.append(saved.session)
    assert len(set(map(repr, states))) == len(states), "each made a difference"
    for state in states[-2::-1]:
        assert saved.dirty
        saved.undo()
        assert saved.session == state
    assert not saved.dirty
    saved.undo()
    assert saved.session == start
    for state in states[1:]:
        saved.redo()
        assert saved.session == state
    saved.redo()
    saved.go_to(2)
    assert saved.session == states[2]
    assert saved.history.undo_sentence == "Solve from 1.00 s to 2.00 s"
    assert saved.history.redo_sentence == "Offset of the video +0.400 s"


def test_a_decision_after_undo_forgets_what_was_undone(saved: Document) -> None:
    offset(saved, 1.0)
    offset(saved, 2.0)
    saved.undo()
    offset(saved, 3.0)
    assert [step.sentence[-8:] for step in saved.history.steps[1:]] == ["+1.000 s", "+3.000 s"]
    saved.redo()
    assert saved.session.edits["sync"]["offset"] == 3.0


def test_a_value_being_dialled_is_one_step() -> None:
    base = Session(Path("/x"))
    history = History([Step("opened", 0.0, base)])
    for i, when in enumerate((10.0, 10.1, 10.2, 19.0)):
        history.add(Step(f"offset {i}", when, edits.set_offset(base, float(i)).session, "offset"))
    assert [step.sentence for step in history.steps] == ["opened", "offset 2", "offset 3"]
    history.add(Step("range", 19.1, edits.set_range(base, 0, 1).session, "range"))
    assert len(history.steps) == 4
    one = History([Step("opened", 0.0, base)])
    one.add(Step("offset", 1.0, edits.set_offset(base, 1.0).session, "offset"))
    one.add(Step("offset back", 1.1, base, "offset"))
    assert [step.sentence for step in one.steps] == ["opened"], "dialled back: nothing was decided"


def test_a_very_long_history_keeps_its_beginning_and_its_end() -> None:
    base = Session(Path("/x"))
    history = History([Step("opened", 0.0, base)])
    for i in range(700):
        history.add(Step(str(i), float(i), edits.set_offset(base, float(i)).session))
    assert len(history.steps) == 500
    assert (history.steps[0].sentence, history.steps[-1].sentence) == ("opened", "699")
    assert history.position == 499


def test_what_cannot_be_decided_changes_nothing(saved: Document) -> None:
    before = saved.session
    with pytest.raises(InputError, match="refine"):
        saved.apply(edits.set_value(before, "orient", "refine", 0))
    assert saved.session == before
    assert len(saved.history.steps) == 1
    saved.apply(edits.Edit("nothing", before))
    assert len(saved.history.steps) == 1


def test_a_pin_falls_with_its_ranking_and_says_so(saved: Document) -> None:
    saved.apply(edits.pin_candidate(saved.session, 1))
    saved.apply(edits.set_value(saved.session, "angles", "convention", "isb"))
    assert saved.session.edits["fit"] == {"candidate": 1}, "the ranking is the same"
    saved.apply(edits.set_value(saved.session, "orient", "offset_mm", 12.0))
    assert "fit" not in saved.session.edits
    assert saved.history.undo_sentence == ("Orientation: offset 12 mm, was 9.5 mm; candidate 2 is no longer pinned")
    saved.undo()
    assert saved.session.edits["fit"] == {"candidate": 1}


def test_groups_by_hand_fall_with_their_columns(saved: Document, tmp_path: Path) -> None:
    table = {"merges": [[0, 1]], "threshold": 0.006}
    saved.apply(edits.Edit("merged", edits.decide(saved.session, "segment", table)))
    other = tmp_path / "other.trc"
    other.touch()
    saved.apply(edits.set_input(saved.session, "marker_file", other))
    assert saved.session.edits["segment"] == {"threshold": 0.006}
    assert "as the cut makes them" in str(saved.history.undo_sentence)


def test_edits_of_tracks_fall_with_the_frame_they_are_counted_from(saved: Document) -> None:
    saved.apply(edits.Edit("exchanged", edits.decide(saved.session, "clean", {"swaps": [[0, 1, 30]]})))
    saved.apply(edits.set_range(saved.session, None, 5.0))
    assert saved.session.edits["clean"] == {"swaps": [[0, 1, 30]]}, "frames are counted from where they were"
    saved.apply(replace(edits.set_range(saved.session, 1.0, 5.0), merge=""))
    assert "clean" not in saved.session.edits
    assert str(saved.history.undo_sentence).endswith("edits of tracks are taken back")


def test_saving_and_opening_brings_back_everything(saved: Document, home: Home) -> None:
    offset(saved, 0.4)
    saved.set_view(camera={"eye": [1.0, 2.0, 3.0]}, frame=17)
    assert saved.dirty
    saved.save()
    assert not saved.dirty
    session, folder = saved.session, saved.folder
    saved.close()
    assert not (folder / JOURNAL).exists()
    again = Document(home)
    again.open(folder)
    assert (again.session, again.dirty, again.recovered) == (session, False, False)
    assert again.view == {"camera": {"eye": [1.0, 2.0, 3.0]}, "frame": 17}


def test_save_as_takes_results_along_and_moves_relative_paths(document: Document, tmp_path: Path) -> None:
    Store(document.folder / "results").put("sync", "k", 1.5)
    old = document.folder
    document.save_as(tmp_path / "deep" / "down" / "mine")
    assert document.folder == tmp_path / "deep" / "down" / "mine.markerscope"
    assert not old.exists()
    assert document.session.store.get("sync", "k", float) == 1.5
    assert load_session(document.folder) == document.session
    assert (document.folder / "../../.." / "trials" / "walk 1.c3d").resolve().exists()


def test_save_as_from_a_saved_session_leaves_it_and_keeps_the_history(saved: Document, tmp_path: Path) -> None:
    offset(saved, 1.0)
    old = saved.folder
    on_disk = (old / FILE_NAME).read_bytes()
    saved.save_as(tmp_path / "copy")
    assert (old / FILE_NAME).read_bytes() == on_disk
    assert not (old / JOURNAL).exists()
    saved.undo()
    assert saved.folder == tmp_path / "copy.markerscope"
    assert saved.dirty


def test_a_session_is_not_saved_over_other_things(saved: Document, tmp_path: Path) -> None:
    other = tmp_path / "other.markerscope"
    other.mkdir()
    (other / "thesis.txt").write_text("mine")
    with pytest.raises(InputError, match="other things"):
        saved.save_as(other)
    assert [path.name for path in other.iterdir()] == ["thesis.txt"]
    assert saved.folder != other


def test_after_a_crash_it_opens_as_it_was(saved: Document, home: Home) -> None:
    offset(saved, 1.0)
    offset(saved, 2.0)
    saved.undo()
    saved.set_view(frame=33)
    crash(saved)
    again = Document(home)
    again.open(saved.folder)
    assert again.session == saved.session
    assert (again.recovered, again.dirty, again.view["frame"]) == (True, True, 33)
    assert again.history.redo_sentence == "Offset of the video +2.000 s"
    again.undo()
    assert not again.dirty


def test_an_unsaved_session_is_found_after_a_crash(document: Document, home: Home) -> None:
    offset(document, 1.0)
    crash(document)
    again = Document(home)
    (folder,) = again.left_by_crash()
    again.open(folder)
    assert again.session == document.session
    assert (again.untitled, again.dirty, again.recovered) == (True, True, True)
    again.close()
    assert again.left_by_crash() == ()
    assert not folder.exists()


def test_an_unsaved_session_can_be_kept_for_later(document: Document, home: Home) -> None:
    folder = document.folder
    document.close(keep_untitled=True)
    again = Document(home)
    assert again.left_by_crash() == (folder,)


@pytest.mark.skipif(os.name == "nt", reason="another process cannot be asked for there")
def test_a_session_open_elsewhere_is_said_to_be(saved: Document, home: Home) -> None:
    crash(saved)
    journal = saved.folder / JOURNAL
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as other:
        journal.write_text(json.dumps({**json.loads(journal.read_text()), "process": other.pid}))
        with pytest.raises(InputError, match="is open in another window"):
            Document(home).open(saved.folder)
        Document(home).open(saved.folder, although_open=True)
        journal.write_text(json.dumps({**json.loads(journal.read_text()), "process": other.pid}))
        assert other.stdin is not None
        other.stdin.close()
    Document(home).open(saved.folder)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"steps": 3, "position": 0}', '{"steps": [], "position": 0}'])
def test_a_damaged_journal_is_as_none(saved: Document, home: Home, text: str) -> None:
    offset(saved, 1.0)
    saved.save()
    crash(saved)
    (saved.folder / JOURNAL).write_text(text)
    (saved.folder / VIEW).write_text("nonsense")
    assert read_journal(saved.folder) is None
    again = Document(home)
    again.open(saved.folder)
    assert (again.session, again.view, again.recovered) == (saved.session, {}, False)


def test_a_place_that_cannot_be_written_is_said_and_loses_nothing(saved: Document) -> None:
    journal = saved.folder / JOURNAL
    saved._writer.flush()
    journal.unlink()
    journal.mkdir()
    offset(saved, 1.0)
    crash(saved)
    assert "cannot be written" in str(saved.problem)
    assert saved.session.edits["sync"]["offset"] == 1.0
    journal.rmdir()
    offset(saved, 2.0)
    crash(saved)
    assert saved.problem is None


def test_who_listens_is_told_what_happened(document: Document, tmp_path: Path) -> None:
    heard: list[object] = []
    document.changed.connect(heard.append)
    document.saved.connect(lambda: heard.append("saved"))
    offset(document, 1.0)
    assert heard == [False, "saved"]
    heard.clear()
    document.undo()
    document.undo()
    assert heard == [False, "saved"]
    heard.clear()
    document.close()
    assert heard == [True, "saved"]
    assert not document.is_open
    with pytest.raises(InputError, match="no session is open"):
        _ = document.session


def test_recent_sessions_are_the_latest_first(home: Home, tmp_path: Path) -> None:
    for name in ("a", "b", "a", "c"):
        home.add_recent(tmp_path / name)
    (tmp_path / "a").mkdir()
    assert [(row.path.name, row.exists) for row in home.recent()] == [("c", False), ("a", True), ("b", False)]
    home.remove_recent(tmp_path / "c")
    assert [row.path.name for row in home.recent()] == ["a", "b"]
    (home.config / "recent.json").write_text('{"recent": [{"path": 3}, 4, {"path": "x", "when": 1}]}')
    assert [row.path for row in home.recent()] == [Path("x")]
    (home.config / "recent.json").write_text("nonsense")
    assert home.recent() == ()


def test_opening_makes_recent_and_preferences_are_kept(saved: Document, home: Home) -> None:
    assert [row.path for row in home.recent()] == [saved.folder]
    home.prefer(theme="dark")
    home.prefer(scale=1.5)
    assert home.preferences() == {"theme": "dark", "scale": 1.5}


def test_the_users_folders_follow_the_system(tmp_path: Path) -> None:
    own = Home.of_user({"MARKERSCOPE_HOME": str(tmp_path)})
    assert own == Home(tmp_path, tmp_path)
    if sys.platform == "linux":
        found = Home.of_user({"XDG_CONFIG_HOME": "/c", "XDG_DATA_HOME": "/d"})
        assert found == Home(Path("/c/markerscope"), Path("/d/markerscope"))


def test_a_session_solved_on_the_command_line_opens(home: Home, tmp_path: Path, markers: Path) -> None:
    session = Session(tmp_path / "solved", edits={"fit": {"candidate": 1}})
    save_session(session)
    document = Document(home)
    document.open(tmp_path / "solved" / FILE_NAME)
    assert document.session == session
    assert (document.name, document.dirty) == ("solved", False)


@pytest.mark.parametrize("name", ["body_file", "prior_file", "camera_file", "weights_file"])
@pytest.mark.parametrize("content", [b"", b"no such thing at all", b"PK\x03\x04 half a zip"])
def test_a_file_that_cannot_be_used_does_not_stay_in_the_session(
    saved: Document, tmp_path: Path, name: str, content: bytes
) -> None:
    wrong = tmp_path / "wrong.npz"
    wrong.write_bytes(content)
    before, steps = saved.session, len(saved.history.steps)
    with pytest.raises(InputError, match=r"wrong\.npz"):
        saved.apply(edits.set_input(saved.session, name, wrong))
    assert saved.session == before and len(saved.history.steps) == steps and not saved.dirty
    with pytest.raises(InputError, match=r"wrong\.npz"):
        saved.new({"marker_file": before.inputs["marker_file"].path, name: wrong})
    assert saved.session == before, "what was open stays open"


def test_a_body_of_another_kind_is_said_and_not_taken(saved: Document, tmp_path: Path) -> None:
    wrong = tmp_path / "hand.npz"
    np.savez(wrong, weights=np.ones((9, 16)) / 16)
    before = saved.session
    with pytest.raises(InputError, match="it is a MANO hand"):
        saved.apply(edits.set_input(saved.session, "body_file", wrong))
    assert saved.session == before
