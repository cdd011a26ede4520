"""Metrics against closed forms and other libraries."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from markerscope.solver.core import metrics


def motion(seed: int = 0, frames: int = 20, joints: int = 24) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(frames, joints, 3))


# points ---------------------------------------------------------------------------------------------------------------
def test_a_constant_shift_is_its_length_and_no_velocity() -> None:
    joints = motion()
    shifted = joints + np.array([0.003, 0.004, 0.0])
    assert metrics.mpjpe(shifted, joints).mean == pytest.approx(0.005)
    assert metrics.v2v(shifted, joints).mean == pytest.approx(0.005)
    assert metrics.mpjve(shifted, joints, np.arange(20) / 100).mean == pytest.approx(0, abs=1e-9)


def test_one_joint_that_is_off() -> None:
    joints = motion()
    other = joints.copy()
    other[5, 3] += [0, 0, 0.24]
    found = metrics.mpjpe(other, joints)
    assert found.mean == pytest.approx(0.24 / (20 * 24))
    assert found.per_point[3] == pytest.approx(0.24 / 20) and found.per_frame[5] == pytest.approx(0.01)
    assert np.count_nonzero(found.per_point) == 1


def test_a_drift_is_its_speed() -> None:
    joints = motion()
    time = np.cumsum(np.random.default_rng(1).uniform(0.005, 0.02, 20))
    drift = joints + time[:, None, None] * np.array([0.3, 0.0, 0.4])
    assert metrics.mpjve(drift, joints, time).mean == pytest.approx(0.5)


def test_lost_points_do_not_count() -> None:
    joints = motion()
    other = joints + np.array([0.01, 0, 0])
    other[:, 7] = np.nan
    other[3] = np.nan
    found = metrics.mpjpe(other, joints)
    assert found.mean == pytest.approx(0.01)
    assert np.isnan(found.per_point[7]) and np.isnan(found.per_frame[3])
    assert np.isnan(metrics.mpjpe(joints * np.nan, joints).mean)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000), st.floats(0.2, 5))
def test_procrustes_undoes_any_similarity(seed: int, scale: float) -> None:
    joints = motion(seed)
    turn = Rotation.random(20, rng=seed).as_matrix()
    moved = scale * joints @ turn.transpose(0, 2, 1) + motion(seed + 1, 20, 1)
    worst = metrics.pa_mpjpe(moved, joints).per_frame.max()
    assert worst < 1e-9, f"{worst} m remain"


def test_procrustes_is_that_of_scipy() -> None:
    from scipy.spatial import procrustes

    a, b = motion(0, 6), motion(1, 6)
    found = metrics.pa_mpjpe(a, b)
    for frame in range(6):
        centred = b[frame] - b[frame].mean(axis=0)
        expected, other, _ = procrustes(b[frame], a[frame])
        # scipy allows a mirror image, which a body is not: compare only where it used none
        u, _, vt = np.linalg.svd(centred.T @ (a[frame] - a[frame].mean(axis=0)))
        if np.linalg.det(u @ vt) < 0:
            continue
        error = np.linalg.norm(expected - other, axis=1).mean() * np.linalg.norm(centred)
        assert found.per_frame[frame] == pytest.approx(error)


def test_procrustes_does_not_mirror() -> None:
    joints = motion()
    assert metrics.pa_mpjpe(joints * [-1, 1, 1], joints).mean > 0.1


# angles ---------------------------------------------------------------------------------------------------------------
@settings(max_examples=30, deadline=None)
@given(st.floats(-1, 1), st.floats(0, 0.5), st.integers(-3, 3))
def test_offset_and_swing_are_told_apart(offset: float, swing: float, turns: int) -> None:
    phase = np.arange(400) * 2 * np.pi / 400
    reference = np.sin(phase * 2)
    found = reference + offset + swing * np.sqrt(2) * np.sin(phase) + turns * 2 * np.pi
    result = metrics.angle_difference(found, reference)
    assert result.offset == pytest.approx(offset, abs=1e-9)
    assert result.rmse_less_offset == pytest.approx(swing, abs=1e-9)
    assert result.rmse == pytest.approx(np.hypot(offset, swing), abs=1e-9)
    assert result.share == 1


def test_missing_angles() -> None:
    reference = np.zeros(10)
    found = np.full(10, 0.2)
    found[:4] = np.nan
    result = metrics.angle_difference(found, reference)
    assert result.share == pytest.approx(0.6) and result.rmse == pytest.approx(0.2)
    assert np.isnan(metrics.angle_difference(reference * np.nan, reference).rmse)


# surfaces -------------------------------------------------------------------------------------------------------------
def sphere(radius: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return np.array(mesh.vertices), np.array(mesh.faces)


def test_distances_to_a_sphere() -> None:
    pytest.importorskip("open3d")
    vertices, faces = sphere()
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(50, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    radius = rng.uniform(0.02, 0.3, 50)
    centre = np.array([40.0, -20.0, 5.0])  # float32 alone would lose 4 micrometres here
    found = metrics.distance_to_mesh(direction * radius[:, None] + centre, vertices + centre, faces, signed=True)
    worst = np.abs(found - (radius - 0.1)).max()
    assert worst < 3e-4, f"{worst * 1000:.3f} mm off, the facets allow 0.3"


def test_distances_to_a_box_beyond_faces_edges_and_corners() -> None:
    pytest.importorskip("open3d")
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((2, 2, 2))
    rng = np.random.default_rng(1)
    points = rng.uniform(-3, 3, (400, 3))
    beyond = np.abs(points) - 1
    expected = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    mesh = np.array(box.vertices), np.array(box.faces)
    found = metrics.distance_to_mesh(points, *mesh, signed=True)
    worst = np.abs(found - expected).max()
    assert worst < 1e-5, f"{worst} m"
    np.testing.assert_allclose(metrics.distance_to_mesh(points, *mesh), np.abs(expected), atol=1e-5)


def test_the_sign_survives_an_open_mouth() -> None:
    pytest.importorskip("open3d")
    vertices, faces = sphere()
    open_faces = faces[vertices[faces].mean(axis=1)[:, 2] < 0.09]
    inside = np.array([[0.0, 0.0, -0.05], [0.03, 0.02, 0.0]])
    assert (metrics.distance_to_mesh(inside, vertices, open_faces, signed=True) < 0).all()


def test_markers_over_frames_with_gaps() -> None:
    pytest.importorskip("open3d")
    vertices, faces = sphere()
    shift = np.linspace(0, 1, 41)[:, None] * np.array([1.0, 0, 0])
    markers = shift[:, None] + np.eye(3) * np.array([0.11, 0.12, 0.09])[:, None]
    markers[8, 1] = np.nan
    markers[4, 2, 0] = np.nan
    asked: list[int] = []

    def surface(frames: np.ndarray) -> np.ndarray:
        asked.append(len(frames))
        return vertices + shift[frames][:, None]

    found = metrics.marker_to_surface(markers, surface, faces, signed=True)
    assert sum(asked) == 41 and max(asked) <= 16
    np.testing.assert_allclose(metrics.nanmean_along(found, 0), [0.01, 0.02, -0.01], atol=3e-4)
    assert np.isnan(found[8, 1]) and np.isnan(found[4, 2]) and np.isnan(found).sum() == 2
    whole = metrics.marker_to_surface(markers, vertices + shift[:, None], faces)
    np.testing.assert_allclose(whole, np.abs(found), atol=1e-12)


# clocks ---------------------------------------------------------------------------------------------------------------
def test_points_between_frames_are_linear() -> None:
    time = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 30))
    line = time[:, None, None] * np.array([[1.0, -2, 3], [0, 5, 1]]) + 4
    wanted = np.array([time[0] - 0.01, time[0], 0.2, 0.31, time[-1], time[-1] + 0.01])
    found = metrics.points_at(time, line, wanted)
    assert np.isnan(found[[0, -1]]).all()
    np.testing.assert_allclose(found[1:-1], wanted[1:-1, None, None] * np.array([[1.0, -2, 3], [0, 5, 1]]) + 4)


def test_a_lost_neighbour_does_not_spoil_a_frame_that_is_met() -> None:
    time = np.arange(5.0)
    points = np.arange(5.0)[:, None, None] * np.ones((1, 1, 3))
    points[2] = np.nan
    found = metrics.points_at(time, points, np.array([1.0, 1.5, 2.0, 2.5, 3.0]))[:, 0, 0]
    np.testing.assert_array_equal(found, [1, np.nan, np.nan, np.nan, 3])


def test_rotations_between_frames_are_scipys_slerp() -> None:
    time = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.03, 10))
    rotations = Rotation.from_rotvec(np.random.default_rng(1).uniform(-1, 1, (20, 3)))
    wanted = np.linspace(time[0], time[-1], 33)
    found = metrics.rotations_at(time, rotations.as_matrix().reshape(10, 2, 3, 3), wanted)
    for joint in range(2):
        expected = Slerp(time, rotations[joint::2])(wanted).as_matrix()
        np.testing.assert_allclose(found[:, joint], expected, atol=1e-9)
    assert np.isnan(metrics.rotations_at(time, rotations.as_matrix().reshape(10, 2, 3, 3), np.array([99.0]))).all()
