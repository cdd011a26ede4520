"""Force plates of every type: forces and centres of pressure forward into channels, and read back."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.force_plates import ForcePlate, plates_of_c3d, plates_of_mot
from markerscope.solver.io.markers_in import load_markers
from tests.io.c3d_bytes import c3d_bytes

FRAMES, SAMPLES = 20, 5
HALF_X, HALF_Y, DEPTH = 200.0, 300.0, 40.0
CORNERS = np.array([[700, 900, 0], [300, 900, 0], [300, 300, 0], [700, 300, 0]], float)
"""Turned over, as plates lie whose z points down: its x against the lab's y would be another; here x ahead, y left."""


def channels_of(kind: int, force: np.ndarray, place: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """(S, C) of the force (S, 3) N on the plate at places (S, 2) mm, in the plate's axes: the formulas turned round."""
    fx, fy, fz = force.T
    x, y = place.T
    mx, my = y * fz + DEPTH * fy, -x * fz - DEPTH * fx
    if kind == 1:
        return np.stack([fx, fy, fz, x, y, np.zeros_like(x)], axis=1)
    if kind in (2, 4):
        six = np.stack([fx, fy, fz, mx, my, np.zeros_like(x)], axis=1)
        return six if kind == 2 else six @ np.linalg.inv(matrix).T
    a, b = 120.0, 200.0
    p, q = mx / b, my / a  # of the four corners: sums and differences of z1..z4
    z = np.stack([fz + p - q, fz + p + q, fz - p + q, fz - p - q], axis=1) / 4
    return np.concatenate([np.stack([fx / 2, fx / 2, fy / 2, fy / 2], axis=1), z], axis=1)


def read(kind: int, tmp_path: Path) -> tuple[ForcePlate, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(kind)
    count = FRAMES * SAMPLES
    force = np.stack([rng.normal(0, 40, count), rng.normal(0, 60, count), rng.uniform(100, 900, count)], axis=1)
    place = rng.uniform(-150, 150, (count, 2))
    matrix = np.eye(6) * rng.uniform(0.5, 3, 6) + rng.normal(0, 0.02, (6, 6))
    raw = channels_of(kind, force, place, matrix)
    origin = [120.0, 200.0, -DEPTH] if kind == 3 else [0.0, 0.0, -DEPTH]
    plate = {
        "USED": np.array(1),
        "TYPE": np.array([kind]),
        "CHANNEL": np.arange(1, raw.shape[1] + 1).reshape(-1, 1),
        "CORNERS": _stored(CORNERS),
        "ORIGIN": _stored(np.array([origin])),
        "ZERO": np.array([1, 0]),
        **({"CAL_MATRIX": _stored(matrix.T)} if kind == 4 else {}),
    }
    path = tmp_path / "plate.c3d"
    points = rng.normal(0, 500, (FRAMES, 3, 3))
    path.write_bytes(c3d_bytes(points, analog=raw.reshape(FRAMES, SAMPLES, -1), groups={"FORCE_PLATFORM": plate}))
    (found,), notes = plates_of_c3d(path, load_markers(path, up="z", units="mm"))
    assert not notes
    return found, force, place


def _stored(rows: np.ndarray) -> np.ndarray:
    """Rows one after the other in the file, with the dimensions (columns, rows) that the format counts."""
    return np.ascontiguousarray(rows, dtype=float).reshape(-1).reshape(rows.shape[::-1])


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_force_and_place_come_back(kind: int, tmp_path: Path) -> None:
    plate, force, place = read(kind, tmp_path)
    assert len(plate.time) == FRAMES * SAMPLES and np.isclose(np.diff(plate.time), 1 / (100 * SAMPLES)).all()
    assert (plate.force[:, 2] > 0).all(), "the ground pushes up"
    assert np.allclose(np.abs(plate.force), np.abs(force), atol=0.05)
    middle = CORNERS.mean(axis=0)[:2] / 1000
    assert np.allclose(np.abs(plate.centre[:, :2] - middle), np.abs(place) / 1000, atol=1e-4)


def test_plates_are_read_as_another_library_reads_them(shared_data: Path) -> None:
    for name in ("gait/HC044A15.c3d", "fullbody/Walk1.c3d"):
        path = shared_data / name
        if not path.is_file():
            pytest.skip("the walks are not there")
        markers = load_markers(path)
        plates, _ = plates_of_c3d(path, markers)
        others = ezc3d.c3d(str(path), extract_forceplat_data=True)["data"]["platform"]
        for plate, other in zip(plates, others, strict=True):
            lab = plate.force @ markers.R_lab_internal.T
            assert np.allclose(np.abs(lab), np.abs(other["force"].T), atol=0.5)
            loaded = plate.force[:, 2] > 200
            centre = other["center_of_pressure"].T[loaded, :2]
            ours = 1000 * (plate.centre[loaded] @ markers.R_lab_internal.T)[:, :2]
            assert np.abs(ours - centre).max() < 15, name  # their depth of the origin has the other sign


def test_a_plate_of_another_type_is_left_aside_and_said(tmp_path: Path) -> None:
    plate = {
        "USED": np.array(1),
        "TYPE": np.array([21]),
        "CHANNEL": np.arange(1, 7).reshape(-1, 1),
        "CORNERS": _stored(CORNERS),
        "ORIGIN": _stored(np.zeros((1, 3))),
    }
    path = tmp_path / "plate.c3d"
    analog = np.zeros((FRAMES, SAMPLES, 6))
    path.write_bytes(c3d_bytes(np.ones((FRAMES, 3, 3)), analog=analog, groups={"FORCE_PLATFORM": plate}))
    plates, notes = plates_of_c3d(path, Markers(np.zeros((FRAMES, 3, 3)), 100.0, ("a", "b", "c")))
    assert not plates and "its type is 21" in notes[0]


def test_a_table_without_forces_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mot"
    path.write_text("a\nnRows=2\nnColumns=2\nendheader\ntime\tknee\n0\t1\n1\t2\n")
    with pytest.raises(InputError, match="no ground reaction forces"):
        plates_of_mot(path)
