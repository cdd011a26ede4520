"""Which column of a marker table holds what, from its header rows in any of the customary layouts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from solver.io.units import metres_per_unit

_AXIS = re.compile(r"([xyzXYZ])\d*\s*(?:[\[(]\s*([^\W\d]+)\s*[\])])?")
_FLAT = re.compile(
    r"(?P<name>.*[^\s_.:\-])?[\s_.:\-]*[\[(]?(?P<axis>[xyzXYZ])[\])]?(?:[\s_]*[\[(]?(?P<unit>mm|cm|dm|m|in|ft)[\])]?)?"
)
_NUMBERED = re.compile(r"(?P<name>.+)_(?P<axis>[123])")
_TIME = re.compile(
    r"(time|zeit|timestamp|t|seconds|sec|s)(?![a-z0-9])[\s_]*[\[(]?(?P<unit>ms|milliseconds|s|sec|seconds)?[\])]?", re.I
)
_FRAME = re.compile(r"(frame|field|sample|index|bild|nr|no|#)s?[\s_]*[#.]?[\s_]*(no|nr|number|index)?\.?", re.I)


@dataclass(frozen=True)
class Columns:
    """Where a table keeps its markers.

    Attributes
    ----------
    names : marker names
    xyz : for each marker the three columns
    time, frame : columns, None where absent
    time_scale : s in one unit of the time column
    units : unit of length that the header names
    filled : column of a marker's filled flag by marker name
    left_out : titles of columns that hold something else
    """

    names: tuple[str, ...]
    xyz: tuple[tuple[int, int, int], ...]
    time: int | None = None
    frame: int | None = None
    time_scale: float = 1.0
    units: str | None = None
    filled: dict[str, int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()


def find_columns(header: Sequence[Sequence[str]]) -> Columns | None:
    """Columns from the header rows directly above the data, None where no marker is named.

    Two kinds are known: a row of axis letters below a row of names (Vicon Nexus, OptiTrack Motive, pandas), and one
    row of names with the axis in them (``C7_x``, ``C7.X``, ``C7 X (mm)``, ``C7_1``).
    """
    for i in range(len(header) - 1, -1, -1):
        axes = [_AXIS.fullmatch(cell) for cell in header[i]]
        starts = [k for k in range(len(axes) - 2) if _letters(axes[k : k + 3]) == "xyz"]
        if starts:
            return _stacked(header, i, starts)
    for row in reversed(header):
        columns = _flat(row)
        if columns is not None:
            return columns
    return None


def _letters(axes: Sequence[re.Match[str] | None]) -> str:
    return "".join(match[1].lower() if match else "?" for match in axes)


def _stacked(header: Sequence[Sequence[str]], at: int, starts: list[int]) -> Columns:
    above = header[:at]
    left_out: tuple[str, ...] = ()
    titled = next((row for row in above if _cell(row, 1).lower() == "name" or row[0].lower() == "bodyparts"), None)
    titles = titled or next((row for row in reversed(above) if any(_title(row, k) for k in starts)), ())
    # Motive says in rows of their own what each column is of and what it holds; bones and rotations are no markers.
    for row, wanted in ((_row_of(above, "Position"), "Position"), (_row_of(above, "Marker"), "Marker")):
        kept = [k for k in starts if _cell(row, k) == wanted]
        if kept:
            left_out += tuple(dict.fromkeys(_title(titles, k) for k in starts if k not in kept))
            starts = kept
    units = next((m[2] for m in map(_AXIS.fullmatch, header[at]) if m and m[2]), None)
    for row in header[at + 1 :]:
        units = units or next((cell for cell in row if metres_per_unit(cell) is not None), None)
    time, frame, scale = _clock([row[: starts[0]] for row in header])
    names = tuple(_title(titles, k) for k in starts)
    left_out = tuple(name for name in left_out if name and name not in names)
    return Columns(names, tuple((k, k + 1, k + 2) for k in starts), time, frame, scale, units, {}, left_out)


def _row_of(rows: Sequence[Sequence[str]], word: str) -> Sequence[str]:
    return next((row for row in rows if word in row), ())


def _title(row: Sequence[str], k: int) -> str:
    """Name above the three columns from ``k`` on; most programs put it above the first one."""
    return next((cell for cell in row[k : k + 3] if cell), "")


def _cell(row: Sequence[str], k: int) -> str:
    return row[k] if k < len(row) else ""


def _clock(header: Sequence[Sequence[str]]) -> tuple[int | None, int | None, float]:
    """Time column, frame column and s in one unit of time."""
    time = frame = None
    scale = 1.0
    for row in reversed(header):
        for k, cell in enumerate(row[:4]):
            match = _TIME.fullmatch(cell)
            if match and time is None:
                time, scale = k, 1e-3 if (match["unit"] or "").lower().startswith("m") else 1.0
            elif _FRAME.fullmatch(cell) and frame is None:
                frame = k
    return time, frame, scale


def _flat(row: Sequence[str]) -> Columns | None:
    time, frame, scale = _clock([row])
    found: dict[str, dict[str, int]] = {}
    units: str | None = None
    for pattern in (_FLAT, _NUMBERED):
        for k, cell in enumerate(row):
            match = pattern.fullmatch(cell)
            if match and match["name"] and k not in (time, frame):
                axis = match["axis"].lower().translate(str.maketrans("123", "xyz"))
                found.setdefault(match["name"], {}).setdefault(axis, k)
                if pattern is _FLAT:
                    units = units or match["unit"]
        markers = {name: axes for name, axes in found.items() if len(axes) == 3}
        if markers:
            break
    else:
        return None
    flags = {name: row.index(f"{name}_filled") for name in markers if f"{name}_filled" in row}
    xyz = tuple((axes["x"], axes["y"], axes["z"]) for axes in markers.values())
    used = {time, frame, *flags.values(), *(k for columns in xyz for k in columns)}
    left_out = tuple(cell for k, cell in enumerate(row) if k not in used and cell)
    return Columns(tuple(markers), xyz, time, frame, scale, units, flags, left_out)
