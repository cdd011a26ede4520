"""Marker tables in: CSV and TSV, wide, as Nexus, Qualisys, Motive, pandas and our own writer lay them out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import UpAxis
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.table_columns import Columns, find_columns, find_long_columns
from markerscope.solver.io.table_long import widen
from markerscope.solver.io.table_sheet import Sheet, cut, times_of_day
from markerscope.solver.io.text import decode, is_number, number, number_table, read_bytes, split_lines, thousands_mark
from markerscope.solver.io.timeline import even_grid

_RATES = ("rate", "export frame rate", "capture frame rate", "frequency", "datarate", "frame rate", "samplerate")
_YES = ("1", "true", "yes", "t")


def read_table(path: str | Path, text: str | None = None) -> RawMarkers:
    """Trajectories of a CSV or TSV file, one row a frame."""
    text = decode(read_bytes(path), path) if text is None else text
    lines = split_lines(text)
    sheet = cut(lines, path)
    if not sheet.rows:
        raise InputError("has no rows of numbers", path, "export the marker trajectories again")
    if lines[-1].strip() and sheet.numbers[-1] == len(lines):  # the last line has no end, so that it may be half a line
        if len(sheet.rows) < _promised(sheet):
            what = f"is cut off after frame {len(sheet.rows)} of {_promised(sheet)}"
            raise InputError(what, path, "copy or export it again")
        if len(sheet.rows) > 1 and len(sheet.rows[-1]) < max(map(len, sheet.rows[:-1])):
            raise InputError(f"is cut off in line {len(lines)}", path, "copy or export it again")
    sheet = _with_row_names(sheet)
    long = None if sheet.names else find_long_columns(sheet.header)
    if long is not None:
        sheet = widen(sheet, long, path)
    columns = _qualisys_columns(sheet) if sheet.names else find_columns(sheet.header)
    if columns is None:
        remedy = "name the columns like C7_x, C7_y, C7_z, or put a row of names above a row of X, Y, Z"
        raise InputError("has no header that names markers with x, y and z", path, remedy)
    return _read(sheet, columns, thousands_mark(sheet.rows), path)


def _with_row_names(sheet: Sheet) -> Sheet:
    """The header moved by one where the rows have a name each that the titles leave out, as R writes them."""
    width = sheet.width
    at = next((i for i in range(len(sheet.header) - 1, -1, -1) if find_columns([sheet.header[i]]) is not None), None)
    if at is None or len(_trimmed(sheet.header[at])) != width - 1 or len(sheet.header[at]) != width - 1:
        return sheet
    if not all(row[-1] for row in sheet.rows[:50] if len(row) == width) or not _row_names(sheet):
        return sheet
    header = [["", *row] if len(row) == width - 1 else row for row in sheet.header]
    note = "The rows have one cell more than the titles; the first one was taken for the row's name."
    return replace(sheet, header=header, notes=(*sheet.notes, note))


def _row_names(sheet: Sheet) -> bool:
    """Whether the first cells count the rows, or are words."""
    first = [row[0] for row in sheet.rows]
    if not all(map(is_number, first)):
        return True
    values = np.array([number(cell) for cell in first])
    return bool((np.diff(values) == 1).all()) and values[0] in (0, 1)


def _trimmed(row: list[str]) -> list[str]:
    return row[: max((k + 1 for k, cell in enumerate(row) if cell), default=0)]


def _read(sheet: Sheet, columns: Columns, mark: str | None, path: str | Path) -> RawMarkers:
    clock = None
    if columns.time is not None and not is_number(sheet.rows[0][columns.time]):
        clock = times_of_day(sheet.rows, columns.time)
    coordinates = [k for xyz in columns.xyz for k in xyz]
    counted = [k for k in (None if clock else columns.time, columns.frame) if k is not None]
    table = number_table(sheet.rows, sheet.numbers, path, [*counted, *coordinates], mark)
    used = [*counted, *coordinates, *columns.filled.values(), 0]
    wide = table
    if max(used) >= table.shape[1]:
        wide = np.full((len(table), max(used) + 1), np.nan)
        wide[:, : table.shape[1]] = table
    positions = wide[:, np.array(columns.xyz)]
    filled = np.zeros(positions.shape[:2], dtype=bool)
    for i, name in enumerate(columns.names):
        if name in columns.filled:
            filled[:, i] = _flags(sheet, columns.filled[name])
    time = None if columns.time is None else wide[:, columns.time] * (columns.time_scale or 1.0)
    if clock is not None:
        time = _past_midnight(np.array(clock))
    frame = None if columns.frame is None else wide[:, columns.frame]
    line = even_grid(time, frame, _rate(sheet.facts), unit_known=columns.time_scale is not None or clock is not None)
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
        assets=columns.assets,
        notes=(*sheet.notes, *_notes(sheet, columns, len(table)), *line.notes),
    )


def _notes(sheet: Sheet, columns: Columns, rows: int) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    if columns.left_out:
        shown = ", ".join(columns.left_out[:5]) + ("..." if len(columns.left_out) > 5 else "")
        notes = (f"Columns that are no marker coordinates were left out: {shown}.",)
    promised = _promised(sheet)
    if promised and promised != rows:
        notes += (f"The header promises {promised} frames; the file holds {rows}.",)
    return notes


def _flags(sheet: Sheet, column: int) -> np.ndarray:
    """(T,) True where a column says yes."""
    cells = [row[column].strip().lower() if column < len(row) else "" for row in sheet.rows]
    return np.array([cell in _YES or (is_number(cell) and number(cell) > 0) for cell in cells])


def _past_midnight(time: np.ndarray) -> np.ndarray:
    """Times of day that go on rising behind midnight, s."""
    return time + 86400.0 * np.concatenate([[0], np.cumsum(np.diff(time) < -43200)])


def _fact(facts: dict[str, str], key: str) -> float | None:
    try:
        value = number(facts.get(key, ""))
    except ValueError:
        return None
    return value if 0 < value < 1e9 else None


def _promised(sheet: Sheet) -> int:
    """Number of frames that the header names, 0 where it names none."""
    return int(_fact(sheet.facts, "no_of_frames") or _fact(sheet.facts, "frames") or 0)


def _rate(facts: dict[str, str]) -> float | None:
    return next((value for key in _RATES if (value := _fact(facts, key)) is not None), None)


def _up(facts: dict[str, str]) -> UpAxis | None:
    axes: dict[str, UpAxis] = {"x": "x", "y": "y", "z": "z"}
    return axes.get(facts.get("up", "").lower())


def _qualisys_columns(sheet: Sheet) -> Columns | None:
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
