"""Markers out as a wide CSV table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from markerscope.solver.core.markers import Markers, UpAxis
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.file_axes import in_file_axes
from markerscope.solver.io.labels import unique


def write_markers_csv(
    path: str | Path,
    markers: Markers,
    *,
    units: Literal["m", "mm"] = "m",
    up: UpAxis | None = None,
    labels: Sequence[str] | None = None,
) -> None:
    """Write trajectories as CSV: ``time`` in s, then ``NAME_x, NAME_y, NAME_z`` of each marker; lost = empty.

    A remark line before the titles says unit, vertical axis, rate and length (pandas: ``comment="#"``). A marker with
    filled positions has a further column ``NAME_filled`` of 0 and 1. ``load_markers`` reads all of it back.

    Parameters
    ----------
    path : file to write, whole or not at all
    markers : trajectories
    units : unit of length
    up : vertical axis of the file, None for the axes of the file the markers came from
    labels : M names, None for the markers' own; made unique

    Raises
    ------
    InputError : the file cannot be written
    """
    names = unique(markers.labels if labels is None else labels, clean=_clean)
    positions, vertical = in_file_axes(markers, up)
    scale, digits = (1, 7) if units == "m" else (1000, 4)
    lost = ~np.isfinite(positions).all(axis=2)
    filled = np.zeros(lost.shape, dtype=bool) if markers.filled is None else markers.filled & ~lost
    flagged = set(np.flatnonzero(filled.any(axis=0)).tolist())
    titles = ["time"]
    columns: list[list[str]] = [[f"{t:.9g}" for t in markers.time.tolist()]]
    for m, name in enumerate(names):
        titles += [f"{name}_{axis}" for axis in "xyz"]
        values = np.where(lost[:, m, None], np.nan, positions[:, m] * scale).T.tolist()
        columns += [[f"{v:.{digits}f}" if v == v else "" for v in column] for column in values]
        if m in flagged:
            titles.append(f"{name}_filled")
            columns.append([str(int(flag)) for flag in filled[:, m]])
    remark = f"# units={units}; up={vertical}; rate={markers.rate:.10g}; frames={len(positions)}"
    write_text_atomic(path, "\n".join([remark, ",".join(titles), *map(",".join, zip(*columns))]) + "\n")


def _clean(name: str) -> str:
    """A name without what parts cells or lines."""
    name = re.sub(r"[\s,;\"#\x00-\x1f\x7f-\x9f]+", "_", name.strip())
    return name if name.strip("_") else ""
