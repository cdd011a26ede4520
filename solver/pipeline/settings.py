"""Settings dataclasses as plain tables for the session file, and back with every value checked."""

from __future__ import annotations

import dataclasses
import types
import typing
from collections.abc import Collection, Hashable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from markerscope.solver.core.errors import InputError

UNSET = "unset"
"""TOML has no null: the names of the settings that are None stand in a list under this key."""


def to_table(settings: Any) -> dict[str, Any]:
    """A settings dataclass as nested tables and lists of plain values."""
    values = {field.name: getattr(settings, field.name) for field in dataclasses.fields(settings)}
    table = {name: _plain(value) for name, value in values.items() if value is not None}
    unset = [name for name, value in values.items() if value is None]
    return table | ({UNSET: unset} if unset else {})


def from_table(cls: type, table: Mapping[str, Any], where: str = "settings") -> Any:
    """The settings that a table describes; what it does not name keeps its default.

    Parameters
    ----------
    cls : the settings dataclass
    table : values by name, as ``to_table`` writes and TOML reads them
    where : what to call the table in messages

    Raises
    ------
    InputError : a name or a value that the settings do not know
    """
    hints = _hints(cls)
    fields = {field.name for field in dataclasses.fields(cls)}
    values: dict[str, Any] = dict.fromkeys(_names(table.get(UNSET, []), where))
    values |= {name: value for name, value in table.items() if name != UNSET}
    for name in values:
        if name not in fields:
            raise InputError(f'has no setting "{name}"', where, f"use one of: {', '.join(sorted(fields)) or 'none'}")
    try:
        return cls(**{name: _typed(value, hints[name], f"{where}, {name}") for name, value in values.items()})
    except (TypeError, ValueError) as error:
        raise InputError(f"cannot be used: {error}", where, "correct the value or delete the line") from error


def overlay(table: Mapping[str, Any], over: Mapping[str, Any], where: str = "settings") -> dict[str, Any]:
    """``table`` with what ``over`` says, be it a value or that there is none."""
    unset = [name for name in _names(table.get(UNSET, []), where) if name not in over]
    unset += [name for name in _names(over.get(UNSET, []), where) if name not in unset]
    merged = {name: value for name, value in {**table, **over}.items() if name not in (UNSET, *unset)}
    return merged | ({UNSET: unset} if unset else {})


def without(table: Mapping[str, Any], names: Collection[str]) -> dict[str, Any]:
    """A table that no longer says anything of these settings."""
    kept = {name: value for name, value in table.items() if name not in (UNSET, *names)}
    unset = [name for name in table.get(UNSET, ()) if name not in names]
    return kept | ({UNSET: unset} if unset else {})


@cache
def _hints(cls: Hashable) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _names(value: Any, where: str) -> list[str]:
    if not (isinstance(value, list) and all(isinstance(name, str) for name in value)):
        raise InputError(f'"{UNSET}" is not a list of names', where, "correct it or delete the line")
    return value


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return to_table(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Path):
        return value.as_posix()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, bool | int | float | str):
        return value
    raise TypeError(f"a {type(value).__name__} cannot stand in the session file")


def _typed(value: Any, hint: Any, where: str) -> Any:
    """``value`` as the annotation wants it, or an InputError that says what was expected."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        return _first_match(value, arguments, where)
    if hint is Any or (hint in (None, type(None)) and value is None):
        return value
    if origin is Literal:
        if value in arguments:
            return value
        raise _wrong(value, " or ".join(repr(argument) for argument in arguments), where)
    if dataclasses.is_dataclass(hint) and isinstance(value, Mapping):
        return from_table(typing.cast(type, hint), value, where)
    if origin in (tuple, list) and isinstance(value, list | tuple):
        return _sequence(value, origin, arguments, where)
    if origin in (dict, Mapping) and isinstance(value, Mapping):
        return {_key(key, arguments[0]): _typed(item, arguments[1], f"{where}.{key}") for key, item in value.items()}
    if hint is np.ndarray or origin is np.ndarray:
        return np.asarray(value)
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if hint is Path and isinstance(value, str):
        return Path(value)
    if hint in (int, str, bool) and type(value) is hint:
        return value
    raise _wrong(value, getattr(hint, "__name__", str(hint)), where)


def _sequence(value: Any, origin: Any, arguments: tuple[Any, ...], where: str) -> Any:
    if origin is list or (len(arguments) == 2 and arguments[1] is Ellipsis):
        return origin(_typed(item, arguments[0], where) for item in value)
    if len(value) != len(arguments):
        raise _wrong(value, f"{len(arguments)} values", where)
    return tuple(_typed(item, hint, where) for item, hint in zip(value, arguments))


def _key(key: str, hint: Any) -> Any:
    return int(key) if hint is int else key


def _first_match(value: Any, hints: tuple[Any, ...], where: str) -> Any:
    failure: InputError | None = None
    for hint in hints:
        try:
            return _typed(value, hint, where)
        except InputError as error:
            failure = failure or error
    assert failure is not None
    raise failure


def _wrong(value: Any, expected: str, where: str) -> InputError:
    return InputError(f"{value!r} is not what is expected there ({expected})", where, "correct it or delete the line")
