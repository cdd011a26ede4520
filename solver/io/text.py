"""Text files as people really have them: any line end, any common encoding, several separators."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from datetime import date
from operator import itemgetter
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError

SEPARATORS = "\t;,"
_LOST = set(
    " nan na n/a #n/a #na null #null none nil <na> nat - -- --- . .. ... ? missing lost occluded undefined "
    "#value! #num! #div/0! #null! #ref! #name? (null) (missing) <nan>".split(" ")
)
_NO_NUMBER = re.compile(r"[+-]?(nan\w*(\(.*\))?|1[.,]#\w+|#n/a.*)", re.IGNORECASE)  # as C libraries and Excel write it
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(?:\.\d{3})+(?:,\d+)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d+)?"),
}
_OTHER = {".": ",", ",": "."}
_BLANK_GROUPS = re.compile(r"(?<=\d)[ '’\u00a0\u202f](?=\d{3}(?!\d))")


def read_bytes(path: str | Path) -> bytes:
    """The whole file, or the sentence that says why it cannot be read."""
    path = Path(path)
    try:
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise InputError("there is no such file", path, "check the name") from error
    except IsADirectoryError as error:
        raise InputError("is a folder, not a file", path, "name a file in it") from error
    except PermissionError as error:
        if path.is_dir():  # what Windows says of a folder
            raise InputError("is a folder, not a file", path, "name a file in it") from error
        raise InputError("may not be read by this user", path, "change its permissions") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"cannot be read: {reason}", path, "check the name and the disk") from error
    if not data:
        raise InputError("the file is empty", path, "export or copy it again")
    return data


def decode(data: bytes, path: str | Path) -> str:
    """Text of ``data``: UTF-8 or UTF-16 by byte order mark, UTF-8, else Western 8-bit."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
    sample = text[:20000]
    if "\0" in text or sum(c < " " and c not in "\t\n\r\f\v" for c in sample) > 0.02 * len(sample):
        raise InputError("is binary data, not a text table", path, "export the markers as C3D, TRC, CSV or TSV")
    return text


def split_lines(text: str) -> list[str]:
    """Lines without their ends, whichever of the three ends they have."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def split_cells(line: str) -> list[str]:
    """Cells of one line, parted by tabs, else semicolons, else commas, else runs of blanks; each one trimmed."""
    for separator in SEPARATORS:
        if separator in line:
            break
    else:
        return line.split()
    if separator == "," and " " in line and _decimal_commas(cells := line.split()):
        return cells
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
        except (csv.Error, StopIteration):
            pass
    return [cell.strip() for cell in line.split(separator)]


def _decimal_commas(cells: Sequence[str]) -> bool:
    """Whether cells that blanks part are numbers with decimal commas, so that no comma parts any."""
    commas = sum(_DECIMAL_COMMA.fullmatch(cell) is not None for cell in cells)
    return len(cells) > 1 and commas > 0 and all("," not in c or _DECIMAL_COMMA.fullmatch(c) for c in cells)


def refuse_ragged_blanks(line: str, cells: list[str], rows: list[list[str]], at: int, path: str | Path) -> None:
    """Rows parted by mere blanks must all be of one length, or a lost value would shift those behind it."""
    if rows and len(cells) != len(rows[0]) and not any(separator in line for separator in SEPARATORS):
        what = f"line {at} has {len(cells)} values parted by blanks where the first row has {len(rows[0])}"
        raise InputError(what, path, "export it with tabs or commas, so that lost markers leave empty cells")


def number(cell: str) -> float:
    """Value of one cell, NaN where it says that there is none. Raises ValueError."""
    try:
        return float(cell)
    except ValueError:
        cell = cell.strip(" \"'")
        if cell.lower() in _LOST or _NO_NUMBER.fullmatch(cell):
            return float("nan")
        if not cell.isascii() or " " in cell or "'" in cell:
            cell = _BLANK_GROUPS.sub("", cell).replace("\u2212", "-")
        if "," in cell and "." in cell:
            cell = plain(cell, "." if cell.rindex(".") < cell.rindex(",") else ",")
        if _DECIMAL_COMMA.fullmatch(cell):
            cell = cell.replace(",", ".")
        return float(cell)


def plain(cell: str, mark: str) -> str:
    """A number without the mark that groups its thousands, with a decimal point."""
    if not _GROUPED[mark].fullmatch(cell):
        return cell
    return cell.replace(mark, "").replace(",", ".")


def thousands_mark(rows: Sequence[Sequence[str]]) -> str | None:
    """What groups the thousands of a table's numbers: ``.``, ``,`` or nothing.

    A single ``1.234`` does not tell; ``1.234,56`` somewhere does, for the whole table.
    """
    for row in rows[:: max(1, len(rows) // 500)]:
        for cell in row:
            if "," in cell and "." in cell:
                return next(
                    (
                        m
                        for m, grouped in _GROUPED.items()
                        if cell.find(m) < cell.rfind(_OTHER[m]) and grouped.fullmatch(cell)
                    ),
                    None,
                )
    return None


def is_number(cell: str) -> bool:
    """True where the cell holds a value (a blank holds none)."""
    try:
        number(cell)
    except ValueError:
        return False
    return cell != ""


def number_table(
    rows: Sequence[Sequence[str]],
    line_numbers: Sequence[int],
    path: str | Path,
    columns: Sequence[int] | None = None,
    mark: str | None = None,
) -> np.ndarray:
    """Rows of cells as an array, short rows padded with NaN.

    Parameters
    ----------
    columns : the ones that must hold numbers; all others come back as NaN. None for all of them
    mark : what groups thousands (see ``thousands_mark``)

    Raises
    ------
    InputError : a cell holds something else than a number, with its line
    """
    width = max(map(len, rows), default=0)
    wanted = list(range(width)) if columns is None else sorted({k for k in columns if k < width})
    table = np.full((len(rows), width), np.nan)
    some = len(wanted) < width
    pick = itemgetter(*wanted) if len(wanted) > 1 else None
    last = wanted[-1] if wanted else -1
    for i, row in enumerate(rows):
        if some:
            row = pick(row) if pick and len(row) > last else [row[k] if k < len(row) else "" for k in wanted]
        if mark is not None:
            row = [plain(cell, mark) for cell in row]
        try:
            values = [float(c) if c else np.nan for c in row]
        except ValueError:
            values = [_number_or_refuse(c, line_numbers[i], path) for c in row]
        if some:
            table[i, wanted] = values
        else:
            table[i, : len(row)] = values
    return table


def _number_or_refuse(cell: str, line: int, path: str | Path) -> float:
    try:
        return number(cell)
    except ValueError as error:
        shown = cell if len(cell) <= 20 else cell[:20] + "..."
        raise InputError(f"line {line} holds {shown!r} where a number is expected", path, "export it again") from error


_CLOCK = re.compile(
    r"(?:(?P<date>\d{4}-\d\d-\d\d)[T ])?(?:(?P<h>\d{1,2}):)?(?P<m>\d{1,2}):(?P<s>\d{1,2}(?:[.,]\d+)?)"
    r"Z?(?:[+-]\d\d:?\d\d)?"
)


def clock_seconds(cell: str) -> float | None:
    """Seconds of a time of day (``12:30:05.25``), of minutes and seconds, or of an ISO date and time; else None."""
    match = _CLOCK.fullmatch(cell.strip(" \"'"))
    if match is None:
        return None
    seconds = 3600 * int(match["h"] or 0) + 60 * int(match["m"]) + float(match["s"].replace(",", "."))
    try:
        days = date.fromisoformat(match["date"]).toordinal() if match["date"] else 0
    except ValueError:
        return None
    return 86400.0 * days + seconds
