"""Markers out as C3D, filled points flagged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers, UpAxis
from markerscope.solver.io.atomic import write_bytes_atomic
from markerscope.solver.io.c3d_encode import MEASURED_WORD, MOST_PER_PARAMETER, Value, encode_c3d
from markerscope.solver.io.file_axes import in_file_axes
from markerscope.solver.io.labels import unique

_LABEL_BYTES = 120
_RESIDUAL_MM = 0.1  # C3D wants a positive residual for measured points; the true one is not known
_SCREEN = {"x": ("+Y", "+X"), "y": ("+X", "+Y"), "z": ("+X", "+Z")}


def write_c3d(
    path: str | Path, markers: Markers, *, up: UpAxis | None = None, labels: Sequence[str] | None = None
) -> None:
    """Write trajectories as C3D in millimetres.

    Filled positions get residual 0, measured ones a positive residual, lost ones -1.

    Parameters
    ----------
    path : file to write, whole or not at all
    markers : trajectories
    up : vertical axis of the file, None for the axes of the file the markers came from
    labels : M names, None for the markers' own; made unique

    Raises
    ------
    InputError : the file cannot be written
    """
    names = unique(markers.labels if labels is None else labels, _LABEL_BYTES)
    positions, vertical = in_file_axes(markers, up)
    right, upward = _SCREEN[vertical]
    chunks = [names[i : i + MOST_PER_PARAMETER] for i in range(0, len(names), MOST_PER_PARAMETER)]
    groups: dict[str, dict[str, Value]] = {
        "POINT": {
            **{_continued("LABELS", i): chunk for i, chunk in enumerate(chunks)},
            **{_continued("DESCRIPTIONS", i): ("",) * len(chunk) for i, chunk in enumerate(chunks)},
            "UNITS": ("mm",),
            "X_SCREEN": (right,),
            "Y_SCREEN": (upward,),
        },
        "ANALOG": {"USED": np.array([0]), "GEN_SCALE": np.array([1.0]), "RATE": np.array([markers.rate])},
        "FORCE_PLATFORM": {"USED": np.array([0])},
        "MANUFACTURER": {"SOFTWARE": ("Markerscope",)},
    }
    words = _words(positions, markers.filled)
    first = min(max(0, round(markers.first_time * markers.rate)), 2**31) + 1
    try:
        data = encode_c3d(groups, words, first, markers.rate, _RESIDUAL_MM)
    except ValueError as error:
        what = f"{len(names)} markers with names this long do not fit a C3D"
        raise InputError(what, path, "use shorter names, or write TRC") from error
    write_bytes_atomic(path, data)


def _continued(name: str, chunk: int) -> str:
    """``LABELS``, ``LABELS2``, ``LABELS3``..."""
    return f"{name}{chunk + 1}" if chunk else name


def _words(positions: np.ndarray, filled: np.ndarray | None) -> np.ndarray:
    """(T, M, 4) float32 millimetres and residual word."""
    with np.errstate(over="ignore", invalid="ignore"):
        millimetres = (positions * 1000).astype(np.float32)
    lost = np.asarray(~np.isfinite(millimetres).all(axis=2))
    words = np.zeros((*lost.shape, 4), dtype=np.float32)
    words[..., :3] = np.where(lost[..., None], 0, millimetres)
    words[..., 3] = np.where(lost, -1, MEASURED_WORD)
    if filled is not None:
        words[filled & ~lost, 3] = 0
    return words
