"""The scene's camera, and picking: arithmetic held against the graphics library and against what must stay the same."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from markerscope.widgets.scene import PRESETS, Camera
from markerscope.widgets.scene.camera import NEAREST
from markerscope.widgets.scene.picking import nearest_point, nearest_segment, points_in_box

angles = st.floats(-3.1, 3.1)
cameras = st.builds(
    Camera,
    target=st.tuples(*[st.floats(-3, 3)] * 3),
    azimuth=angles,
    elevation=st.floats(-np.pi / 2, np.pi / 2),
    distance=st.floats(0.5, 20),
    view_angle=st.floats(0.2, 1.2),
    parallel=st.booleans(),
)


@given(cameras)
def test_the_basis_is_a_right_handed_frame_with_the_head_up(camera: Camera) -> None:
    basis = camera.basis()
    assert np.allclose(basis @ basis.T, np.eye(3), atol=1e-12) and np.linalg.det(basis) == pytest.approx(1)
    assert basis[1, 2] >= -1e-12 and abs(basis[0, 2]) < 1e-12


@given(cameras, st.floats(0.3, 3), st.tuples(st.floats(20, 780), st.floats(20, 580)))
def test_what_lies_under_the_pointer_stays_there_in_a_zoom(camera: Camera, factor: float, at: tuple) -> None:
    right, up, _ = camera.basis() * camera.metres_per_pixel(600)
    point = np.array(camera.target) + (at[0] - 400) * right - (at[1] - 300) * up
    assert np.allclose(camera.project(point, 800, 600)[0][0], at, atol=1e-6)
    zoomed = camera.zoomed(factor, at, (800, 600))
    assert np.allclose(zoomed.project(point, 800, 600)[0][0], at, atol=1e-6)
    panned = camera.panned(13, -7, 600)
    assert np.allclose(panned.project(point, 800, 600)[0][0], np.add(at, (13, -7)), atol=1e-6)


@example(Camera(azimuth=0.0, elevation=-1.5, view_angle=1.0), 364, 2.0)
@given(cameras, st.integers(0, 1000), st.floats(0.4, 3))
def test_a_fit_shows_everything_and_wastes_no_room(camera: Camera, seed: int, aspect: float) -> None:
    """In the example one point bounds the picture on both sides, and the camera was put into it."""
    points = np.random.default_rng(seed).normal(size=(40, 3)) * [0.4, 0.6, 0.9]
    points[::7] = np.nan
    fitted = camera.fitted(points, aspect)
    pixels, depth = fitted.project(points[np.isfinite(points[:, 0])], 600 * aspect, 600)
    assert depth.min() > 0.99 * NEAREST
    share = np.abs(pixels / [600 * aspect, 600] - 0.5).max()
    touching = depth.min() < 1.01 * NEAREST
    assert (share > 0.40 or touching) and share <= 0.5, f"the farthest point is at {share:.3f}"
    assert fitted.basis() == pytest.approx(camera.basis())


def test_the_sides_of_a_person_are_the_persons() -> None:
    facing = 0.6
    ahead, left = np.array([np.cos(facing), np.sin(facing), 0]), np.array([-np.sin(facing), np.cos(facing), 0])
    back = {name: Camera().turned_to(name, facing).basis()[2] for name in PRESETS}
    assert np.allclose(back["front"], ahead) and np.allclose(back["back"], -ahead)
    assert np.allclose(back["left"], left) and np.allclose(back["right"], -left)
    assert np.allclose(back["top"], [0, 0, 1])
    assert np.allclose(Camera().turned_to("top", facing).basis()[1], ahead), "the person looks up the picture"
    assert back["isometric"] @ ahead > 0.5 and back["isometric"][2] > 0.3


@given(cameras)
def test_a_state_survives_a_file_and_rubbish_does_not(camera: Camera) -> None:
    assert Camera.of_state(json.loads(json.dumps(camera.state()))) == camera
    for bad in ({}, {"target": "abc"}, {"distance": float("nan")}, {"azimuth": None}, {"distance": -1}):
        assert Camera.of_state(bad) == Camera()


def test_behind_the_camera_there_is_no_pixel() -> None:
    camera = Camera(target=(0, 0, 0), azimuth=0, elevation=0, distance=2)
    pixels, depth = camera.project(np.array([[0, 0, 0], [3.0, 0, 0], [2.0, 0, 0]]), 100, 100)
    assert np.allclose(pixels[0], 50) and np.isnan(pixels[1:]).all()
    assert np.allclose(depth, [2, -1, 0])


def test_the_nearest_in_front_is_picked() -> None:
    pixels = np.array([[10.0, 10], [11.0, 10], [40.0, 40], [np.nan, np.nan]])
    depth = np.array([5.0, 3.0, 1.0, 1.0])
    assert nearest_point(pixels, depth, (10, 10), 6) == 1, "of two in one place, the one in front"
    assert nearest_point(pixels, depth, (37, 40), 6) == 2
    assert nearest_point(pixels, depth, (25, 25), 6) == -1
    assert nearest_point(np.zeros((0, 2)), np.zeros(0), (0, 0), 6) == -1
    assert nearest_point(pixels[3:], depth[3:], (0, 0), 1e9) == -1
    assert points_in_box(pixels, (41, 41), (9, 9)) == [0, 1, 2]
    assert points_in_box(pixels, (10.5, 0), (20, 20)) == [1]
    a, b = np.array([[0.0, 0], [0.0, 50], [np.nan, 0]]), np.array([[100.0, 0], [100.0, 50], [0.0, 0]])
    assert nearest_segment(a, b, (60, 4), 5) == 0 and nearest_segment(a, b, (60, 46), 5) == 1
    assert nearest_segment(a, b, (60, 25), 5) == -1 and nearest_segment(a, b, (106, 0), 5) == -1
