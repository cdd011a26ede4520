"""Files that belong together are written all or none, whatever fails and when."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text, plain, shown
from markerscope.solver.io.together import together


def held(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def write(folder: Path, **texts: str) -> None:
    for name, text in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)


def test_files_take_their_places_and_what_is_gone_goes(tmp_path: Path) -> None:
    write(tmp_path, a="old", c="left", other="mine")
    with together(tmp_path, gone=("a", "c", "never")) as place:
        write(place, a="new", b="new")
        write(place, **{"sub/d": "new"})
        assert held(tmp_path)["a"] == "old"
    assert held(tmp_path) == {"a": "new", "b": "new", "sub/d": "new", "other": "mine"}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, OSError])
def test_what_fails_while_they_are_made_leaves_no_trace(tmp_path: Path, error: type[BaseException]) -> None:
    write(tmp_path, a="old")
    with pytest.raises(error), together(tmp_path) as place:
        write(place, a="new")
        raise error()
    assert held(tmp_path) == {"a": "old"}
    with pytest.raises(error), together(tmp_path / "deep" / "new") as place:
        write(place, a="new")
        raise error()
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize("which", [0, 1, 2])
def test_what_fails_while_they_are_moved_is_moved_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, which: int, links: bool
) -> None:
    write(tmp_path, a="old a", b="old b", d="old d")
    really, targets = os.replace, [tmp_path / name for name in "abc"]

    def refuse(source: str | Path, target: str | Path) -> None:
        if Path(target) == targets[which] and ".before" not in str(source):
            raise PermissionError(13, "in use")
        really(source, target)

    def no_links(source: str | Path, target: str | Path) -> None:
        raise OSError(1, "not supported")

    monkeypatch.setattr(os, "replace", refuse)
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    says = pytest.raises(InputError, match="cannot be replaced; close the program")
    with says as refused, together(tmp_path, gone=("d",)) as place:
        write(place, a="new a", b="new b", c="new c")
    assert refused.value.where == str(targets[which])
    assert held(tmp_path) == {"a": "old a", "b": "old b", "d": "old d"}


def test_a_folder_in_the_place_of_a_file_is_said_and_nothing_else_touched(tmp_path: Path) -> None:
    write(tmp_path, a="old")
    (tmp_path / "b").mkdir()
    with pytest.raises(InputError, match="a folder of that name"), together(tmp_path) as place:
        write(place, a="new", **{"sub/c": "new", "b": "new"})
    assert held(tmp_path) == {"a": "old"} and not (tmp_path / "sub").exists()


def test_json_has_no_number_that_json_has_not() -> None:
    value = {"a": math.inf, "b": [math.nan, 1.5, -math.inf], "c": np.array([1.0, np.nan]), "d": np.float64("inf")}
    assert json.loads(json_text(value | {"e": (True, None, 3)}), parse_constant=pytest.fail) == {
        "a": None,
        "b": [None, 1.5, None],
        "c": [1.0, None],
        "d": None,
        "e": [True, None, 3],
    }


def test_names_that_are_no_text_can_be_shown() -> None:
    name = os.fsdecode(b"tr\xffl \xc3\xa4.c3d")
    assert shown(name) == "tr\\xffl \u00e4.c3d"
    assert shown("\ud800") == "\\ud800" and shown("plain \u2013 \U0001f600") == "plain \u2013 \U0001f600"
    assert plain({name: Path(name)}) == {shown(name): shown(name)}
    json_text([name]).encode("ascii")
