"""The session: a folder with ``session.toml`` (inputs, settings, edits) and ``results/``."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote_to_bytes

import tomli_w

from markerscope.solver import __version__
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import shown
from markerscope.solver.core.request import Method
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.pipeline.digest_cache import DigestCache
from markerscope.solver.pipeline.session_file import FILE_NAME as FILE_NAME
from markerscope.solver.pipeline.session_file import sealed
from markerscope.solver.pipeline.settings import from_table, overlay, to_table
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import Stage
from markerscope.solver.pipeline.store import Store

SCHEMA = 1
SUFFIX = ".markerscope"
_START_AGAIN = "correct it, or delete it and start again from the markers"


@dataclass(frozen=True)
class InputFile:
    """A file the session was made from: where it lies and what it held (SHA-256)."""

    path: Path
    digest: str = ""


@dataclass(frozen=True)
class RunSettings:
    """What holds for the solve as a whole.

    Attributes
    ----------
    method : how the body is fitted
    seed : of every random choice
    """

    method: Method = "bundle"
    seed: int = 0


@dataclass(frozen=True)
class Session:
    """What a session file says.

    Attributes
    ----------
    folder : the session's folder, absolute
    inputs : files by the name of the graph's source; one that is not there was not given
    settings : tables by stage
    edits : what the user decided by hand, tables by stage, laid over ``settings``
    run : what holds for the solve as a whole
    """

    folder: Path
    inputs: Mapping[str, InputFile] = field(default_factory=dict)
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    edits: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    run: RunSettings = RunSettings()

    @property
    def store(self) -> Store:
        """The session's results."""
        return Store(self.folder / "results")

    @property
    def digests(self) -> DigestCache:
        """The digests of the session's inputs, remembered beside its results."""
        return DigestCache(self.folder / "results" / "digests.json")

    def with_settings(self, settings: Mapping[str, Any]) -> Session:
        """The same session with the settings of some stages replaced by these dataclasses."""
        return replace(self, settings={**self.settings, **{name: to_table(value) for name, value in settings.items()}})

    def stage_settings(self, graph: Sequence[Stage]) -> dict[str, Any]:
        """The settings dataclass of every stage, edits included."""
        known = {stage.name for stage in graph}
        where = self.folder / FILE_NAME
        for name in (*self.settings, *self.edits):
            if name not in known:
                raise InputError(
                    f'settings for an unknown stage "{name}"', where, f"use one of: {', '.join(sorted(known))}"
                )
        tables = {name: overlay(self.settings.get(name, {}), self.edits.get(name, {})) for name in known}
        return {stage.name: from_table(stage.settings, tables[stage.name], f"{where}, {stage.name}") for stage in graph}

    def sources(self, names: Sequence[str]) -> dict[str, Source]:
        """The inputs as sources of the graph, read as they are now; one that was not given is None."""
        cache = self.digests
        found = {}
        for name in names:
            given = self.inputs.get(name)
            if given is not None and not given.path.exists():
                raise InputError(
                    f"the {name.removesuffix('_file')} file of {self.folder / FILE_NAME} is not there any more",
                    given.path,
                    "move it back, or correct its path in that file",
                )
            found[name] = Source.file(given.path if given else None, cache)
        cache.save()
        return found


def session_folder(path: str | Path) -> Path | None:
    """The session that a path means (its folder, or the file in it), or None where it means none."""
    path = Path(path)
    if path.name == FILE_NAME and path.is_file():
        return path.absolute().parent
    if path.is_dir() and (path / FILE_NAME).is_file():
        return path.absolute()
    return None


def save_session(session: Session) -> None:
    """Write ``session.toml``, whole or not at all."""
    folder = make_folder(session.folder)
    write_text_atomic(folder / FILE_NAME, sealed(tomli_w.dumps(session_document(session))))


def session_document(session: Session) -> dict[str, Any]:
    """What the session file says, as plain tables; paths are relative to the session's folder."""
    inputs = {
        name: {**_named(_relative(file.path, session.folder)), "sha256": file.digest}
        for name, file in session.inputs.items()
    }
    return {
        "schema": SCHEMA,
        "program": f"markerscope {__version__}",
        "run": to_table(session.run),
        "inputs": inputs,
        "settings": {name: _sayable(table) for name, table in session.settings.items()},
        "edits": {name: _sayable(table) for name, table in session.edits.items()},
    }


def _sayable(value: Any) -> Any:
    """Tables whose text TOML can hold."""
    if isinstance(value, Mapping):
        return {shown(str(name)): _sayable(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_sayable(item) for item in value]
    return shown(value) if isinstance(value, str) else value


def _named(path: str) -> dict[str, str]:
    """A path for TOML; where it is no text, its bytes stand beside it, as in an address."""
    said = shown(path)
    return {"path": said} if said == path else {"path": said, "path_bytes": quote(os.fsencode(path))}


def _path_of(table: Mapping[str, Any]) -> Any:
    """The path that ``_named`` wrote, or another that somebody wrote over it."""
    path, content = table.get("path"), table.get("path_bytes")
    exact = os.fsdecode(unquote_to_bytes(content)) if isinstance(content, str) else path
    return exact if isinstance(exact, str) and shown(exact) == path else path


def load_session(path: str | Path) -> Session:
    """Read a session from its folder or its file.

    Raises
    ------
    InputError : there is none, it is damaged, or a later version of the program wrote it
    """
    folder = session_folder(path)
    if folder is None:
        raise InputError(f"is no session: there is no {FILE_NAME} in it", path, "name the folder that holds one")
    file = folder / FILE_NAME
    try:
        content = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", file, "check its permissions") from error
    except ValueError as error:
        raise InputError(f"is not a session file: {error}", file, _START_AGAIN) from error
    return session_from(content, folder, file)


def session_from(content: Mapping[str, Any], folder: Path, file: Path) -> Session:
    """The session that ``session_document`` described.

    Parameters
    ----------
    folder : the session's, absolute; relative paths begin there
    file : where the tables were read, for messages

    Raises
    ------
    InputError : they are damaged, or a later version of the program wrote them
    """
    schema = content.get("schema")
    if not isinstance(schema, int) or schema < 1:
        raise InputError("does not say which schema it has", file, "start again from the markers")
    if schema > SCHEMA:
        program = content.get("program", "a later version")
        raise InputError(f"was written by {program}, which this version cannot read", file, "update Markerscope")
    tables = {name: _tables(content.get(name, {}), name, file) for name in ("inputs", "settings", "edits")}
    inputs = {name: _input_file(table, name, folder, file) for name, table in tables["inputs"].items()}
    run = content.get("run", {})
    if not isinstance(run, dict):
        raise InputError("[run] is not a table", file, _START_AGAIN)
    return Session(folder, inputs, tables["settings"], tables["edits"], from_table(RunSettings, run, f"{file}, run"))


def _tables(value: Any, name: str, file: Path) -> dict[str, dict[str, Any]]:
    if not (isinstance(value, dict) and all(isinstance(table, dict) for table in value.values())):
        raise InputError(f"[{name}] does not hold tables", file, _START_AGAIN)
    return value


def _input_file(table: Mapping[str, Any], name: str, folder: Path, file: Path) -> InputFile:
    path, digest = _path_of(table), table.get("sha256", "")
    if not (isinstance(path, str) and path and isinstance(digest, str)):
        raise InputError(f"[inputs.{name}] has no path", file, "add it, or start again from the markers")
    return InputFile(Path(os.path.normpath(folder / path)), digest)


def _relative(path: Path, folder: Path) -> str:
    """The path from the folder, with forward slashes, so that both can move together and to another system."""
    absolute = path.absolute()
    try:
        return Path(os.path.relpath(absolute, folder.absolute())).as_posix()
    except ValueError:  # Windows: another drive
        return absolute.as_posix()
