"""The fitted camera of one trial, as a small JSON file that another trial of the same session can be given."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from solver.errors import InputError
from solver.io.atomic import write_text_atomic
from solver.solve.results import CameraResult

FILE_NAME = "camera.json"
_REMEDY = "name the result folder of a solve with a video, or its camera.json"


def camera_file(path: str | Path) -> Path:
    """The camera file that a path means: itself, or the one in a result folder."""
    path = Path(path)
    return path / FILE_NAME if path.is_dir() else path


def write_camera(path: str | Path, camera: CameraResult) -> None:
    """Write a camera; its frame is the internal lab frame, z up, metres."""
    content = {
        "about": "x_cam = R_lab_cam^T (x_lab - position), px = focal * x / z + image_size / 2; lab z up, m; "
        "camera x right, y down, z away",
        "R_lab_cam": camera.R_lab_cam.tolist(),
        "position_m": camera.position.tolist(),
        "focal_px": camera.focal,
        "image_size_px": list(camera.image_size),
        "reprojection_px": None if np.isnan(camera.reprojection_px) else camera.reprojection_px,
    }
    write_text_atomic(Path(path), json.dumps(content, indent=1) + "\n")


def read_camera(path: str | Path) -> CameraResult:
    """Read what ``write_camera`` wrote."""
    path = camera_file(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        turn = np.array(content["R_lab_cam"], dtype=float)
        position = np.array(content["position_m"], dtype=float)
        size = tuple(int(v) for v in content["image_size_px"])
        focal = float(content["focal_px"])
        error = content.get("reprojection_px")
    except FileNotFoundError as problem:
        raise InputError("there is no camera", path, _REMEDY) from problem
    except (OSError, ValueError, TypeError, KeyError) as problem:
        raise InputError("is not a camera file", path, _REMEDY) from problem
    proper = turn.shape == (3, 3) and np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
    if not proper or position.shape != (3,) or not np.isfinite(position).all() or not focal > 0 or len(size) != 2:
        raise InputError("holds no proper camera", path, _REMEDY)
    return CameraResult(turn, position, focal, (size[0], size[1]), float("nan") if error is None else float(error))
