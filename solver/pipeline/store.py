"""The content-addressed store of results: ``<root>/<stage>/<key>/`` with ``manifest.json`` and ``arrays.npz``.

An entry is written under a temporary name and renamed, so it is there whole or not at all, whatever ends the writer;
two processes may write the same key. An entry that does not match its own checksums counts as absent.
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
import time
import zipfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.io.atomic import cannot_write
from markerscope.solver.pipeline.codec import decode, encode

SCHEMA = 1
_TEMPORARY = ".tmp-"
_ABANDONED_S = 600.0
"""Writing takes seconds: a temporary folder older than this was left by a process that ended."""


@dataclass(frozen=True)
class Entry:
    """What the store knows of a result without loading it.

    Attributes
    ----------
    stage, key : which result
    folder : where it lies
    about : whatever the writer noted (settings, keys of the inputs, seconds, headline)
    size : bytes of its arrays
    """

    stage: str
    key: str
    folder: Path
    about: Mapping[str, Any] = field(default_factory=dict)
    size: int = 0


class Absent(KeyError):
    """The store has no sound result of that key."""


class Store:
    """Results by stage and key in a folder."""

    def __init__(self, root: str | Path) -> None:
        self.root = Path(root)

    def folder(self, stage: str, key: str) -> Path:
        """Where an entry lies or would lie."""
        return self.root / stage / key

    def has(self, stage: str, key: str) -> bool:
        """Whether the result is there (its arrays are checked when it is loaded)."""
        return self.entry(stage, key) is not None

    def entry(self, stage: str, key: str) -> Entry | None:
        """What is known of a result, or None where it is absent or damaged."""
        manifest = self._manifest(stage, key)
        if manifest is None:
            return None
        return Entry(stage, key, self.folder(stage, key), manifest["about"], manifest["arrays"]["size"])

    def get(self, stage: str, key: str, declared: Any, also: Iterable[type] = ()) -> Any:
        """The result of the declared type.

        Raises
        ------
        Absent : it is not there, damaged, or the declared type has changed since
        """
        manifest = self._manifest(stage, key)
        if manifest is None:
            raise Absent(stage, key)
        path = self.folder(stage, key) / "arrays.npz"
        try:
            if _file_checksum(path) != manifest["arrays"]["sha256"]:
                raise Absent(stage, key)
            with np.load(path, allow_pickle=False) as stored:
                arrays = {name: stored[name] for name in stored.files}
            return decode(manifest["value"], arrays, declared, also)
        except (OSError, EOFError, ValueError, zipfile.BadZipFile) as error:
            raise Absent(stage, key) from error

    def put(self, stage: str, key: str, value: Any, about: Mapping[str, Any] | None = None) -> Entry:
        """Store a result; a sound entry of the same key stays as it is.

        Raises
        ------
        InputError : the file system refuses (full, read-only...); nothing is left behind
        CodecError : the value holds something that cannot be stored
        """
        document, arrays = encode(value)
        temporary = self.root / stage / f"{_TEMPORARY}{os.getpid()}-{secrets.token_hex(4)}"
        try:
            temporary.mkdir(parents=True)
            with open(temporary / "arrays.npz", "wb") as file:
                np.savez(file, **arrays)  # type: ignore[arg-type]
                _flush(file)
            content = {
                "schema": SCHEMA,
                "stage": stage,
                "key": key,
                "about": json.loads(json.dumps(dict(about or {}))),
                "value": document,
                "arrays": {
                    "sha256": _file_checksum(temporary / "arrays.npz"),
                    "size": (temporary / "arrays.npz").stat().st_size,
                },
            }
            with open(temporary / "manifest.json", "w", encoding="utf-8") as text:
                json.dump({"checksum": _checksum(content), **content}, text)
                _flush(text)
            self._move_in(temporary, stage, key)
        except OSError as error:
            raise cannot_write(self.folder(stage, key), error) from error
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
        stored = self.entry(stage, key)
        if stored is None:
            raise cannot_write(self.folder(stage, key), OSError("it changed while it was written"))
        return stored

    def discard(self, stage: str, key: str) -> None:
        """Take a result away, whole or damaged; another process never sees half of it."""
        doomed = self.root / stage / f"{_TEMPORARY}{os.getpid()}-{secrets.token_hex(4)}"
        with suppress(FileNotFoundError):
            os.rename(self.folder(stage, key), doomed)
            shutil.rmtree(doomed, ignore_errors=True)

    def list(self, stage: str | None = None) -> tuple[Entry, ...]:
        """Every sound entry, of one stage or of all."""
        folders = self.root.glob("*/*/" if stage is None else f"{stage}/*/")
        found = (self.entry(folder.parent.name, folder.name) for folder in sorted(folders))
        return tuple(entry for entry in found if entry is not None)

    def clean(self, process: int | None = None) -> None:
        """Remove temporary folders left by writers that ended: those of one process, or all that are old."""
        pattern = f"*/{_TEMPORARY}{'*' if process is None else f'{process}-*'}"
        for folder in self.root.glob(pattern):
            with suppress(OSError):
                if process is not None or time.time() - folder.stat().st_mtime > _ABANDONED_S:
                    shutil.rmtree(folder, ignore_errors=True)

    def _manifest(self, stage: str, key: str) -> dict[str, Any] | None:
        """The manifest of an entry if it is whole and belongs there."""
        folder = self.folder(stage, key)
        try:
            content = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
            checksum = content.pop("checksum")
            sound = (
                checksum == _checksum(content)
                and (content["schema"], content["stage"], content["key"]) == (SCHEMA, stage, key)
                and (folder / "arrays.npz").stat().st_size == content["arrays"]["size"]
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None
        return content if sound else None

    def _move_in(self, temporary: Path, stage: str, key: str) -> None:
        """Give a finished temporary folder its final name, unless a sound entry is there already."""
        for attempt in range(5):
            if self.has(stage, key):
                return
            self.discard(stage, key)
            try:
                os.rename(temporary, self.folder(stage, key))
            except OSError:
                if attempt == 4:
                    raise
                # Another writer was quicker, or (on Windows) a scanner holds the files for a moment.
                time.sleep(0.05 * attempt)
            else:
                return


def _checksum(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _file_checksum(path: Path) -> str:
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _flush(file: Any) -> None:
    """Have the data on disk before the rename, or a crash could leave empty files under the final name."""
    file.flush()
    os.fsync(file.fileno())
