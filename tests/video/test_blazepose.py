"""The pose networks and the tracking about them."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from markerscope.resources import resource
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.video import blazepose_models
from markerscope.solver.video.blazepose import Region, Tracker, track_pose
from markerscope.solver.video.blazepose_models import _anchors, _refined, _weighted_suppression
from markerscope.solver.video.frames import read_frames


def column(name: str) -> int:
    return LANDMARKS.index(name)


def test_anchors_are_the_cell_centres_of_five_layers() -> None:
    anchors = _anchors()
    assert anchors.shape == (2254, 2)
    np.testing.assert_allclose(anchors[[0, 1, 2]], [[4 / 224, 4 / 224]] * 2 + [[12 / 224, 4 / 224]])
    np.testing.assert_allclose(anchors[28 * 28 * 2], [8 / 224, 8 / 224])
    np.testing.assert_allclose(anchors[-6:], [[208 / 224, 208 / 224]] * 6)


def test_overlapping_boxes_become_their_weighted_mean() -> None:
    corners = np.array([[0, 0, 1, 1], [0.1, 0, 1.1, 1], [3, 3, 4, 4.0]])
    points = np.arange(3)[:, None, None] * np.ones((3, 4, 2))
    (first, second) = _weighted_suppression(np.array([0.9, 0.6, 0.7]), corners, points)
    assert first[0] == 0.9 and second[0] == 0.7
    np.testing.assert_allclose(first[1], 0.6 / 1.5)
    np.testing.assert_allclose(second[1], 2.0)


def test_a_confident_heatmap_moves_its_point_and_a_doubtful_one_does_not() -> None:
    y, x = np.mgrid[:64, :64]
    bump = np.exp(-((x - 20) ** 2 + (y - 31) ** 2) / 0.8)
    heatmaps = np.stack([np.log(0.9 * bump + 1e-9) - np.log(1 - 0.9 * bump), np.full((64, 64), -9.0)], axis=2)
    moved = _refined(np.array([[21.5 / 64, 30.2 / 64], [0.5, 0.5]]), heatmaps)
    np.testing.assert_allclose(moved, [[20 / 64, 31 / 64], [0.5, 0.5]], atol=2e-4)


@pytest.mark.parametrize("turn", [0.0, 0.4, -2.5])
def test_a_crop_shows_what_its_coordinates_say(turn: float) -> None:
    picture = np.zeros((400, 300, 3), np.uint8)
    spot = np.array([170.0, 215.0])
    cv2.circle(picture, (170, 215), 6, (255, 255, 255), -1, cv2.LINE_AA)
    region = Region(np.array([150.0, 200.0]), 180.0, turn)
    crop = region.crop(picture, 256)[:, :, 0].astype(float)
    y, x = np.mgrid[:256, :256] + 0.5
    seen = np.array([[(crop * x).sum(), (crop * y).sum()]]) / crop.sum() / 256
    error = np.abs(region.to_picture(seen)[0] - spot).max()
    assert error < 0.05, f"{error:.3f} px off"


def test_the_region_stands_upright_along_the_body() -> None:
    lying = Region.around(np.array([100.0, 100.0]), np.array([140.0, 100.0]))
    assert lying.side == pytest.approx(100.0)
    np.testing.assert_allclose(lying.to_picture(np.array([[0.5, 0.0]])), [[150, 100]], atol=1e-9)


def test_a_changed_network_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file in resource("pose").iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.setattr(blazepose_models, "resource", lambda *parts: tmp_path / parts[-1])
    blazepose_models.Detector()
    data = bytearray((tmp_path / "pose_detection.tflite").read_bytes())
    data[1000] ^= 1
    (tmp_path / "pose_detection.tflite").write_bytes(data)
    with pytest.raises(InputError, match="not the one that was shipped"):
        blazepose_models.Detector()
    (tmp_path / "pose_detection.tflite").unlink()
    with pytest.raises(InputError, match="missing"):
        blazepose_models.Detector()


def test_loading_a_network_writes_nothing_and_keeps_standard_error(capfd: pytest.CaptureFixture[str]) -> None:
    blazepose_models.Detector()
    os.write(2, b"still here")
    assert capfd.readouterr() == ("", "still here")


def test_landmarks_lie_on_the_reprojected_joints(shared_data: Path, squat_landmarks: Landmarks) -> None:
    """Joint centres of the labelled markers' inverse kinematics, seen by the camera that was recovered by hand."""
    camera = json.loads((shared_data / "squat_video" / "camera_recovered.json").read_text())
    bodies = json.loads((shared_data / "squat_video" / "bodies_mocap.json").read_text())
    clock = np.clip(squat_landmarks.time - 0.01, 0, None)
    parts = {"hip": "femur", "knee": "tibia", "ankle": "talus", "shoulder": "humerus", "elbow": "ulna", "wrist": "hand"}
    assert squat_landmarks.tracked.all()
    for side in ("left", "right"):
        for joint, body in parts.items():
            path = np.array(bodies["bodies"][f"{body}_{side[0]}"]["translation"])
            points = np.stack([np.interp(clock, bodies["time"], path[:, k]) for k in range(3)], axis=1)
            turn = cv2.Rodrigues(np.array(camera["R"]))[0]
            seen = cv2.projectPoints(
                points, turn, np.array(camera["t"]), np.array(camera["K"]), np.array(camera["dist"])
            )
            error = np.linalg.norm(squat_landmarks.image[:, column(f"{side}_{joint}")] - seen[0][:, 0], axis=1)
            assert np.median(error) < 14, f"{side} {joint}: {np.median(error):.1f} px of a person of 500 px"


def test_world_landmarks_have_human_size_and_axes(squat_landmarks: Landmarks) -> None:
    world = np.median(squat_landmarks.world[:5], axis=0)
    head, feet = world[column("nose")], world[[column("left_ankle"), column("right_ankle")]].mean(axis=0)
    assert head[1] < -0.4 and feet[1] > 0.5, "y does not point down"
    assert 1.1 < feet[1] - head[1] < 1.8, f"nose to ankle {feet[1] - head[1]:.2f} m"
    middle = world[[column("left_hip"), column("right_hip")]].mean(axis=0)
    assert np.linalg.norm(middle) < 0.02, "not about the hip centre"


def test_a_lying_picture_gives_the_turned_landmarks(shared_data: Path) -> None:
    picture = next(read_frames(shared_data / "squat_video" / "video.mp4"))[2]
    results = []
    for image in (picture, np.ascontiguousarray(np.rot90(picture, -1))):
        found = Tracker()(image)
        assert found is not None
        pose, region = found
        world = pose.world.copy()
        world[:, :2] = world[:, :2] @ region.rotation.T
        results.append((region.to_picture(pose.points[:33]), world))
    (upright, world), (lying, world_lying) = results
    turned = np.stack([picture.shape[0] - 1 - upright[:, 1], upright[:, 0]], axis=1)  # a quarter turn clockwise
    body = slice(11, 33)
    assert np.median(np.linalg.norm((turned - lying)[body], axis=1)) < 8
    turned_world = np.stack([-world[:, 1], world[:, 0], world[:, 2]], axis=1)
    assert np.median(np.linalg.norm((turned_world - world_lying)[body], axis=1)) < 0.04


def test_of_two_people_the_larger_is_followed(shared_data: Path) -> None:
    picture = next(read_frames(shared_data / "squat_video" / "video.mp4"))[2][300:1280]
    small = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    scene = np.full((picture.shape[0], 1400, 3), 90, np.uint8)
    scene[:, 600:1320] = picture
    scene[200 : 200 + small.shape[0], 60 : 60 + small.shape[1]] = small
    found = Tracker()(scene)
    assert found is not None
    pose, region = found
    alone = Tracker()(picture)
    assert alone is not None
    expected = np.array([600, 0]) + alone[1].to_picture(alone[0].points[:33])
    assert np.median(np.linalg.norm(region.to_picture(pose.points[:33]) - expected, axis=1)) < 8


def blank(path: Path, count: int = 6) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        for _ in range(count):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(np.full((240, 320, 3), 90, np.uint8), "rgb24")))
        container.mux(stream.encode(None))
    return path


def test_a_video_of_nobody_is_said_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no person is found"):
        track_pose(blank(tmp_path / "empty_room.mp4"))


def test_the_rate_chooses_every_nth_frame_and_lost_frames_are_marked(shared_data: Path, tmp_path: Path) -> None:
    frames = [image for _, _, image in read_frames(shared_data / "squat_video" / "video.mp4", range(0, 16, 2))]
    path = tmp_path / "leaves.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=60)
        stream.width, stream.height, stream.pix_fmt = 720, 1280, "yuv420p"
        for image in [*frames, *[np.full_like(frames[0], 90)] * 8]:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, "rgb24")))
        container.mux(stream.encode(None))
    found = track_pose(path, rate=30)
    assert found.frame.tolist() == list(range(0, 16, 2)) and found.image_size == (720, 1280)
    np.testing.assert_allclose(found.time, np.arange(8) / 30, atol=1e-3)
    assert found.tracked.tolist() == [True] * 4 + [False] * 4
    assert np.isnan(found.image[4:]).all() and np.isnan(found.world[4:]).all() and not found.visibility[4:].any()


def test_a_listener_can_stop_the_work(shared_data: Path) -> None:
    def stop(fraction: float, text: str) -> None:
        raise Cancelled("stopped")

    with pytest.raises(Cancelled):
        track_pose(shared_data / "squat_video" / "video.mp4", progress=stop)
