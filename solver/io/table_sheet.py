"""A text table cut into facts, header rows and rows of data, whatever stands above, between and behind them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markerscope.solver.io.text import SEPARATORS, clock_seconds, is_number, number, refuse_ragged_blanks, split_cells

_REMARK = ("#", "%", "//")
_LOOK_AHEAD = 3


@dataclass(frozen=True)
class Sheet:
    """What stands above the data, and the data.

    Attributes
    ----------
    header : rows of cells above the data
    rows, numbers : rows of cells and their line numbers from 1
    facts : values by key (lower case) that lines above the data say
    names : marker names that a line of their own lists
    notes : what was passed over, one sentence each
    """

    header: list[list[str]]
    rows: list[list[str]]
    numbers: list[int]
    facts: dict[str, str] = field(default_factory=dict)
    names: list[str] | None = None
    notes: tuple[str, ...] = ()

    @property
    def width(self) -> int:
        """Cells of most rows, those of the first ones speaking for all."""
        lengths = [len(row) for row in self.rows[:50]]
        return max(set(lengths), key=lengths.count, default=0)


def cut(lines: Sequence[str], path: str | Path) -> Sheet:
    """Part header from data.

    The data begin with the first row that is mostly numbers and is followed by rows of its kind: cells that are no
    numbers may stand in it where the next rows have none either (a trial's name, true and false, a time of day), and
    so may any spelling of a lost value.
    """
    facts: dict[str, str] = {}
    section = next((i for i, line in enumerate(lines) if line.strip(' \t",;') == "Trajectories"), None)
    if section is not None:  # Nexus puts devices and model outputs into sections of their own
        facts["rate"] = next(iter(split_cells(lines[section + 1])), "") if section + 1 < len(lines) else ""
    start = 0 if section is None else section + 2
    begin = _first_row(lines, start)
    names: list[str] | None = None
    header: list[list[str]] = []
    for line in lines[start:begin]:
        cells = _header_cells(line, facts)
        if not any(cells):
            continue
        full = cells[: max(k for k, cell in enumerate(cells) if cell) + 1]
        if full[0].upper() == "MARKER_NAMES":
            names = full[1:]
        elif full[0] and (len(full) == 2 or full[0].lower() == "format version"):
            facts |= dict(zip((cell.lower() for cell in full[::2]), full[1::2], strict=False))
        header.append(cells)
    rows, numbers, notes = _body(lines, begin, section is not None, path)
    return Sheet(header, rows, numbers, facts, names, notes)


def _header_cells(line: str, facts: dict[str, str]) -> list[str]:
    """Cells of a line above the data; a remark gives facts, or is the titles that some programs put into one."""
    sign = next((sign for sign in _REMARK if line.startswith(sign)), None)
    if sign is None:
        return split_cells(line)
    rest = line[len(sign) :]
    if rest[:1] in "\t,;" and rest[:1]:
        return split_cells(line)  # "#" is the title of a column
    found = _remarks(line)
    if found:
        facts |= found
        return []
    cells = split_cells(rest.strip())
    return cells if len(cells) >= 3 else []


def _remarks(line: str) -> dict[str, str]:
    """Facts of a remark like ``# units=mm; up=z; rate=100``."""
    pairs = (part.partition("=") for part in line.lstrip("#%/ ").split(";"))
    return {key.strip().lower(): value.strip() for key, equals, value in pairs if equals}


def _first_row(lines: Sequence[str], start: int) -> int:
    """Index of the first line of data, the number of lines where there is none."""
    for i in range(start, len(lines)):
        cells = _cells_of_data(lines[i])
        if cells is None or not _mostly_numbers(cells):
            continue
        if all(_alike(cells, other) for other in _next_rows(lines, i + 1)):
            return _back_over_lost(lines, start, i, cells)
    return len(lines)


def _cells_of_data(line: str) -> list[str] | None:
    if not line.strip() or (line.startswith(_REMARK) and not is_number(split_cells(line)[0])):
        return None
    return split_cells(line)


def _next_rows(lines: Sequence[str], at: int) -> list[list[str]]:
    found: list[list[str]] = []
    for line in lines[at:]:
        if len(found) == _LOOK_AHEAD or not line.strip():
            break
        cells = split_cells(line)
        if any(cells):
            found.append(cells)
    return found


def _mostly_numbers(cells: Sequence[str]) -> bool:
    """True for a row that holds numbers, more of them than words."""
    said = [cell for cell in cells if cell]
    numbers = sum(map(_holds, said))
    words = sum(not is_number(cell) for cell in said)
    return numbers > words and (len(said) >= 3 or len(cells) > 3) and numbers > 0


def _holds(cell: str) -> bool:
    try:
        value = number(cell)
    except ValueError:
        return False
    return value == value


def _alike(cells: Sequence[str], other: Sequence[str]) -> bool:
    """Whether a row below does not say words in most places where this one says numbers."""
    places = [k for k, cell in enumerate(cells) if _holds(cell)]
    words = sum(k < len(other) and bool(other[k]) and not is_number(other[k]) for k in places)
    return 2 * words <= len(places)


def _back_over_lost(lines: Sequence[str], start: int, at: int, cells: Sequence[str]) -> int:
    """Up over rows above that hold but a number or two, all else lost."""
    numeric = [k for k, cell in enumerate(cells) if is_number(cell)]
    while at > start:
        above = _cells_of_data(lines[at - 1])
        if above is None or len(above) != len(cells) or not all(not above[k] or is_number(above[k]) for k in numeric):
            break
        if not any(_holds(above[k]) for k in numeric):
            break
        if any(_holds(above[k]) or not above[k] for k in range(len(cells)) if k not in numeric and cells[k]):
            break
        at -= 1
    return at


def _body(
    lines: Sequence[str], begin: int, sections: bool, path: str | Path
) -> tuple[list[list[str]], list[int], tuple[str, ...]]:
    """Rows of data and their line numbers; in a file of sections a blank line ends them, unless they go on behind."""
    rows: list[list[str]] = []
    numbers: list[int] = []
    notes: tuple[str, ...] = ()
    lost: list[tuple[int, list[str]]] = []  # rows of nothing but separators, which count where data follow
    for i, line in enumerate(lines[begin:], begin + 1):
        if not line.strip(" \r\n"):
            if sections and not _goes_on(lines, i, rows):
                break
            if sections:
                notes = (f"A blank line inside the data (line {i}) was passed over.",)
            continue
        cells = split_cells(line)
        if not any(cells):
            if sections and not _goes_on(lines, i, rows):
                break
            lost.append((i, cells))
            continue
        if line.startswith("#") and not is_number(cells[0]):
            continue
        if rows and _words(line, cells, len(rows[-1])):
            notes += (f"A line of words below the first data (line {i}) was passed over.",)
            continue
        for at, blank in lost:
            if rows and len(blank) == len(rows[-1]):
                rows.append(blank)
                numbers.append(at)
        lost.clear()
        refuse_ragged_blanks(line, cells, rows, i, path)
        rows.append(cells)
        numbers.append(i)
    return rows, numbers, notes


def _words(line: str, cells: Sequence[str], width: int) -> bool:
    """Whether a line is a sentence, not a row: nothing parts its cells, and none is a number."""
    parted = any(mark in line for mark in SEPARATORS)
    return not parted and 3 < width > len(cells) and not any(map(is_number, cells))


def _goes_on(lines: Sequence[str], at: int, rows: Sequence[Sequence[str]]) -> bool:
    """Whether the next line with something in it is a further row of the same data."""
    following = next((line for line in lines[at:] if line.strip(' \t",;')), None)
    if following is None or not rows:
        return False
    cells = split_cells(following)
    return len(cells) == len(rows[-1]) and is_number(cells[0]) and _alike(rows[-1], cells) and _mostly_numbers(cells)


def times_of_day(rows: Sequence[Sequence[str]], column: int) -> list[float] | None:
    """Seconds of a column of times of day or dates, None where it holds something else."""
    found = [clock_seconds(row[column]) if column < len(row) else None for row in rows]
    return None if any(value is None for value in found) else [value for value in found if value is not None]
