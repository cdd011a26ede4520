"""The motion that a dataset's makers fitted, for one window."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.metrics import points_at, rotations_at
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.motion_in import read_motion


def write_reference(out: Path, source: Path | None, markers: Markers) -> tuple[bool, str]:
    """Write the window's part of a motion that starts with the recording, on the window's frames.

    Returns
    -------
    Whether it was written, and a sentence if it was not although there is one
    """
    if source is None:
        return False, ""
    if not np.allclose(markers.R_lab_internal, np.eye(3)):
        return False, "The reference is left out: the marker file's vertical axis is not z."
    try:
        motion = read_motion(source)
    except InputError as error:
        return False, f"The reference is left out: {error}"
    time = np.arange(len(motion.rotations)) / motion.rate
    inside = markers.time[markers.time <= time[-1] + 1e-9]
    if len(inside) < 2:
        return False, f"The reference is left out: it ends at {time[-1]:.1f} s."
    rotations = rotations_at(time, motion.rotations, inside)
    trans = points_at(time, motion.trans, inside)
    poses = log_so3(rotations).reshape(len(inside), -1)
    write_smpl_npz(out, poses, trans, motion.betas, markers.rate, {"time": inside})
    return True, ""
