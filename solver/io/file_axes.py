"""From the internal frame to the axes of a file to be written."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.markers import Markers, UpAxis, lab_rotation

_AXES: tuple[UpAxis, UpAxis, UpAxis] = ("x", "y", "z")


def in_file_axes(markers: Markers, up: UpAxis | None) -> tuple[np.ndarray, UpAxis]:
    """Positions (T, M, 3) m in a file's axes, and which of them is vertical.

    Parameters
    ----------
    markers : trajectories in the internal frame
    up : vertical axis of the file, None for the axes of the file the markers came from
    """
    R_lab_internal = markers.R_lab_internal if up is None else lab_rotation(up)
    vertical = _AXES[int(np.argmax(np.abs(R_lab_internal[:, 2])))]
    with np.errstate(over="ignore", invalid="ignore"):
        return markers.positions @ R_lab_internal.T, vertical
