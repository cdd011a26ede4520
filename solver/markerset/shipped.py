"""The marker sets that ship, and any set by its name or file."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.markerset.file import read_marker_set
from markerscope.solver.markerset.marker_set import MarkerSet

_ALSO = {"cgm2": "plug-in-gait", "pig": "plug-in-gait", "ior": "ior-cast", "cast": "ior-cast", "cmu": "cmu-41"}
"""Other names that people use."""


def _folder() -> Path:
    import markerscope.resources

    return Path(markerscope.resources.__file__).parent / "marker_sets"


@cache
def shipped_names() -> tuple[str, ...]:
    """What ships, by name."""
    return tuple(sorted(path.stem for path in _folder().glob("*.toml")))


@cache
def shipped(name: str) -> MarkerSet:
    """One of the sets that ship."""
    return read_marker_set(_folder() / f"{name}.toml")


def marker_set_of(named: str | Path) -> MarkerSet:
    """A set that ships, by its name, or one in a file.

    Raises
    ------
    InputError : there is neither
    """
    text = str(named)
    known = _ALSO.get(text.lower(), text.lower())
    if known in shipped_names() and not Path(named).is_file():
        return shipped(known)
    if not Path(named).is_file():
        raise InputError(
            "there is no such marker set, neither among those that ship nor as a file",
            text,
            f"use {', '.join(shipped_names())}, or a file that markerscope markerset learn wrote",
        )
    return read_marker_set(named)
