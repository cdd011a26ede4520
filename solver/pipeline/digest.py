"""Digests: what a file holds, what a settings object says, and the key of a result computed from them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from solver.errors import InputError
from solver.io.atomic import write_text_atomic

KEY_LENGTH = 32
"""Hexadecimal digits of a result's key: 128 bits, short enough for every file system."""

_SETTLED_S = 2.0
"""A file changed this recently may change again without its time stamp showing it, so it is not remembered."""


def canonical(value: Any) -> Any:
    """Plain JSON that is equal for equal settings: 1 and 1.0 are the same, and so are (1, 2) and [1, 2]."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, np.generic):
        return canonical(value.item())
    if isinstance(value, int):
        return value
    if isinstance(value, float):
        return int(value) if value.is_integer() else value
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, np.ndarray):
        if value.dtype.hasobject:
            raise TypeError("an array of Python objects has no digest")
        content = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
        return ["$array", value.dtype.str, list(value.shape), content]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: canonical(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [canonical(item) for item in value]
    if isinstance(value, frozenset | set):
        return ["$set", *sorted((canonical(item) for item in value), key=repr)]
    raise TypeError(f"a {type(value).__name__} in the settings has no digest")


def digest_of(value: Any) -> str:
    """The key (32 hexadecimal digits) of anything ``canonical`` takes."""
    text = json.dumps(canonical(value), sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:KEY_LENGTH]


def result_key(stage: str, version: int, settings: Any, inputs: Mapping[str, str]) -> str:
    """Key of a stage's result.

    Parameters
    ----------
    stage, version : name and version of the stage
    settings : its settings dataclass
    inputs : key of each stage, and digest of each file, that it is computed from, by the name the stage has for it
    """
    return digest_of({"stage": stage, "version": version, "settings": settings, "inputs": dict(inputs)})


def file_digest(path: str | Path) -> str:
    """SHA-256 of a file's content, as ``sha256sum`` prints it."""
    if Path(path).is_dir():
        raise InputError("is a folder, not a file", path, "name the file in it")
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError as error:
        raise InputError("there is no such file", path, "check the name and the folder") from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", path, "check its permissions") from error


class DigestCache:
    """File digests remembered by path, size and time of change, so that a long video is read once.

    Parameters
    ----------
    path : the JSON file it is kept in; a missing or damaged one counts as empty
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._known: dict[str, list[Any]] = {}
        self._changed = False
        try:
            known = json.loads(self._path.read_text(encoding="utf-8"))
            self._known = {str(name): list(row) for name, row in known.items()}
        except (OSError, ValueError, AttributeError, TypeError):
            pass

    def digest(self, path: str | Path) -> str:
        """``file_digest(path)``, from memory if the file is as it was."""
        name = str(Path(path).resolve())
        try:
            status = Path(path).stat()
        except OSError:
            return file_digest(path)
        stamp = [status.st_size, status.st_mtime_ns]
        row = self._known.get(name)
        if row is not None and row[:2] == stamp:
            return str(row[2])
        value = file_digest(path)
        if time.time() - status.st_mtime > _SETTLED_S:
            self._known[name] = [*stamp, value]
            self._changed = True
        return value

    def save(self) -> None:
        """Write what was learned, if anything, and if its folder is there: a refused input must not make one."""
        if self._changed and self._path.parent.is_dir():
            write_text_atomic(self._path, json.dumps(self._known, indent=1, sort_keys=True) + "\n")
            self._changed = False
