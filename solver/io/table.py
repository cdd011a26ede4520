"""Marker tables in: CSV and TSV, wide, as Nexus, Qualisys, Motive, pandas and our own writer lay them out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from solver.errors import InputError
from solver.io.raw import RawMarkers
from solver.io.table_columns import Columns, find_columns
from solver.io.text import (
    decode,
    is_number,
    number,
    number_table,
    read_bytes,
    refuse_ragged_blanks,
    split_cells,
    split_lines,
)
from solver.io.timeline import even_grid
from solver.markers import UpAxis

_RATES = ("rate", "export frame rate", "capture frame rate", "frequency", "datarate", "frame rate", "samplerate")


@dataclass(frozen=True)
class _Sheet:
    """A table cut into what stands above the data and the data: rows of cells and their line numbers from 1."""

    header: list[list[str]]
    rows: list[list[str]]
    numbers: list[int]
    facts: dict[str, str] = field(default_factory=dict)
    names: list[str] | None = None


def read_table(path: str | Path, text: str | None = None) -> RawMarkers:
    """Trajectories of a CSV or TSV file, one row a frame."""
    lines = split_lines(decode(read_bytes(path), path) if text is None else text)
    sheet = _cut(lines, path)
    if not sheet.rows:
        raise InputError("has no rows of numbers", path, "export the marker trajectories again")
    if lines[-1].strip() and sheet.numbers[-1] == len(lines):  # the last line has no end, so that it may be half a line
        if len(sheet.rows) < _promised(sheet):
            what = f"is cut off after frame {len(sheet.rows)} of {_promised(sheet)}"
            raise InputError(what, path, "copy or export it again")
        if len(sheet.rows) > 1 and len(sheet.rows[-1]) < max(map(len, sheet.rows[:-1])):
            raise InputError(f"is cut off in line {len(lines)}", path, "copy or export it again")
    columns = _qualisys_columns(sheet) if sheet.names else find_columns(sheet.header)
    if columns is None:
        remedy = "name the columns like C7_x, C7_y, C7_z, or put a row of names above a row of X, Y, Z"
        raise InputError("has no header that names markers with x, y and z", path, remedy)
    return _read(sheet, columns, path)


def _read(sheet: _Sheet, columns: Columns, path: str | Path) -> RawMarkers:
    table = number_table(sheet.rows, sheet.numbers, path)
    used = [columns.time or 0, columns.frame or 0, *columns.filled.values(), *(k for xyz in columns.xyz for k in xyz)]
    wide = np.full((len(table), max(max(used) + 1, table.shape[1])), np.nan)
    wide[:, : table.shape[1]] = table
    positions = wide[:, np.array(columns.xyz)]
    filled = np.zeros(positions.shape[:2], dtype=bool)
    for i, name in enumerate(columns.names):
        if name in columns.filled:
            filled[:, i] = wide[:, columns.filled[name]] > 0
    time = None if columns.time is None else wide[:, columns.time] * columns.time_scale
    frame = None if columns.frame is None else wide[:, columns.frame]
    line = even_grid(time, frame, _rate(sheet.facts))
    notes: tuple[str, ...] = ()
    if columns.left_out:
        shown = ", ".join(columns.left_out[:5]) + ("..." if len(columns.left_out) > 5 else "")
        notes = (f"Columns that are no marker coordinates were left out: {shown}.",)
    promised = _promised(sheet)
    if promised and promised != len(table):
        notes += (f"The header promises {promised} frames; the file holds {len(table)}.",)
    return RawMarkers(
        positions=line.spread(positions),
        labels=columns.names,
        rate=line.rate,
        first_time=line.first_time,
        first_frame=0 if frame is None or not 0 < frame[0] < 2**31 else int(frame[0]) - 1,
        units=columns.units or sheet.facts.get("units") or sheet.facts.get("length units"),
        up=_up(sheet.facts),
        usual_up="y" if "format version" in sheet.facts else None,
        filled=line.spread(filled) if columns.filled else None,
        notes=notes + line.notes,
    )


def _cut(lines: Sequence[str], path: str | Path) -> _Sheet:
    """Part header from data: the data begin with the first long run of numbers that has a header above it."""
    facts: dict[str, str] = {}
    names: list[str] | None = None
    header: list[list[str]] = []
    rows: list[list[str]] = []
    numbers: list[int] = []
    section = next((i for i, line in enumerate(lines) if line.strip(' \t",;') == "Trajectories"), None)
    if section is not None:  # Nexus puts devices and model outputs into sections of their own
        facts["rate"] = next(iter(split_cells(lines[section + 1])), "") if section + 1 < len(lines) else ""
    start = 0 if section is None else section + 2
    for i, line in enumerate(lines[start:], start + 1):
        if line.startswith("#") and not rows:
            facts |= _remarks(line)
            continue
        cells = split_cells(line)
        if not any(cells):
            if rows and section is not None:
                break
            continue
        if rows or _is_data(cells):
            refuse_ragged_blanks(line, cells, rows, i, path)
            rows.append(cells)
            numbers.append(i)
            continue
        full = cells[: max(k for k, cell in enumerate(cells) if cell) + 1]
        if full[0].upper() == "MARKER_NAMES":
            names = full[1:]
        elif full[0] and (len(full) == 2 or full[0].lower() == "format version"):
            facts |= dict(zip((cell.lower() for cell in full[::2]), full[1::2], strict=False))
        header.append(cells)
    return _Sheet(header, rows, numbers, facts, names)


def _is_data(cells: Sequence[str]) -> bool:
    """True for a row of at least three numbers and nothing but numbers and blanks."""
    full = [cell for cell in cells if cell]
    if len(full) < 3 and not (len(cells) > 3 and full):
        return False
    try:
        for cell in full:
            number(cell)
    except ValueError:
        return False
    return is_number(full[0])


def _remarks(line: str) -> dict[str, str]:
    """Facts of a remark like ``# units=mm; up=z; rate=100``."""
    pairs = (part.partition("=") for part in line.lstrip("# ").split(";"))
    return {key.strip().lower(): value.strip() for key, equals, value in pairs if equals}


def _fact(facts: dict[str, str], key: str) -> float | None:
    try:
        value = number(facts.get(key, ""))
    except ValueError:
        return None
    return value if 0 < value < 1e9 else None


def _promised(sheet: _Sheet) -> int:
    """Number of frames that the header names, 0 where it names none."""
    return int(_fact(sheet.facts, "no_of_frames") or _fact(sheet.facts, "frames") or 0)


def _rate(facts: dict[str, str]) -> float | None:
    return next((value for key in _RATES if (value := _fact(facts, key)) is not None), None)


def _up(facts: dict[str, str]) -> UpAxis | None:
    axes: dict[str, UpAxis] = {"x": "x", "y": "y", "z": "z"}
    return axes.get(facts.get("up", "").lower())


def _qualisys_columns(sheet: _Sheet) -> Columns | None:
    """Qualisys names the markers in one row; frame and time stand before the coordinates, or do not."""
    names = tuple(sheet.names or ())
    width = max(map(len, sheet.rows))
    while width > 3 * len(names) and not any(len(row) >= width and row[width - 1] for row in sheet.rows):
        width -= 1
    lead = width - 3 * len(names)
    if lead < 0 or lead > 2:
        return find_columns(sheet.header)
    xyz = tuple((lead + 3 * i, lead + 3 * i + 1, lead + 3 * i + 2) for i in range(len(names)))
    return Columns(names, xyz, 1 if lead == 2 else None, 0 if lead else None)
