"""Digests: what a file holds, what a settings object says, and the key of a result computed from them."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError

CHANGES_NOTHING = {"changes": "nothing"}
"""Metadata of a field of settings that no result depends on: it is kept with the session, and no key holds it."""
KEY_LENGTH = 32
"""Hexadecimal digits of a result's key: 128 bits, short enough for every file system."""


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
        own = [field for field in dataclasses.fields(value) if field.metadata.get("changes") != "nothing"]
        return {field.name: canonical(getattr(value, field.name)) for field in own}
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
