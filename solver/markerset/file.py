"""Marker sets as files: TOML that people can read and change."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.solver.markerset.marker_set import MarkerSet, SetMarker

_FORMAT = 1
_USUAL_SPREAD_M = 0.02
_FARTHEST_M = 2.0
_REMEDY = "markerscope markerset show plug-in-gait prints one as it should be"
_BONE = {bone: JOINTS.index(joint) for joint, bone in BONES.items()}


def write_marker_set(path: str | Path, marker_set: MarkerSet) -> None:
    """Write a set, whole or not at all.

    Raises
    ------
    InputError : the file cannot be written
    """
    from markerscope.solver.io.atomic import write_text_atomic

    write_text_atomic(path, text_of(marker_set))


def text_of(marker_set: MarkerSet) -> str:
    """A set as TOML, one line a marker."""
    import tomli_w

    head: dict[str, Any] = {
        "marker_set": marker_set.name,
        "format": _FORMAT,
        "origin": marker_set.origin,
        "source": marker_set.source,
    }
    if marker_set.notes:
        head["notes"] = list(marker_set.notes)
    if marker_set.betas:
        head["shape"] = list(marker_set.betas)
    lines = []
    for marker in marker_set.markers:
        row: dict[str, Any] = {
            "name": marker.name,
            "bone": BONES[JOINTS[marker.bone]],
            "place_mm": [round(1000 * value, 2) for value in marker.place],
            "spread_mm": round(1000 * marker.spread, 2),
        }
        row |= {"plate": marker.plate} if marker.plate else {}
        row |= {"landmark": marker.landmark} if marker.landmark else {}
        cells = [tomli_w.dumps({key: value}).strip().replace("\n", " ") for key, value in row.items()]
        lines.append(
            "    { " + ", ".join(cells).replace("[     ", "[").replace(", ]", "]").replace(",     ", ", ") + " },"
        )
    return tomli_w.dumps(head) + "markers = [\n" + "\n".join(lines) + "\n]\n"


def read_marker_set(path: str | Path) -> MarkerSet:
    """Read a set.

    Raises
    ------
    InputError : it cannot be read, or is something else
    """
    from markerscope.solver.io.text import decode, read_bytes

    text = decode(read_bytes(path), path)
    try:
        table = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"is no marker set, it cannot be read as TOML ({error})", path, _REMEDY) from error
    return _set(table, path)


def _set(table: dict[str, Any], path: str | Path) -> MarkerSet:
    rows = table.get("markers")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError('is no marker set: it has no list "markers"', path, _REMEDY)
    if table.get("format", _FORMAT) != _FORMAT:
        raise InputError(f"is of format {table['format']!r}, this program reads {_FORMAT}", path, "learn the set anew")
    shape = table.get("shape", [])
    if not (isinstance(shape, list) and all(_number(value) for value in shape)):
        raise InputError('"shape" is no list of numbers', path, _REMEDY)
    origin = table.get("origin", "learnt")
    if origin not in ("learnt", "shipped"):
        raise InputError(f'"origin" is {origin!r}', path, 'say "learnt" or "shipped"')
    name = str(table.get("marker_set") or Path(path).stem)
    notes = table.get("notes", [])
    markers = tuple(_marker(row, i, path) for i, row in enumerate(rows))
    try:
        return MarkerSet(
            name, markers, tuple(float(value) for value in shape), origin, str(table.get("source", "")),
            tuple(str(note) for note in notes) if isinstance(notes, list) else (),
        )  # fmt: skip
    except InputError as error:
        raise InputError(error.what, path, error.remedy) from error


def _marker(row: dict[str, Any], number: int, path: str | Path) -> SetMarker:
    name = row.get("name")
    called = f"marker {number + 1}" if not isinstance(name, str) or not name.strip() else name
    if not isinstance(name, str) or not name.strip():
        raise InputError(f"{called} has no name", path, _REMEDY)
    bone, place, spread = row.get("bone"), row.get("place_mm"), row.get("spread_mm", 1000 * _USUAL_SPREAD_M)
    if bone not in _BONE:
        raise InputError(f'the bone of {called} is "{bone}"', path, f"use one of {', '.join(sorted(_BONE))}")
    if not (isinstance(place, list) and len(place) == 3 and all(_number(value) for value in place)):
        raise InputError(f"the place of {called} is not three numbers", path, "give place_mm = [x, y, z]")
    if max(abs(value) for value in place) > 1000 * _FARTHEST_M:
        raise InputError(f"{called} is more than {_FARTHEST_M:g} m from the body", path, "places are in millimetres")
    if not (_number(spread) and spread > 0):
        raise InputError(f"the spread of {called} is {spread!r}", path, "give millimetres above 0")
    return SetMarker(
        name,
        _BONE[bone],
        tuple(float(value) / 1000 for value in place),  # type: ignore[arg-type]
        float(spread) / 1000,
        str(row.get("plate", "")),
        str(row.get("landmark", "")),
    )


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
