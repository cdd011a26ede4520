"""Results as a JSON document and plain arrays, and back without loss. Nothing is ever pickled.

A value may be None, a bool, int, float, str, numpy array or scalar, a tuple, list, dict or frozenset of such
values, or a dataclass of them. Dataclasses are rebuilt only if the declared type names them (or ``also`` does): a
document cannot make anything else come to life.

A dataclass is stored under its name alone, wherever it is defined. One that is renamed keeps its results by
``STORED_AS: ClassVar[str]``, the name that it had. Version 0.1 stored the module as well, which is not looked at.
"""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

Document = Any
"""What ``json.dumps`` takes."""


_SCALARS = ("b1", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8")
"""Numpy scalars that a Python number holds exactly."""


class CodecError(ValueError):
    """A value that cannot be stored, or a document that does not describe the declared type."""


def encode(value: Any) -> tuple[Document, dict[str, np.ndarray]]:
    """A JSON document for ``value`` and the arrays that it refers to by name."""
    arrays: dict[str, np.ndarray] = {}
    return _encode(value, arrays), arrays


def decode(document: Document, arrays: Mapping[str, np.ndarray], declared: Any, also: Iterable[type] = ()) -> Any:
    """The value that ``encode`` made the document from.

    Parameters
    ----------
    document, arrays : what ``encode`` returned
    declared : type or annotation of the value; the dataclasses in it and in their fields may occur in the document
    also : further dataclasses that may occur (where an annotation is too loose to name them)

    Raises
    ------
    CodecError : the document is damaged, or names a class or field that ``declared`` does not have
    """
    allowed = dataclasses_in((declared, *also))
    try:
        return _decode(document, arrays, allowed)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise CodecError(f"not a stored {getattr(declared, '__name__', declared)}: {error}") from error


def type_name(cls: type) -> str:
    """The name a dataclass is stored under: the same for good, or results of earlier versions are computed again."""
    return str(cls.__dict__.get("STORED_AS", cls.__name__))


def _encode(value: Any, arrays: dict[str, np.ndarray]) -> Document:
    if value is None or type(value) in (bool, int, str):
        return value
    if type(value) is float:
        return value if math.isfinite(value) else {"$float": repr(value)}
    if (
        isinstance(value, np.generic)
        and value.dtype.kind in "biufU"
        and (value.dtype.kind == "U" or value.itemsize <= 8)
    ):
        return {"$scalar": [value.dtype.str, _encode(value.item(), arrays)]}
    if isinstance(value, np.ndarray):
        return {"$array": _add_array(value, arrays)}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        stored = {f.name: _encode(getattr(value, f.name), arrays) for f in dataclasses.fields(value) if f.init}
        return {"$type": type_name(type(value)), "fields": stored}
    if type(value) is list:
        return [_encode(item, arrays) for item in value]
    if type(value) is tuple:
        return {"$tuple": [_encode(item, arrays) for item in value]}
    if type(value) is frozenset:
        return {"$frozenset": [_encode(item, arrays) for item in sorted(value)]}
    if isinstance(value, Mapping):
        return {"$dict": [[_encode(key, arrays), _encode(item, arrays)] for key, item in value.items()]}
    raise CodecError(f"a {type(value).__name__} cannot be stored in a result")


def _add_array(array: np.ndarray, arrays: dict[str, np.ndarray]) -> str:
    if array.dtype.hasobject or isinstance(array, np.ma.MaskedArray):
        raise CodecError("arrays of Python objects and masked arrays cannot be stored in a result")
    name = str(len(arrays))
    arrays[name] = np.asarray(array)
    return name


def _decode(document: Document, arrays: Mapping[str, np.ndarray], allowed: Mapping[str, type]) -> Any:
    if isinstance(document, list):
        return [_decode(item, arrays, allowed) for item in document]
    if not isinstance(document, dict):
        return document
    if "$type" in document:
        cls = allowed[document["$type"].rpartition(".")[2]]
        return cls(**{name: _decode(item, arrays, allowed) for name, item in document["fields"].items()})
    ((tag, content),) = document.items()
    if tag == "$array":
        return arrays[content]
    if tag == "$scalar":
        return np.dtype(content[0]).type(_decode(content[1], arrays, allowed))
    if tag == "$float":
        return float(content)
    items = (_decode(item, arrays, allowed) for item in content)
    if tag == "$tuple":
        return tuple(items)
    if tag == "$frozenset":
        return frozenset(items)
    if tag == "$dict":
        return dict(items)
    raise KeyError(tag)


def dataclasses_in(hints: Iterable[Any]) -> dict[str, type]:
    """The dataclasses that annotations mention, and those in their fields, by the name they are stored under.

    Raises
    ------
    TypeError : two of them would be stored under one name
    """
    found: dict[str, type] = {}
    frontier = list(hints)
    while frontier:
        hint = frontier.pop()
        frontier += typing.get_args(hint)
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            known = found.get(type_name(hint))
            if known is None:
                found[type_name(hint)] = hint
                frontier += typing.get_type_hints(hint).values()
            elif known is not hint:
                raise TypeError(f"{known} and {hint} would be stored under one name, {type_name(hint)}")
    return found
