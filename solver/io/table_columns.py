"""Which column of a marker table holds what, from its header rows in any of the customary layouts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from markerscope.solver.io.units import metres_per_unit

_AXIS = re.compile(r"([xyzXYZ])\d*\s*(?:[\[(]\s*([^\W\d]+)\s*[\])])?")
_FLAT = re.compile(
    r"(?P<name>.*[^\s_.:\-])?[\s_.:\-]*[\[(]?(?P<axis>[xyzXYZ])[\])]?(?:[\s_]*[\[(]?(?P<unit>mm|cm|dm|m|in|ft)[\])]?)?(?:\.\d+)?"
)
_AXIS_FIRST = re.compile(r"(?P<axis>[xyzXYZ])[\s_.:\-]+(?P<name>.*\w.*)")
_NUMBERED = re.compile(r"(?P<name>.+)_(?P<axis>[123])")
_TIME = re.compile(
    r"(time[\s_]?stamps?|timestamp|date[\s_]?time|time|zeit|temps|tempo|tiempo|clock|elapsed|t|seconds|sec|s|"
    r"milliseconds|msec|ms)"
    r"(?![a-z0-9])[\s_]*[\[(]?(?P<unit>ms|msec|milliseconds|us|µs|microseconds|ns|nanoseconds|s|sec|secs|seconds|min)?[\])]?",
    re.I,
)
_TIME_UNITS = {"ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3, "us": 1e-6, "µs": 1e-6, "microseconds": 1e-6, "ns": 1e-9,
               "nanoseconds": 1e-9, "s": 1.0, "sec": 1.0, "secs": 1.0, "seconds": 1.0, "min": 60.0}  # fmt: skip
_FRAME = re.compile(
    r"(mocap|camera|video)?[\s_]*(frame|field|sample|index|item|row|bild|nr|no|#)s?[\s_]*[#.]?[\s_]*"
    r"(no|nr|num|number|index|id)?\.?",
    re.I,
)
_POSITION = re.compile(r"(?<=.)[\s_.:\-]*(pos|position|trajectory|coord)$", re.I)
_MARKER_TYPES = (
    "Marker",
    "Rigid Body Marker",
    "Bone Marker",
    "Skeleton Marker",
    "Trained Markerset Marker",
    "Unlabeled",
)
_NAME_TITLES = (
    "marker",
    "markers",
    "name",
    "label",
    "point",
    "bodypart",
    "landmark",
    "joint",
    "marker_name",
    "keypoint",
)
_PEOPLE = ("individuals", "individual", "subjects", "subject", "person", "people")


@dataclass(frozen=True)
class Columns:
    """Where a table keeps its markers.

    Attributes
    ----------
    names : marker names
    xyz : for each marker the three columns
    time, frame : columns, None where absent
    time_scale : s in one unit of the time column, None where no unit is named
    units : unit of length that the header names
    filled : column of a marker's filled flag by marker name
    left_out : titles of columns that hold something else
    assets : things with markers on them (rigid bodies), whose names stand before their markers'
    """

    names: tuple[str, ...]
    xyz: tuple[tuple[int, int, int], ...]
    time: int | None = None
    frame: int | None = None
    time_scale: float | None = None
    units: str | None = None
    filled: dict[str, int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    assets: tuple[str, ...] = ()


@dataclass(frozen=True)
class LongColumns:
    """Where a table with a row for each marker and frame keeps them: columns of name, x, y, z, time and frame."""

    name: int
    xyz: tuple[int, int, int]
    time: int | None = None
    frame: int | None = None


def find_long_columns(header: Sequence[Sequence[str]]) -> LongColumns | None:
    """Columns of a table in long form, None where it is none."""
    for row in reversed(header):
        said = [cell.lower() for cell in row]
        at = next((k for k, cell in enumerate(said) if cell in _NAME_TITLES), None)
        if at is not None and all(said.count(axis) == 1 for axis in "xyz"):
            time, frame, _ = _clock([row])
            return LongColumns(at, (said.index("x"), said.index("y"), said.index("z")), time, frame)
    return None


def find_columns(header: Sequence[Sequence[str]]) -> Columns | None:
    """Columns from the header rows directly above the data, None where no marker is named.

    Two kinds are known: a row of axis letters below a row of names (Vicon Nexus, OptiTrack Motive, Visual3D, pandas),
    and one row of names with the axis in them (``C7_x``, ``C7.X``, ``C7 X (mm)``, ``C7_1``, ``X_C7``). Rows of units,
    subjects, types and the like may stand between.
    """
    for i in range(len(header) - 1, -1, -1):
        axes = [_AXIS.fullmatch(cell) for cell in header[i]]
        starts = [k for k in range(len(axes) - 2) if _letters(axes[k : k + 3]) == "xyz"]
        if starts:
            return _stacked(header, i, starts)
    for i in range(len(header) - 1, -1, -1):
        columns = _flat(header[i], header[i + 1 :])
        if columns is not None:
            return columns
    return None


def _letters(axes: Sequence[re.Match[str] | None]) -> str:
    return "".join(match[1].lower() if match else "?" for match in axes)


def _stacked(header: Sequence[Sequence[str]], at: int, starts: list[int]) -> Columns:
    above = header[:at]
    left_out: tuple[str, ...] = ()
    assets: tuple[str, ...] = ()
    # Motive says in rows of their own what each column is of and what it holds; bones and rotations are no markers.
    kinds = _row_of(above, ("Marker", "Rigid Body Marker", "Bone Marker"))
    titled = _name_row(above, starts)
    titles = above[titled] if titled is not None else ()
    for row, wanted in ((_row_of(above, ("Position",)), ("Position",)), (kinds, _MARKER_TYPES)):
        kept = [k for k in starts if _cell(row, k) in wanted]
        if kept:
            left_out += tuple(dict.fromkeys(_title(titles, k) for k in starts if k not in kept))
            starts = kept
    if kinds:
        assets = tuple(
            dict.fromkeys(_title(titles, k).partition(":")[0] for k in starts if _cell(kinds, k) == "Rigid Body Marker")
        )
        # A rigid body's marker is listed as it was seen and as the body puts it; the seen one counts.
        seen = {_title(titles, k) for k in starts if _cell(kinds, k) == "Marker"}
        starts = [k for k in starts if _cell(kinds, k) == "Marker" or _title(titles, k) not in seen]
    units = next((m[2] for m in map(_AXIS.fullmatch, header[at]) if m and m[2]), None)
    for row in (*header[at + 1 :], *above):
        units = units or _unit_of(row, starts)
    time, frame, scale = _clock([row[: starts[0]] for row in header])
    people = _people_row(above, titled, starts)
    names = tuple(_with_person(_title(titles, k), people, k) for k in starts)
    left_out = tuple(dict.fromkeys(name for name in left_out if name and name not in names))
    xyz = tuple((k, k + 1, k + 2) for k in starts)
    return Columns(names, xyz, time, frame, scale, units, {}, left_out, assets)


def _unit_of(row: Sequence[str], starts: Sequence[int]) -> str | None:
    """The unit of length that a row says of all markers."""
    said = {cell for k in starts for cell in row[k : k + 3] if cell}
    return said.pop() if len(said) == 1 and metres_per_unit(next(iter(said))) is not None else None


def _name_row(above: Sequence[Sequence[str]], starts: Sequence[int]) -> int | None:
    """Index of the row that names the markers: the one that says so, else the one with most names that differ."""
    for i, row in enumerate(above):
        if _cell(row, 1).lower() == "name" or _cell(row, 0).lower() in ("bodyparts", "bodypart", "marker", "markers"):
            return i
    best, most = None, 0
    for i, row in enumerate(above):
        said = [_title(row, k) for k in starts]
        if not any(said) or _unit_of(row, starts) is not None or _visual3d_rest(above, i):
            continue
        differ = len({name for name in said if name})
        if differ >= most:  # of equals the nearest one
            best, most = i, differ
    return best


def _visual3d_rest(above: Sequence[Sequence[str]], at: int) -> bool:
    """Whether a row is one of the three that Visual3D puts around its names: file, type and folder."""
    if len(above) < 4 or any(_cell(row, 0) for row in above[-4:]):
        return False
    typed = {cell for cell in above[-2] if cell} <= _VISUAL3D_TYPES
    return typed and at in (len(above) - 4, len(above) - 2, len(above) - 1)


_VISUAL3D_TYPES = {
    "TARGET",
    "LANDMARK",
    "LINK_MODEL_BASED",
    "DERIVED",
    "KINETIC_KINEMATIC",
    "ROTATION",
    "COFP",
    "FORCE",
}


def _people_row(above: Sequence[Sequence[str]], titled: int | None, starts: Sequence[int]) -> Sequence[str]:
    """The row that says whose each marker is: named so, or one that tells repeated names apart; else none."""
    named = next((row for row in above if _cell(row, 0).lower() in _PEOPLE), None)
    if named is not None or titled is None:
        return named or ()
    names = [_title(above[titled], k) for k in starts]
    if len(set(names)) == len(names) or any(":" in name for name in names):
        return ()
    for i, row in enumerate(above):
        if i == titled:
            continue
        owners = _spread(row, starts)
        pairs = list(zip(owners, names, strict=True))
        if all(owners) and 1 < len(set(owners)) < len(starts) and len(set(pairs)) == len(pairs):
            return _over(starts, owners)
    return ()


def _spread(row: Sequence[str], starts: Sequence[int]) -> list[str]:
    """What a row says above each marker, where it stands only above the first of several."""
    found: list[str] = []
    for k in starts:
        found.append(_title(row, k) or (found[-1] if found else ""))
    return found


def _over(starts: Sequence[int], said: Sequence[str]) -> list[str]:
    row = [""] * (max(starts) + 1)
    for k, cell in zip(starts, said, strict=True):
        row[k] = cell
    return row


def _with_person(name: str, people: Sequence[str], k: int) -> str:
    person = _title(people, k)
    return f"{person}:{name}" if person and person.lower() != "single" else name


def _row_of(rows: Sequence[Sequence[str]], words: Sequence[str]) -> Sequence[str]:
    return next((row for row in rows if any(word in row for word in words)), ())


def _title(row: Sequence[str], k: int) -> str:
    """Name above the three columns from ``k`` on; most programs put it above the first one."""
    return next((cell for cell in row[k : k + 3] if cell), "")


def _cell(row: Sequence[str], k: int) -> str:
    return row[k] if k < len(row) else ""


def _clock(header: Sequence[Sequence[str]]) -> tuple[int | None, int | None, float | None]:
    """Time column, frame column and s in one unit of time, None where no unit is named."""
    time = frame = None
    scale: float | None = None
    for row in reversed(header):
        for k, cell in enumerate(row[:6]):
            match = _TIME.fullmatch(cell)
            if match and time is None and not (match[1].lower() in _TIME_UNITS and _unit_row(row)):
                time = k
                scale = _TIME_UNITS.get((match["unit"] or match[1]).lower())
            elif _FRAME.fullmatch(cell) and frame is None:
                frame = k
    if time is not None and scale is None:
        below = [_cell(row, time).strip("[]() ").lower() for row in header]
        scale = next((_TIME_UNITS[cell] for cell in below if cell in _TIME_UNITS), None)
    return time, frame, scale


def _unit_row(row: Sequence[str]) -> bool:
    """Whether a row says units, so that an ``s`` in it is no title."""
    said = [cell for cell in row if cell]
    return sum(metres_per_unit(cell) is not None for cell in said) >= max(1, len(said) - 3) or len(said) <= 1


def _flat(row: Sequence[str], below: Sequence[Sequence[str]] = ()) -> Columns | None:
    time, frame, scale = _clock([row, *([cell[:6] for cell in below])])
    groups: list[tuple[str, dict[str, int]]] = []
    units: str | None = None
    for pattern in (_FLAT, _NUMBERED, _AXIS_FIRST):
        groups, units = _groups(row, pattern, (time, frame))
        if groups:
            break
    else:
        return None
    if any(_POSITION.search(name) for name, _ in groups):  # D-Flow: turns and forces stand beside the positions
        groups = [(_POSITION.sub("", name), axes) for name, axes in groups if _POSITION.search(name)]
    names = [name for name, _ in groups]
    flags = {name: row.index(f"{name}_filled") for name in names if f"{name}_filled" in row}
    xyz = tuple((axes["x"], axes["y"], axes["z"]) for _, axes in groups)
    for line in below:
        units = units or _unit_of(line, [columns[0] for columns in xyz])
    used = {time, frame, *flags.values(), *(k for columns in xyz for k in columns)}
    left_out = tuple(cell for k, cell in enumerate(row) if k not in used and cell)
    return Columns(tuple(names), xyz, time, frame, scale, units, flags, left_out)


def _groups(
    row: Sequence[str], pattern: re.Pattern[str], taken: tuple[int | None, int | None]
) -> tuple[list[tuple[str, dict[str, int]]], str | None]:
    """Name and axis columns of each marker, in order; a name that comes again is another marker."""
    found: list[tuple[str, dict[str, int]]] = []
    latest: dict[str, dict[str, int]] = {}
    units: str | None = None
    for k, cell in enumerate(row):
        match = pattern.fullmatch(cell)
        if not match or not match["name"] or k in taken:
            continue
        axis = match["axis"].lower().translate(str.maketrans("123", "xyz"))
        name = match["name"]
        if name not in latest or axis in latest[name]:
            latest[name] = {}
            found.append((name, latest[name]))
        latest[name][axis] = k
        if pattern is _FLAT:
            units = units or match["unit"]
    return [(name, axes) for name, axes in found if len(axes) == 3], units
