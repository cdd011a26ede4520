"""The session file: what is saved is loaded, what is wrong is said in one sentence."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.session import (
    FILE_NAME,
    InputFile,
    Session,
    load_session,
    save_session,
    session_folder,
)
from markerscope.solver.pipeline.settings import from_table, overlay, to_table
from markerscope.solver.pipeline.stage import Stage


@dataclass(frozen=True)
class Inner:
    weight: float = 1.0
    steps: tuple[float, ...] = (0.04, 0.02)


@dataclass(frozen=True)
class SyncSettings:
    offset: float | None = None
    mode: Literal["auto", "given"] = "auto"
    count: int = 8
    on: bool = True
    pinned: tuple[tuple[int, float], ...] = ()
    by_label: dict[str, int] = field(default_factory=dict)
    inner: Inner = Inner()
    limit: float | None = 3.0


GRAPH = (Stage("sync", 1, SyncSettings, (), lambda s, p: None, None),)

settings = st.builds(
    SyncSettings,
    st.one_of(st.none(), st.floats(allow_nan=False)),
    st.sampled_from(["auto", "given"]),
    st.integers(-(2**60), 2**60),
    st.booleans(),
    st.lists(st.tuples(st.integers(0, 99), st.floats(allow_nan=False)), max_size=3).map(tuple),
    st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), st.integers(-9, 9), max_size=3),
    st.builds(Inner, st.floats(allow_nan=False), st.lists(st.floats(allow_nan=False), max_size=3).map(tuple)),
    st.one_of(st.none(), st.floats(allow_nan=False)),
)


@given(settings)
def test_settings_survive_their_table(value: SyncSettings) -> None:
    assert from_table(SyncSettings, to_table(value)) == value


@given(settings, settings, st.sets(st.sampled_from(list(SyncSettings.__dataclass_fields__))))
def test_an_overlay_wins_where_it_says_something(base: SyncSettings, top: SyncSettings, said: set[str]) -> None:
    table = to_table(top)
    over = {name: value for name, value in table.items() if name in said}
    over["unset"] = [name for name in table.get("unset", []) if name in said]
    merged = from_table(SyncSettings, overlay(to_table(base), over))
    assert merged == replace(base, **{name: getattr(top, name) for name in said})


@pytest.fixture
def session(tmp_path: Path) -> Session:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "trial.trc").write_text("markers")
    return Session(
        tmp_path / "trial.markerscope",
        {"markers": InputFile(tmp_path / "data" / "trial.trc", "abc")},
        {"sync": to_table(SyncSettings(offset=0.1, limit=None))},
        {"sync": {"pinned": [[3, 0.5]]}},
    )


def test_a_session_comes_back_with_its_edits_over_its_settings(session: Session) -> None:
    save_session(session)
    back = load_session(session.folder)
    assert back == session
    assert back.stage_settings(GRAPH) == {"sync": SyncSettings(offset=0.1, limit=None, pinned=((3, 0.5),))}
    assert load_session(session.folder / FILE_NAME) == session


def test_session_and_inputs_move_together(session: Session, tmp_path: Path) -> None:
    save_session(session)
    assert 'path = "../data/trial.trc"' in (session.folder / FILE_NAME).read_text()
    (tmp_path / "elsewhere").mkdir()
    for name in ("data", session.folder.name):
        shutil.move(tmp_path / name, tmp_path / "elsewhere" / name)
    back = load_session(tmp_path / "elsewhere" / session.folder.name)
    sources = back.sources(["markers", "video"])
    assert sources["markers"].value.read_text() == "markers"
    assert sources["video"].value is None


def test_a_missing_input_is_said_with_a_remedy(session: Session, tmp_path: Path) -> None:
    save_session(session)
    (tmp_path / "data" / "trial.trc").unlink()
    with pytest.raises(InputError, match=r"trial\.trc: the markers file .* not there any more; move it back"):
        load_session(session.folder).sources(["markers"])


def test_with_settings_replaces_one_stage(session: Session) -> None:
    changed = session.with_settings({"sync": SyncSettings(count=3)})
    assert changed.stage_settings(GRAPH)["sync"].count == 3
    assert session.stage_settings(GRAPH)["sync"].count == 8


def test_what_is_no_session_is_none(tmp_path: Path) -> None:
    assert session_folder(tmp_path) is None
    assert session_folder(tmp_path / "absent") is None
    with pytest.raises(InputError, match=FILE_NAME):
        load_session(tmp_path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("schema = 99\nprogram = 'markerscope 7.0'", "written by markerscope 7.0, .* update"),
        ("", "does not say which schema"),
        ("schema = 'x'", "does not say which schema"),
        ("schema = ", "is not a session file"),
        ("schema = 1\ninputs = 3", r"\[inputs\] does not hold tables"),
        ("schema = 1\n[inputs]\nmarkers = 'a.trc'", r"\[inputs\] does not hold tables"),
        ("schema = 1\n[inputs.markers]\npath = 3", r"\[inputs.markers\] has no path"),
        (b"\xff\xfe\x00", "is not a session file"),
    ],
)
def test_a_session_that_cannot_be_read_is_said(tmp_path: Path, text: str | bytes, says: str) -> None:
    (tmp_path / FILE_NAME).write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(InputError, match=says):
        load_session(tmp_path)


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"ofset": 1}, 'no setting "ofset"; use one of: by_label, count'),
        ({"count": 1.5}, "1.5 is not what is expected there"),
        ({"count": True}, "True is not what"),
        ({"mode": "sometimes"}, "'sometimes' is not what is expected there .'auto' or 'given'"),
        ({"offset": "late"}, "'late' is not what is expected there .float"),
        ({"pinned": [[1]]}, "2 values"),
        ({"inner": {"weight": "x"}}, "inner, weight"),
        ({"inner": 3}, "expected there .Inner"),
        ({"unset": "offset"}, "not a list of names"),
        ({"unset": ["count"]}, "None is not what"),
    ],
)
def test_a_wrong_setting_is_said(tmp_path: Path, table: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Session(tmp_path, settings={"sync": table}).stage_settings(GRAPH)


def test_settings_of_an_unknown_stage_are_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='unknown stage "snyc"; use one of: sync'):
        Session(tmp_path, settings={"snyc": {}}).stage_settings(GRAPH)
