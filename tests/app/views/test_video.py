"""What is drawn over a video frame, projected as OpenCV does it."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from markerscope.app.views.bodies import of_motion
from markerscope.app.views.tracks import tracks_of
from markerscope.app.views.video import LANDMARK_EDGES, landmarks_at, projected, projection_at
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.sync.offset import Sync
from tests.app.views.conftest import Made


def by_opencv(camera: CameraResult, points: np.ndarray) -> np.ndarray:
    width, height = camera.image_size
    matrix = np.array([[camera.focal, 0, width / 2], [0, camera.focal, height / 2], [0, 0, 1.0]])
    turn = camera.R_lab_cam.T
    px, _ = cv2.projectPoints(points, cv2.Rodrigues(turn)[0], -turn @ camera.position, matrix, np.zeros(5))
    return np.asarray(px)[:, 0]


def test_points_fall_where_opencv_puts_them(made: Made) -> None:
    points = made.motion.joints[10]
    error = np.abs(projected(made.motion.camera, points) - by_opencv(made.motion.camera, points)).max()
    assert error < 1e-6, f"{error} px"


def test_nothing_is_seen_behind_the_camera_or_without_one(made: Made) -> None:
    camera = made.motion.camera
    behind = camera.position - 2 * camera.R_lab_cam[:, 2]
    assert np.isnan(projected(camera, behind)).all()
    blind = replace(camera, image_size=(0, 0))
    assert np.isnan(projected(blind, made.motion.joints)).all()
    assert projected(blind, made.motion.joints).shape == (60, 24, 2)


def test_markers_and_body_are_taken_at_the_video_frames_own_moment(made: Made) -> None:
    """The clocks differ in rate and start; half way between marker frames 20 and 21 means half way."""
    sync = Sync(0.25, 1.001, 1.0, np.zeros(1), np.zeros(1))
    tracks, body = tracks_of(made.markers, made.motion), of_motion(made.body, made.motion)
    marker_time = 0.5 * (made.markers.time[20] + made.markers.time[21])
    found = projection_at(made.motion.camera, sync, (marker_time - 0.25) / 1.001, tracks, body)
    half = made.markers.positions[20:22].mean(axis=0)
    seen = np.isfinite(half).all(axis=1)
    assert np.abs(found.markers[seen] - by_opencv(made.motion.camera, half[seen])).max() < 1e-5
    assert np.isnan(found.markers[~seen]).all()
    ends = by_opencv(made.motion.camera, made.motion.joints[20]), by_opencv(made.motion.camera, made.motion.joints[21])
    assert np.abs(found.joints - 0.5 * (ends[0] + ends[1])).max() < 1.0
    assert len(found.bones) == 23
    skin, _ = made.body.pose(
        made.motion.rotations[20:22], made.motion.betas, made.motion.trans[20:22], made.body.lod_index
    )
    assert np.abs(found.body - by_opencv(made.motion.camera, skin.mean(axis=0))).max() < 1.0
    assert found.faces.max() == len(found.body) - 1


def test_beyond_the_markers_nothing_is_drawn(made: Made) -> None:
    tracks, body = tracks_of(made.markers, made.motion), of_motion(made.body, made.motion)
    found = projection_at(made.motion.camera, made.sync, 30.0, tracks, body)
    assert np.isnan(found.markers).all() and not len(found.joints) and not len(found.body)
    without = projection_at(made.motion.camera, made.sync, 0.5, tracks)
    assert np.isfinite(without.markers).any() and not len(without.body)


@pytest.fixture
def watched() -> Landmarks:
    """Every second frame watched; the person is lost at frames 4 to 6; nobody looked between 6 and 30."""
    frame = np.array([0, 2, 4, 6, 30, 32])
    image = frame[:, None, None] * np.ones((6, 33, 2))
    tracked = np.array([True, True, False, False, True, True])
    image[~tracked] = np.nan
    visibility = np.where(tracked[:, None], 0.8, 0.0) * np.ones((6, 33))
    return Landmarks(image, image[..., :1] * np.ones(3), visibility, tracked, frame / 30, frame, (720, 1280))


@pytest.mark.parametrize(
    ("frame", "value", "tracked", "interpolated"),
    [
        (2, 2.0, True, False),
        (1, 1.0, True, True),
        (31, 31.0, True, True),
        (4, np.nan, False, False),
        (3, np.nan, False, False),
        (18, np.nan, False, False),
        (40, np.nan, False, False),
    ],
)
def test_landmarks_of_a_frame(watched: Landmarks, frame: int, value: float, tracked: bool, interpolated: bool) -> None:
    found = landmarks_at(watched, frame, frame / 30)
    assert (found.tracked, found.interpolated) == (tracked, interpolated)
    assert np.allclose(found.px, value, equal_nan=True)
    assert np.allclose(found.visibility, 0.8 if tracked else 0.0)


def test_landmark_lines_are_those_of_both_sides_alike() -> None:
    names = {frozenset((LANDMARKS[a], LANDMARKS[b])) for a, b in LANDMARK_EDGES}
    swap = {"left": "right", "right": "left"}

    def other(name: str) -> str:
        return "_".join(swap.get(word, word) for word in name.split("_"))

    assert {frozenset(other(n) for n in edge) for edge in names} == names
    assert frozenset(("left_hip", "left_knee")) in names
    assert set(np.unique(LANDMARK_EDGES)) == set(range(33))
    assert len(names) == len(LANDMARK_EDGES)
