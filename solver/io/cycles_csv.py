"""Cycles as tables: every curve, their mean and spread, the figures of each cycle; and bands of controls in."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.text import decode, read_bytes

MEANS = ("quantity", "side", "unit", "percent", "n", "mean", "sd", "median", "p5", "p25", "p75", "p95", "filter")
CURVES = ("trial", "cycle", "quantity", "side", "unit", "percent", "value")
SCALARS = ("trial", "cycle", "side", "quantity", "unit", "value")


def table(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A CSV with a header line; numbers with up to five digits behind the point, empty where not known."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow([_cell(value) for value in row])
    return text.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, float | np.floating):
        return f"{float(value):.5f}".rstrip("0").rstrip(".") if np.isfinite(value) else ""
    return value


def read_bands(path: str | Path) -> dict[tuple[str, str], tuple[np.ndarray, np.ndarray]]:
    """Mean and SD (P,) by quantity and side ("" for both), over 0 to 100 percent in P even steps.

    Columns: quantity, percent, mean, sd, and optionally side; as ``mean.csv`` of a run has them.

    Raises
    ------
    InputError : the file cannot be read, or a curve is not whole
    """
    lines = list(csv.reader(io.StringIO(decode(read_bytes(path), path))))
    names = [cell.strip().lower() for cell in lines[0]] if lines else []
    if not {"quantity", "percent", "mean", "sd"} <= set(names):
        what = "has no columns quantity, percent, mean and sd"
        raise InputError(what, path, "see mean.csv, which markerscope cycles writes")
    rows: dict[tuple[str, str], list[tuple[float, float, float]]] = {}
    for number, cells in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in cells):
            continue
        row = dict(zip(names, (cell.strip() for cell in cells)))
        try:
            values = tuple(float(row.get(name) or "nan") for name in ("percent", "mean", "sd"))
        except ValueError as error:
            raise InputError(
                f"has no number in line {number}", path, "use a decimal point, or leave it empty"
            ) from error
        side = row.get("side", "").lower()
        rows.setdefault((row["quantity"], "" if side in ("both", "all") else side), []).append(values)  # type: ignore[arg-type]
    out = {}
    for (quantity, side), own in rows.items():
        at = np.array(sorted(own))
        if len(at) < 11 or abs(at[0, 0]) > 1e-6 or abs(at[-1, 0] - 100) > 1e-6:
            what = f"does not go from 0 to 100 percent for {quantity}"
            raise InputError(what, path, "give a row for every percent")
        even = np.abs(np.diff(at[:, 0]) - 100 / (len(at) - 1)).max() < 1e-3
        if not even or (at[:, 2] < 0).any():
            what = f"has uneven percents, or a negative SD, for {quantity}"
            raise InputError(what, path, "give a row for every percent, once")
        out[quantity, side] = (at[:, 1], at[:, 2])
    return out
