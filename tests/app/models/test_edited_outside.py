"""A session file that somebody edits while it is open, or while it is solved, is not overwritten."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from markerscope.app.actions import ACTIONS, Actions
from markerscope.app.models.document import Document
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.pipeline.session import load_session
from markerscope.solver.pipeline.session_file import FILE_NAME, EditedOutside
from tests.app.actions.test_actions import Answers
from tests.app.models.test_document import crash, document, home, markers, offset, saved

__all__ = ["document", "home", "markers", "saved"]
QUESTION = "The session file was edited outside. Neither is lost"


def edited(folder: Path, line: str = "seed = 7") -> str:
    """Another seed, by another program."""
    file = folder / FILE_NAME
    file.write_text(file.read_text().replace("seed = 0", line))
    assert line in file.read_text()
    return file.read_text()


def test_saving_over_an_edit_is_refused(saved: Document) -> None:
    offset(saved, 0.5)
    saved.save()
    text = edited(saved.folder)
    offset(saved, 0.6)
    with pytest.raises(EditedOutside, match=r"session\.toml: was edited since it was read, and is not overwritten; "):
        saved.save()
    assert (saved.folder / FILE_NAME).read_text() == text and saved.dirty
    with pytest.raises(EditedOutside):
        saved.save_as(saved.folder)
    assert (saved.folder / FILE_NAME).read_text() == text


def test_an_edit_that_was_read_is_saved_over(saved: Document, home) -> None:
    edited(saved.folder)
    folder = saved.folder
    saved.close()
    again = Document(home)
    again.open(folder)
    offset(again, 0.6)
    again.save()
    again.save()
    assert load_session(folder) == again.session and again.session.run.seed == 7


def test_the_file_can_be_taken_and_given_back(saved: Document) -> None:
    offset(saved, 0.5)
    text = edited(saved.folder)
    saved.take_from_disk()
    assert saved.session.run.seed == 7 and not saved.dirty
    assert (saved.folder / FILE_NAME).read_text() == text
    saved.undo()
    assert saved.session.edits["sync"]["offset"] == 0.5, "mine is one step back"
    saved.save()


def test_a_file_that_is_gone_is_written_again(saved: Document) -> None:
    (saved.folder / FILE_NAME).unlink()
    saved.save()
    assert load_session(saved.folder) == saved.session


@pytest.mark.parametrize("outside", [True, False])
def test_an_edit_after_a_crash_is_seen_too(saved: Document, home, outside: bool) -> None:
    offset(saved, 0.5)
    crash(saved)
    if outside:
        edited(saved.folder)
    again = Document(home)
    again.open(saved.folder)
    assert again.recovered
    if not outside:
        again.save()
        return
    with pytest.raises(EditedOutside):
        again.save()


@pytest.mark.parametrize("chosen", [0, 1, None])
def test_the_window_asks_whose_it_is_to_be(tmp_path: Path, home, markers: Path, chosen: int | None) -> None:
    bench, asks = Workbench(home), Answers()
    said: list[Said] = []
    bench.said.connect(said.append)
    bench.document.new({"marker_file": markers})
    bench.document.save_as(tmp_path / "walk.markerscope")
    offset(bench.document, 0.5)
    text, folder = edited(bench.document.folder), bench.document.folder
    asks.answers = {QUESTION: chosen, "folder": tmp_path / "mine.markerscope"}
    Actions(ACTIONS, bench, asks).trigger("session.save")
    assert (folder / FILE_NAME).read_text() == text
    if chosen == 0:
        assert load_session(tmp_path / "mine.markerscope").edits["sync"]["offset"] == 0.5
    elif chosen == 1:
        assert bench.document.session == replace(load_session(folder)) and not bench.document.dirty
    else:
        assert [one.level for one in said] == ["error"] and bench.document.dirty
    bench.close()
