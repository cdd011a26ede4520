"""Joint angles in: the ``angles.csv`` of a result, and angle tables of OpenSim."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.mot import read_mot
from markerscope.solver.io.text import decode, read_bytes

ANGLES = "angles.csv"
_LENGTHS = ("_tx", "_ty", "_tz")


@dataclass(frozen=True, eq=False)
class AngleTable:
    """Angles as a file holds them.

    Attributes
    ----------
    time : (T,) s
    names : A columns
    degrees : (T, A), NaN = not known
    about : what ``angles.json`` says, empty where there is none
    """

    time: np.ndarray
    names: tuple[str, ...]
    degrees: np.ndarray
    about: dict[str, Any]

    @property
    def positive(self) -> dict[str, str]:
        """What a positive value means, by column, where the file says so."""
        rows = self.about.get("angles", [])
        return {row["column"]: row.get("positive", "") for row in rows if isinstance(row, dict) and "column" in row}


def read_angles(path: str | Path) -> AngleTable:
    """A result's folder or its ``angles.csv``, or an angle table of OpenSim (.mot, .sto).

    Raises
    ------
    InputError : it cannot be read, or holds no angles over time
    """
    path = Path(path)
    if path.suffix.lower() in (".mot", ".sto"):
        table = read_mot(path)
        columns = {name: values for name, values in table.in_degrees().items() if not name.endswith(_LENGTHS)}
        return AngleTable(table.time, tuple(columns), np.stack(list(columns.values()), axis=1), {})
    path = path / ANGLES if path.is_dir() else path
    lines = decode(read_bytes(path), path).splitlines()
    names = [cell.strip() for cell in lines[0].split(",")] if lines else []
    if len(lines) < 3 or names[:1] != ["time"] or len(names) < 2:
        raise InputError("holds no angles under a line of names that begins with time", path, "solve again")
    try:
        rows = np.array([[float(cell) if cell.strip() else np.nan for cell in line.split(",")] for line in lines[1:]])
    except ValueError as error:
        raise InputError("is damaged: its rows are no numbers, or not equally many", path, "solve again") from error
    if rows.shape[1] != len(names) or not (np.diff(rows[:, 0]) > 0).all():
        raise InputError("is damaged: its rows do not fit its names, or its times do not rise", path, "solve again")
    return AngleTable(rows[:, 0], tuple(names[1:]), rows[:, 1:], _about(path.with_suffix(".json")))


def _about(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
