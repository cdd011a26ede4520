"""OpenSim storage in (MOT, STO)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.text import decode, number_table, read_bytes, split_cells, split_lines


@dataclass(frozen=True)
class Storage:
    """A table over time.

    Attributes
    ----------
    time : (T,) s
    columns : (T,) values by name, as they stand in the file
    degrees : whether its angles are in degrees, None where the header does not say
    """

    time: np.ndarray
    columns: dict[str, np.ndarray]
    degrees: bool | None

    def in_degrees(self) -> dict[str, np.ndarray]:
        """Columns with angles in degrees; OpenSim's translations (``_tx _ty _tz``) stay as they are."""
        if self.degrees is not False:
            return dict(self.columns)
        return {k: v if k.endswith(("_tx", "_ty", "_tz")) else np.degrees(v) for k, v in self.columns.items()}


def read_mot(path: str | Path) -> Storage:
    """Read an OpenSim storage file.

    Raises
    ------
    InputError : the file cannot be read
    """
    lines = split_lines(decode(read_bytes(path), path))
    end = next((i for i, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None:
        raise InputError("is not an OpenSim storage file: it has no endheader line", path, "export it again")
    header = dict(line.lower().replace(" ", "").split("=", 1) for line in lines[:end] if "=" in line)
    body = [(i, line) for i, line in enumerate(lines[end + 1 :], end + 2) if line.strip()]
    names = split_cells(body[0][1]) if body else []
    if len(body) < 2 or names[0].lower() != "time":
        raise InputError("holds no rows under a line of names that begins with time", path, "export it again")
    rows = [split_cells(line) for _, line in body[1:]]
    while names and not names[-1]:
        names.pop()
    promised = header.get("nrows", "")
    whole = [len(row) >= len(names) for row in rows]
    if not all(whole) or (promised.isdecimal() and len(rows) < int(promised)):
        line = body[1 + whole.index(False)][0] if False in whole else len(lines)
        raise InputError(f"is cut off or short of values in line {line}", path, "copy or export it again")
    table = number_table([row[: len(names)] for row in rows], [i for i, _ in body[1:]], path)
    degrees = {"yes": True, "no": False}.get(header.get("indegrees", ""))
    return Storage(table[:, 0], {_plain(name, names): table[:, k] for k, name in enumerate(names) if k}, degrees)


def _plain(name: str, names: list[str]) -> str:
    """A coordinate's own name, where the file gives its path in the model (``/jointset/hip_r/hip_flexion_r/value``).

    Speeds and other states keep their paths, as do names that would not differ any more.
    """
    parts = name.removesuffix("/value").split("/")
    if not name.startswith("/") or "jointset" not in parts or (len(parts) > 4 and not name.endswith("/value")):
        return name
    same = [other for other in names if other.removesuffix("/value").split("/")[-1] == parts[-1]]
    return parts[-1] if len(same) == 1 else name
