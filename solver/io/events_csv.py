"""Events as CSV: one row each, which a user may edit."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.text import decode, read_bytes

FILE_NAME = "events.csv"
HEADER = ("time", "side", "event", "source", "spread")


@dataclass(frozen=True)
class EventRow:
    """A row: s, side, what happened, who says so, and s between the estimates (NaN where there was one)."""

    time: float
    side: str
    event: str
    source: str
    spread: float = float("nan")


def events_csv(rows: Iterable[EventRow]) -> str:
    """The table as text."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(HEADER)
    for row in rows:
        spread = f"{row.spread:.4f}" if np.isfinite(row.spread) else ""
        writer.writerow([f"{row.time:.4f}", row.side, row.event, row.source, spread])
    return text.getvalue()


def read_events_csv(path: str | Path) -> tuple[EventRow, ...]:
    """Rows of a table with the columns time (s), side and event; others are optional.

    Raises
    ------
    InputError : the file cannot be read, has no such columns, or a time that is none
    """
    lines = list(csv.reader(io.StringIO(decode(read_bytes(path), path))))
    names = [cell.strip().lower() for cell in lines[0]] if lines else []
    if not {"time", "side", "event"} <= set(names):
        raise InputError("has no columns time, side and event", path, "see what markerscope events writes")
    rows = []
    for number, cells in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(names, (cell.strip() for cell in cells)))
        try:
            time, spread = float(row["time"]), float(row.get("spread") or "nan")
        except (ValueError, KeyError) as error:
            raise InputError(
                f"has no time in line {number}", path, "give it in seconds, with a decimal point"
            ) from error
        if len(cells) < 3 or row.get("side", "").lower() not in ("left", "right", "general"):
            raise InputError(f"names no side in line {number}", path, "say left, right or general")
        rows.append(EventRow(time, row["side"].lower(), row["event"], row.get("source") or "hand", spread))
    return tuple(rows)
