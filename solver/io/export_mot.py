"""Coordinates out as an OpenSim storage file (MOT)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.labels import unique
from markerscope.solver.io.number_text import number_lines


def write_mot(
    path: str | Path,
    time: np.ndarray,
    columns: Mapping[str, np.ndarray] | tuple[Sequence[str], np.ndarray],
    degrees: bool = True,
) -> None:
    """Write an OpenSim storage file.

    Parameters
    ----------
    path : file to write, whole or not at all
    time : (T,) s
    columns : values (T,) by name, or N names and values (T, N); angles in degrees where ``degrees``, else in
        radians, translations in metres; written as they are, NaN as ``nan``
    degrees : what the header says of the angles

    Raises
    ------
    InputError : the file cannot be written
    """
    names: Sequence[str]
    if isinstance(columns, Mapping):
        names, values = tuple(columns), np.reshape([*columns.values()], (len(columns), len(time))).T
    else:
        names, values = columns
    labels = ["time", *unique(names, clean=lambda name: re.sub(r"[\s\x00-\x1f\x7f]+", "_", name.strip()))]
    table = np.column_stack([time, values])
    head = [
        "Coordinates",
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={len(labels)}",
        f"inDegrees={'yes' if degrees else 'no'}",
        "",
        f"Angles are in {'degrees' if degrees else 'radians'}, translations in metres, time in seconds.",
        "",
        "endheader",
        "\t".join(labels),
    ]
    write_text_atomic(path, "\n".join(head + number_lines(table, "%.9g", "\t")) + "\n")
