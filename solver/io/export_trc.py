"""Markers out as TRC, strictly as OpenSim reads it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from markerscope.solver.core.markers import Markers
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.file_axes import in_file_axes
from markerscope.solver.io.filled_list import write_filled_list
from markerscope.solver.io.labels import unique
from markerscope.solver.io.number_text import number_lines

_KEYS = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames".split()


def write_trc(
    path: str | Path, markers: Markers, *, units: Literal["m", "mm"] = "m", labels: Sequence[str] | None = None
) -> None:
    """Write trajectories as TRC, y up as OpenSim expects; lost positions are empty cells.

    TRC has no sign for filled positions: where there are any, ``NAME.filled.csv`` beside it lists them, a row for
    each span with the marker's number and the first and last row, from 1. ``load_markers`` reads it back.

    Parameters
    ----------
    path : file to write, whole or not at all
    markers : trajectories
    units : unit of length
    labels : M names, None for the markers' own; made unique, blanks become underscores

    Raises
    ------
    InputError : the file cannot be written
    """
    names = unique(markers.labels if labels is None else labels, clean=_clean)
    positions, _ = in_file_axes(markers, "y")
    frames, count = positions.shape[:2]
    scale, digits = (1, 7) if units == "m" else (1000, 4)
    first = round(markers.first_time * markers.rate) + 1
    rate = f"{markers.rate:.10g}"
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{_clean(Path(path).name)}",
        "\t".join(_KEYS),
        "\t".join([rate, rate, str(frames), str(count), units, rate, str(first), str(frames)]),
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1)),
        "",
    ]
    lost: np.ndarray = ~np.isfinite(positions).all(axis=2)
    cells = np.where(lost[..., None], np.nan, positions * scale).reshape(frames, -1)
    rows = [
        f"{first + i}\t{time:.9g}\t{line}"
        for i, (time, line) in enumerate(zip(markers.time.tolist(), number_lines(cells, f"%.{digits}f", "\t", lost="")))
    ]
    # OpenSim overlooks an empty cell at the very end unless a tab closes it.
    rows = [row + "\t" if row.endswith("\t") else row for row in rows]
    write_text_atomic(path, "\n".join(head + rows) + "\n")
    write_filled_list(path, None if markers.filled is None else markers.filled & ~lost)


def _clean(name: str) -> str:
    """A name without what parts cells or lines, and not to be taken for a number or a quoted cell."""
    name = re.sub(r"[\s,;\"\x00-\x1f\x7f-\x9f]+", "_", name.strip())
    return name if name.strip("_") else ""
