"""TRC in, leniently: real files break every rule of the format."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.text import (
    decode,
    is_number,
    number,
    number_table,
    read_bytes,
    refuse_ragged_blanks,
    split_cells,
    split_lines,
    thousands_mark,
)
from markerscope.solver.io.timeline import even_grid

_AXIS = re.compile(r"[XYZxyz]\d*")


def looks_like_trc(text: str) -> bool:
    """True where the text begins as TRC files do."""
    head = text[:2000].lower()
    return head.lstrip().startswith("pathfiletype") or ("datarate" in head and "frame#" in head)


def read_trc(path: str | Path, text: str | None = None) -> RawMarkers:
    """Trajectories of a TRC file."""
    lines = split_lines(decode(read_bytes(path), path) if text is None else text)
    header = _header(lines)
    at = next((i for i, line in enumerate(lines) if split_cells(line)[:1] and _is_frame(split_cells(line)[0])), None)
    if at is None:
        raise InputError("has no line of marker names (Frame#, Time, ...)", path, "export it as TRC again")
    names = _names(split_cells(lines[at]))
    rows, numbers = _rows(lines, at + 1, path)
    promised = int(_value(header, "numframes") or 0)
    if lines[-1].strip():  # the last line has no end, so that it may be half a line
        if len(rows) < promised:
            raise InputError(f"is cut off after frame {len(rows)} of {promised}", path, "copy or export it again")
        if len(split_cells(lines[-1])) < 2 + 3 * len(names):
            raise InputError(f"is cut off in line {len(lines)}", path, "copy or export it again")
    table = number_table(rows, numbers, path, mark=thousands_mark(rows))
    names, values, notes = _columns(names, table)
    if promised and promised != len(rows):
        notes += (f"The header promises {promised} frames; the file holds {len(rows)}.",)
    said = int(_value(header, "nummarkers") or 0)
    if said and said != len(names):
        notes += (f"The header promises {said} markers; the file holds {len(names)}.",)
    line = even_grid(table[:, 1], table[:, 0], _value(header, "datarate"))
    return RawMarkers(
        positions=line.spread(values),
        labels=names,
        rate=line.rate,
        first_time=line.first_time,
        units=header.get("units") or None,
        usual_up="y",
        notes=notes + line.notes,
    )


def _is_frame(cell: str) -> bool:
    return cell.lower().startswith("frame")


def _header(lines: Sequence[str]) -> dict[str, str]:
    """Keys (lower case) and values of lines 2 and 3, wherever blank lines have pushed them."""
    full = [line for line in lines[:30] if line.strip()]
    for keys, values in pairwise(full):
        if "datarate" in keys.lower():
            return dict(zip((k.lower() for k in split_cells(keys)), split_cells(values), strict=False))
    return {}


def _value(header: dict[str, str], key: str) -> float | None:
    """A positive number of the header, None where there is none."""
    try:
        value = number(header.get(key, ""))
    except ValueError:
        return None
    return value if 0 < value < 1e9 else None


def _names(cells: Sequence[str]) -> tuple[str, ...]:
    """Marker names: every third cell from the third on, or all there are where someone tidied the blanks away."""
    cells = list(cells[2:])
    while cells and not cells[-1]:
        cells.pop()
    if any(cell for i, cell in enumerate(cells) if i % 3):
        return tuple(cell for cell in cells if cell)
    return tuple(cells[::3])


def _rows(lines: Sequence[str], start: int, path: str | Path) -> tuple[list[list[str]], list[int]]:
    """Rows of data as cells, trailing blanks cut, and their line numbers from 1."""
    rows: list[list[str]] = []
    numbers: list[int] = []
    for i, line in enumerate(lines[start:], start + 1):
        cells = split_cells(line)
        while cells and not cells[-1]:
            cells.pop()
        if not cells or (not rows and not is_number(cells[0])):
            continue  # blank lines, and whatever stands between the names and the first row
        refuse_ragged_blanks(line, cells, rows, i, path)
        rows.append(cells)
        numbers.append(i)
    if not rows:
        raise InputError("has no frames", path, "copy or export it again")
    return rows, numbers


def _columns(names: tuple[str, ...], table: np.ndarray) -> tuple[tuple[str, ...], np.ndarray, tuple[str, ...]]:
    """Names, positions (T, M, 3) and notes, from as many columns as hold data or have a name."""
    notes: tuple[str, ...] = ()
    wide = -(-(table.shape[1] - 2) // 3)
    if wide > len(names):
        notes = (f"{wide - len(names)} markers have no name in the header.",)
        names += ("",) * (wide - len(names))
    values = np.full((len(table), 3 * len(names)), np.nan)
    data = table[:, 2 : 2 + values.shape[1]]
    values[:, : data.shape[1]] = data
    return names, values.reshape(len(table), len(names), 3), notes
