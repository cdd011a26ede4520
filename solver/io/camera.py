"""The fitted camera of one trial, as a small JSON file that another trial of the same session can be given."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.text import read_bytes

FILE_NAME = "camera.json"
_REMEDY = "name the result folder of a solve with a video, or its camera.json"
_SAME_ASPECT = 0.01


def camera_file(path: str | Path) -> Path:
    """The camera file that a path means: itself, or the one in a result folder."""
    path = Path(path)
    if not path.is_dir():
        return path
    if not (path / FILE_NAME).is_file():
        raise InputError(f"the folder holds no {FILE_NAME}", path, _REMEDY)
    return path / FILE_NAME


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
    write_text_atomic(Path(path), json_text(content) + "\n")


def read_camera(path: str | Path) -> CameraResult:
    """Read what ``write_camera`` wrote.

    Raises
    ------
    InputError : there is none, or it is no proper camera
    """
    path = camera_file(path)
    data = read_bytes(path)
    try:
        content = json.loads(data.decode("utf-8"))
        turn = np.array(content["R_lab_cam"], dtype=float)
        position = np.array(content["position_m"], dtype=float)
        width, height = (int(v) for v in content["image_size_px"])
        focal = float(content["focal_px"])
        error = content.get("reprojection_px")
        error = float("nan") if error is None else float(error)
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as problem:
        raise InputError("is not a camera file", path, _REMEDY) from problem
    proper = turn.shape == (3, 3) and np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
    placed = position.shape == (3,) and np.isfinite(position).all()
    if not (proper and placed and 0 < focal < np.inf and width > 0 and height > 0):
        raise InputError("holds no proper camera", path, _REMEDY)
    return CameraResult(turn, position, focal, (width, height), error)


def resized(camera: CameraResult, image_size: tuple[int, int], where: str | Path) -> CameraResult:
    """The same camera with the pictures it takes in another resolution.

    Parameters
    ----------
    image_size : (width, height) px; (0, 0) if no picture is looked at
    where : the camera's file, for the message

    Raises
    ------
    InputError : the picture has another shape, so it was not this camera that took it
    """
    if image_size in (camera.image_size, (0, 0)):
        return camera
    (width, height), (own_width, own_height) = image_size, camera.image_size
    scale = width / own_width
    if abs(height / (own_height * scale) - 1) > _SAME_ASPECT:
        raise InputError(
            f"is the camera of a video of {own_width} x {own_height} pixels, and this video has {width} x {height}",
            where,
            "give the camera of a trial that was filmed in the same way",
        )
    return replace(camera, focal=camera.focal * scale, image_size=image_size)
