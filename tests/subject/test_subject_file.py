"""The file that lists a subject's trials: what it may say, and one sentence for each fault."""

from __future__ import annotations

from pathlib import Path

import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.subject.order import determining, neutral_of
from markerscope.solver.subject.subject_file import Subject, is_subject, read_subject

HEAD = '[subject]\nname = "P07"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("a.c3d", "b.c3d", "c.c3d", "a.mp4"):
        (tmp_path / name).touch()
    return tmp_path


def read(folder: Path, text: str) -> Subject:
    path = folder / "subject.toml"
    path.write_text(text, encoding="utf-8")
    return read_subject(path)


def trial(name: str, more: str = "", markers: str = "a.c3d") -> str:
    return f'[[trial]]\nname = "{name}"\nmarkers = "{markers}"\n{more}\n'


def test_everything_that_may_be_said_is_read(folder: Path) -> None:
    more = 'role = "functional"\nvideo = "a.mp4"\nmarkers_moved = true\noffset = 1\nup = "y"\nrange = [1, 2.5]\n'
    more += 'person = "Ann"'
    subject = read(folder, HEAD + trial("squat", more) + trial("walk", "", "b.c3d"))
    first, second = subject.trials
    assert (first.role, first.markers_moved, first.offset, first.up) == ("functional", True, 1.0, "y")
    assert (first.start, first.stop, first.person) == (1.0, 2.5, "Ann")
    assert first.video == folder / "a.mp4" and first.posed
    assert second.markers == folder / "b.c3d" and not second.posed and second.role == "movement"
    assert not subject.refused and subject.name == "P07"


@pytest.mark.parametrize(
    ("row", "says"),
    [
        (trial("b", "", "gone.c3d"), "there is no such markers file; check markers of"),
        (trial("b", 'video = "gone.mp4"'), "there is no such video file"),
        (trial("a", "", "b.c3d"), 'another trial is called "a"'),
        (trial("A", "", "b.c3d"), 'another trial is called "A"'),
        (trial("x/y"), "cannot be that of a folder"),
        (trial(".."), "cannot be that of a folder"),
        (trial("results"), "is the name of something else"),
        (trial("b", 'role = "still"'), 'role = "still" is not known'),
        (trial("b", "markers_moved = 1"), "is not true or false"),
        (trial("b", 'rol = "static"'), '"rol" is not known there'),
        (trial("b", "range = [3, 1]"), "not two rising times"),
        ('[[trial]]\nname = "b"\n', "names no marker file"),
        ('[[trial]]\nmarkers = "a.c3d"\n', "has no name"),
        (trial("b", "", "."), "is a folder"),
    ],
)
def test_a_fault_of_one_trial_is_one_sentence_and_leaves_the_others(folder: Path, row: str, says: str) -> None:
    subject = read(folder, HEAD + trial("a") + row + trial("c", "", "c.c3d"))
    assert [t.name for t in subject.trials] == ["a", "c"]
    ((_, error),) = subject.refused
    assert says in str(error)
    assert str(error).count(".\n") == 0 and str(error).endswith(".") and error.remedy


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[subject\n", "is not TOML"),
        (trial("a"), "has no table [subject]"),
        ("[subject]\n" + trial("a"), "the subject has no name"),
        (HEAD, "lists no trial"),
        (HEAD + "age = 3\n" + trial("a"), '"age" is not known there'),
        ("trials = 3\n" + HEAD + trial("a"), '"trials" is not known there'),
    ],
)
def test_a_fault_of_the_file_is_one_sentence(folder: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=r"subject\.toml") as error:
        read(folder, text)
    assert says in str(error.value)


def test_a_session_is_no_subject(tmp_path: Path) -> None:
    path = tmp_path / "session.toml"
    path.write_text("schema = 1\n")
    assert not is_subject(path)
    path.write_text(HEAD)
    assert is_subject(path)
    assert not is_subject(tmp_path / "gone.toml")
    other = tmp_path / "a.c3d"
    other.write_text(HEAD)
    assert not is_subject(other)


def test_a_movement_with_a_video_determines_the_body_before_a_static_trial(folder: Path) -> None:
    static, posed = trial("still", 'role = "static"'), trial("squat", 'video = "a.mp4"', "b.c3d")
    both = read(folder, HEAD + static + posed)
    assert [t.name for t in determining(both)] == ["squat", "still"]
    neutral = neutral_of(both)
    assert neutral is not None and neutral.name == "still"
    moved = read(folder, HEAD + trial("still", 'role = "static"\nmarkers_moved = true') + posed)
    assert neutral_of(moved) is None, "a static trial with other markers is not the neutral pose of these"


def test_no_trial_that_determines_the_body_is_said(folder: Path) -> None:
    with pytest.raises(InputError, match="no trial says what body this is"):
        determining(read(folder, HEAD + trial("walk") + trial("jump", "", "b.c3d")))
