"""A standing pose in the place of a video, for a static trial that has none."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from markerscope.solver.core.rotations import log_so3
from markerscope.solver.fit import anatomical
from markerscope.solver.io.atomic import make_folder, write_bytes_atomic

_RATE, _SECONDS = 30.0, 3600
_TOWARDS_CAMERA = np.diag([1.0, -1.0, -1.0])
"""Upright in a frame with x right, y down, z away; which way that is in the lab is what the solve finds."""


def write_standing(path: Path, seconds: float) -> Path:
    """An AMASS-layout file of somebody who stands relaxed, feet down, for so long; the same bytes for the same time."""
    pose = anatomical.mean_pose().copy()
    pose[0] = _TOWARDS_CAMERA
    count = int(np.ceil(min(seconds, _SECONDS) * _RATE)) + 2
    content = io.BytesIO()
    np.savez_compressed(
        content,
        poses=np.tile(log_so3(pose).reshape(1, -1), (count, 1)),
        trans=np.zeros((count, 3)),
        betas=np.zeros(10),
        gender=np.array("neutral"),
        mocap_frame_rate=np.array(_RATE),
    )
    make_folder(path.parent)
    write_bytes_atomic(path, content.getvalue())
    return path
