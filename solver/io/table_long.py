"""Tables in long form, a row for each marker and frame, made wide."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.table_columns import LongColumns
from markerscope.solver.io.table_sheet import Sheet


def widen(sheet: Sheet, columns: LongColumns, path: str | Path) -> Sheet:
    """The same with a row for each frame and three columns for each marker; what has no row in a frame is lost.

    Raises
    ------
    InputError : neither time nor frame says which rows belong together, or a marker has two rows in one
    """
    leads = [k for k in (columns.frame, columns.time) if k is not None]
    if not leads:
        raise InputError("has a row for each marker, but no column of time or frame", path, "add one of them")
    names: dict[str, int] = {}
    found: dict[str, tuple[int, dict[int, list[str]]]] = {}
    order: list[str] = []
    for row, line in zip(sheet.rows, sheet.numbers, strict=True):
        cells = [row[k] if k < len(row) else "" for k in (*leads, columns.name, *columns.xyz)]
        key, name = cells[0], cells[len(leads)]
        marker = names.setdefault(name, len(names))
        if key not in found:
            found[key] = (line, {-1: cells[: len(leads)]})
            order.append(key)
        if marker in found[key][1]:
            raise InputError(f"line {line} says {name} twice at {key}", path, "export it again")
        found[key][1][marker] = cells[-3:]
    titles = ["frame"] * (columns.frame is not None) + ["time"] * (columns.time is not None)
    header = [*titles, *(f"{name}_{axis}" for name in names for axis in "xyz")]
    rows = [
        [*held[-1], *(cell for m in range(len(names)) for cell in held.get(m, ["", "", ""]))]
        for _, held in (found[key] for key in order)
    ]
    return replace(sheet, header=[header], rows=rows, numbers=[found[key][0] for key in order])
