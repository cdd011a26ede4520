"""A camera written, read and taken to pictures of another size."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.camera import camera_file, read_camera, resized, write_camera


@pytest.fixture
def camera() -> CameraResult:
    turn = Rotation.from_rotvec([0.3, -2.0, 0.7]).as_matrix()
    return CameraResult(turn, np.array([1.0, -2.5, 1.4]), 1234.5, (720, 1280), 4.25)


@pytest.mark.parametrize("error", [4.25, float("nan")])
def test_what_is_written_is_read(camera: CameraResult, tmp_path: Path, error: float) -> None:
    camera = replace(camera, reprojection_px=error)
    write_camera(tmp_path / "camera.json", camera)
    for path in (tmp_path, tmp_path / "camera.json"):
        back = read_camera(path)
        np.testing.assert_array_equal(back.R_lab_cam, camera.R_lab_cam)
        np.testing.assert_array_equal(back.position, camera.position)
        assert (back.focal, back.image_size) == (camera.focal, camera.image_size)
        np.testing.assert_equal(back.reprojection_px, error)


def test_a_folder_without_one_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds no camera\.json; name the result folder of a solve with a video"):
        camera_file(tmp_path)


def test_a_smaller_copy_of_the_video_shows_the_same(camera: CameraResult) -> None:
    """A point is at the same share of the picture."""
    point = camera.position + camera.R_lab_cam @ [0.3, -0.2, 2.0]
    half = resized(camera, (360, 640), "camera.json")

    def share(seen: CameraResult) -> np.ndarray:
        x, y, z = (point - seen.position) @ seen.R_lab_cam
        return (seen.focal * np.array([x, y]) / z + np.array(seen.image_size) / 2) / seen.image_size

    np.testing.assert_allclose(share(half), share(camera), atol=1e-12)
    assert resized(camera, (720, 1280), "") is camera
    assert resized(camera, (0, 0), "") is camera, "without a video only its direction counts"


def test_a_video_of_another_shape_is_refused(camera: CameraResult) -> None:
    with pytest.raises(InputError, match="720 x 1280 pixels, and this video has 1280 x 720"):
        resized(camera, (1280, 720), "camera.json")
