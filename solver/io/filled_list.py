"""``NAME.filled.csv`` beside a ``NAME.trc``: which of its positions were filled, for which TRC has no sign."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import cannot_write, write_text_atomic
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.text import decode, read_bytes, split_lines

_TITLE = "marker,first_row,last_row"


def filled_list_path(path: str | Path) -> Path:
    """Where the list belonging to a TRC file stands."""
    return Path(path).with_suffix(".filled.csv")


def write_filled_list(path: str | Path, filled: np.ndarray | None) -> None:
    """List the filled spans of a TRC file beside it; remove an old list where nothing is filled.

    Parameters
    ----------
    path : the TRC file
    filled : (T, M) True where a position was interpolated or modelled
    """
    target = filled_list_path(path)
    if filled is None or not filled.any():
        try:
            target.unlink(missing_ok=True)
        except OSError as error:
            raise cannot_write(target, error) from error
        return
    lines = [_TITLE]
    for m in np.flatnonzero(filled.any(axis=0)):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], filled[:, m], [False]]).astype(int)))
        lines += [f"{m + 1},{start + 1},{stop}" for start, stop in edges.reshape(-1, 2)]
    write_text_atomic(target, "\n".join(lines) + "\n")


def apply_filled_list(raw: RawMarkers, path: str | Path) -> RawMarkers:
    """Flag the spans listed beside a TRC file; a list that does not fit it is left aside, with a note."""
    target = filled_list_path(path)
    if not target.is_file():
        return raw
    frames, markers = raw.positions.shape[:2]
    filled = np.zeros((frames, markers), dtype=bool)
    fits = False
    with suppress(InputError, ValueError):
        title, *lines = split_lines(decode(read_bytes(target), target))
        spans = [[int(cell) for cell in line.split(",")] for line in lines if line.strip()]
        fits = title == _TITLE and all(
            len(s) == 3 and 1 <= s[0] <= markers and 1 <= s[1] <= s[2] <= frames for s in spans
        )
        for marker, first, last in spans if fits else []:
            filled[first - 1 : last, marker - 1] = True
    if not fits:
        return replace(raw, notes=(*raw.notes, f"{target.name} does not fit the file and was left aside."))
    return replace(raw, filled=filled)
