"""The file that lists a subject's trials: read, and every fault said in one sentence."""

from __future__ import annotations

import os
import tomllib
import typing
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import Units, Up

Role = Literal["static", "functional", "movement"]
_TAKEN = {"results", "person.npz", "subject.json", "report.html", "standing"}
"""What else lies in the folder of results."""
_BAD = set('<>:"/\\|?*')
_EXAMPLE = 'write one [[trial]] with name = "walk1" and markers = "walk1.c3d" for each trial'


@dataclass(frozen=True)
class Trial:
    """One trial of a subject, as the file has it.

    Attributes
    ----------
    name : of its folder of results, and in the report
    markers : marker file
    video, prior : as of a single solve
    camera : result folder or camera file, or the name of another trial that the same camera recorded
    role : a static trial is the neutral pose of all; a functional one moves single joints far
    markers_moved : markers were put on anew since the trial that determined the body
    offset : s, of its video
    up, units, rate : how the marker file is read
    person : whose markers, where the file holds several people's
    start, stop : s in the marker file's clock
    """

    name: str
    markers: Path
    video: Path | None = None
    prior: Path | None = None
    camera: str | None = None
    role: Role = "movement"
    markers_moved: bool = False
    offset: float | None = None
    up: Up | None = None
    units: Units | None = None
    rate: float | None = None
    person: str | None = None
    start: float | None = None
    stop: float | None = None

    @property
    def posed(self) -> bool:
        """Whether something beside the markers says how the person stands."""
        return self.video is not None or self.prior is not None


@dataclass(frozen=True)
class Subject:
    """A person's trials.

    Attributes
    ----------
    name : of the person
    trials : those that can be solved, in the file's order
    refused : name and reason of those that cannot
    file : where it was read
    """

    name: str
    trials: tuple[Trial, ...]
    refused: tuple[tuple[str, InputError], ...]
    file: Path


def is_subject(path: Path) -> bool:
    """Whether a file lists a subject's trials: TOML with a table ``[subject]`` and no session's ``schema``."""
    if path.suffix.lower() != ".toml" or not path.is_file():
        return False
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return False
    except ValueError:  # no TOML: whoever reads it says so, and better than a reader of markers
        return True
    return "schema" not in content


def read_subject(path: Path) -> Subject:
    """Read the file. A fault of one trial leaves the others; a fault of the file itself is raised.

    Raises
    ------
    InputError : it is no TOML, has no ``[subject]``, no trial, or says something that is not known
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", path, "check its permissions") from error
    except ValueError as error:
        raise InputError(f"is not TOML: {error}", path, "correct that line") from error
    head, rows = content.get("subject"), content.get("trial")
    if not isinstance(head, dict):
        raise InputError("has no table [subject]", path, 'add [subject] with name = "..."')
    _known_keys(content, {"subject", "trial"}, f"{path}")
    _known_keys(head, {"name"}, f"{path}, [subject]")
    name = head.get("name")
    if not (isinstance(name, str) and name.strip()):
        raise InputError("the subject has no name", path, 'add name = "..." below [subject]')
    if not (isinstance(rows, list) and rows and all(isinstance(row, dict) for row in rows)):
        raise InputError("lists no trial", path, _EXAMPLE)
    trials: list[Trial] = []
    refused: list[tuple[str, InputError]] = []
    for number, row in enumerate(rows, start=1):
        said = row.get("name") if isinstance(row.get("name"), str) else f"trial {number}"
        try:
            trial = _trial(row, number, path)
            if trial.name.casefold() in {other.name.casefold() for other in trials}:
                raise InputError(f'another trial is called "{trial.name}"', path, "give each its own name")
            trials.append(trial)
        except InputError as error:
            refused.append((str(said), error))
    return Subject(name.strip(), tuple(trials), tuple(refused), path)


def _trial(row: Mapping[str, Any], number: int, path: Path) -> Trial:
    where = f"{path}, trial {number}"
    _known_keys(row, {"range", *(f.name for f in fields(Trial))} - {"start", "stop"}, where)
    name = row.get("name")
    if not (isinstance(name, str) and name.strip()):
        raise InputError("has no name", where, 'add name = "..."')
    where = f"{path}, {name}"
    if name in (".", "..") or _BAD & set(name) or name != name.strip() or not name.isprintable():
        raise InputError("its name cannot be that of a folder", where, "use letters, digits, - and _")
    if name.casefold() in _TAKEN:
        raise InputError(f'"{name}" is the name of something else in the results', where, "choose another name")
    if not isinstance(row.get("markers"), str):
        raise InputError("names no marker file", where, 'add markers = "..."')
    given: dict[str, Any] = {"name": name}
    for key in ("markers", "video", "prior"):
        if key in row:
            given[key] = _file(row[key], key, path, where)
    for key, kind, wanted in (
        ("camera", str, "a path or the name of a trial"),
        ("person", str, "a name"),
        ("markers_moved", bool, "true or false"),
        ("offset", float, "seconds"),
        ("rate", float, "a number of Hz"),
    ):
        if key in row:
            given[key] = _value(row[key], kind, key, wanted, where)
    for key, literal in (("role", Role), ("up", Up), ("units", Units)):
        if key in row:
            choices = typing.get_args(literal)
            if row[key] not in choices:
                raise InputError(f'{key} = "{row[key]}" is not known', where, f"use {' or '.join(choices)}")
            given[key] = row[key]
    if "range" in row:
        ends = row["range"]
        if not (
            isinstance(ends, list) and len(ends) == 2 and all(_is_number(end) for end in ends) and ends[0] < ends[1]
        ):
            raise InputError("its range is not two rising times", where, "write range = [2.5, 10.0], in seconds")
        given["start"], given["stop"] = float(ends[0]), float(ends[1])
    return Trial(**given)


def _file(value: Any, key: str, path: Path, where: str) -> Path:
    if not isinstance(value, str):
        raise InputError(f"{key} is not a path", where, f'write {key} = "file"')
    found = Path(os.path.abspath(path.parent / value))
    if not found.exists():
        raise InputError(f"there is no such {key} file", found, f"check {key} of {where}")
    if found.is_dir():
        raise InputError(f"is a folder, not a {key} file", found, f"check {key} of {where}")
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _value(value: Any, kind: type, key: str, wanted: str, where: str) -> Any:
    if kind is float and _is_number(value):
        return float(value)
    if type(value) is not kind:
        raise InputError(f"{key} = {value!r} is not {wanted}", where, "correct it or delete the line")
    return value


def _known_keys(table: Mapping[str, Any], known: set[str], where: str) -> None:
    other = sorted(set(table) - known)
    if other:
        raise InputError(f'"{other[0]}" is not known there', where, f"use {', '.join(sorted(known))}")
