"""The video view: what is drawn lies on the frame's own pixels at any zoom."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from markerscope.widgets.images import to_rgb
from markerscope.widgets.scene import Camera
from markerscope.widgets.video import LAYERS, VideoView
from markerscope.widgets.video.outline import Outline
from markerscope.widgets.video.zoom import Zoom
from tests.widgets.seen import BLUE, GREEN, RED, box

FRAME = np.zeros((120, 200, 3), dtype=np.uint8)
FRAME[:60, :100], FRAME[60:, :100], FRAME[:60, 100:], FRAME[60:, 100:] = (90, 0, 0), (0, 90, 0), (0, 0, 90), (60, 60, 0)


@pytest.fixture
def video(qapp: QApplication) -> Iterator[VideoView]:
    view = VideoView()
    view.resize(500, 400)
    view.set_frame(FRAME)
    view.show()
    yield view
    view.close()
    view.deleteLater()


def picture(view: VideoView) -> np.ndarray:
    return to_rgb(view.image()).astype(int)


def colour_at(view: VideoView, pixel: tuple[float, float]) -> np.ndarray:
    x, y = view.to_widget(np.array([pixel]))[0]
    return picture(view)[int(y), int(x)]


def test_a_frame_is_shown_whole_and_undistorted(video: VideoView) -> None:
    assert np.allclose(video.to_widget(np.array([[0, 0], [200, 120]])), [[0, 50], [500, 350]])
    for x, y in ((50, 30), (50, 90), (150, 30), (150, 90)):
        assert np.array_equal(colour_at(video, (x, y)), FRAME[y, x])
    image = picture(video)
    assert np.abs(image[:49] - image[0, 0]).max() == 0 and np.abs(image[52, 5] - FRAME[0, 0]).max() <= 2


@given(
    st.lists(st.tuples(st.floats(0.5, 3), st.floats(0, 500), st.floats(0, 400)), max_size=6),
    st.floats(-300, 300),
    st.floats(-300, 300),
)
def test_zoom_keeps_what_is_under_the_pointer(steps: list[tuple[float, float, float]], dx: float, dy: float) -> None:
    zoom = Zoom((200, 120), (500, 400))
    for factor, x, y in steps:
        held = zoom.to_frame(np.array([[x, y]]))
        zoom = zoom.nearer(factor, (x, y))
        inside = ((zoom.centre > 1e-6) & (zoom.centre < np.array(zoom.picture) - 1e-6)).all()
        if zoom.zoomed and inside:
            assert np.allclose(zoom.to_widget(held), [[x, y]], atol=1e-6)
        assert zoom.scale >= zoom.fit
    zoom = zoom.panned(dx, dy)
    assert (zoom.centre >= 0).all() and (zoom.centre <= zoom.picture).all(), "the picture cannot be lost"
    points = np.array([[3.0, 4.0], [100, 60]])
    assert np.allclose(zoom.to_frame(zoom.to_widget(points)), points)
    assert zoom.fitted().of_state(json.loads(json.dumps(zoom.state()))) == zoom
    for bad in ({"scale": "x"}, {"scale": float("nan")}, {"scale": -1}, {"scale": 2, "centre": [1]}):
        assert zoom.of_state(bad) == zoom.fitted()


def test_markers_landmarks_and_bones_lie_on_their_pixels_at_any_zoom(video: VideoView, wheel: Callable) -> None:
    markers = np.array([[40.0, 40.0], [160.0, 80.0], [np.nan, np.nan]])
    video.set_markers(markers, np.array([RED, GREEN, BLUE], dtype=np.uint8))
    video.set_landmarks(np.array([[100.0, 20.0], [60.0, 20.0], [np.nan, 0]]), np.array([[0, 1], [1, 2]]), np.ones(3))
    video.set_skeleton(np.array([[120.0, 100.0], [180.0, 100.0], [np.nan, 0]]), np.array([[0, 1], [1, 2]]), (9, 250, 9))
    wanted = {(40, 40): RED, (160, 80): GREEN, (100, 20): (240, 228, 66), (150, 100): (9, 250, 9)}
    for angle in (0, 120, 360):
        wheel(video, (250.0, 200.0), angle)
        for pixel, colour in wanted.items():
            x, y = video.to_widget(np.array([pixel]))[0]
            if 5 < x < 495 and 5 < y < 395:
                got = picture(video)[int(y), int(x)]
                assert np.abs(got - colour).max() <= 40, f"{got} at {pixel} of the frame, zoomed by {angle}"
    video.fit()
    plain = picture(video)
    for layer in LAYERS:
        video.show_layer(layer, False)
        assert (np.abs(picture(video) - plain).max() > 40) == (layer != "body"), layer
        video.show_layer(layer, True)
    assert np.array_equal(picture(video), plain)
    with pytest.raises(ValueError, match="ghosts"):
        video.show_layer("ghosts", True)


def test_clicks_drags_and_double_clicks(video: VideoView, mouse: Callable[..., None], wheel: Callable) -> None:
    heard: list[tuple] = []
    video.marker_clicked.connect(lambda i, held: heard.append(("marker", i, held)))
    video.background_clicked.connect(lambda held: heard.append(("background",)))
    video.zoom_changed.connect(lambda: heard.append(("zoom",)))
    video.set_markers(np.array([[40.0, 40.0], [np.nan, np.nan], [160.0, 80.0]]))
    at = video.to_widget(np.array([[160.0, 80.0]]))[0]
    mouse(video, "press", at + 3, held=Qt.KeyboardModifier.ControlModifier)
    mouse(video, "release", at + 3, held=Qt.KeyboardModifier.ControlModifier)
    mouse(video, "press", (250, 200))
    mouse(video, "release", (250, 200))
    assert heard == [("marker", 2, Qt.KeyboardModifier.ControlModifier), ("background",)]
    heard.clear()
    wheel(video, (250.0, 200.0), 480)
    assert heard == [("zoom",)]
    state, image = video.state(), picture(video)
    before = video.to_widget(np.array([[100.0, 60.0]]))[0]
    mouse(video, "press", (250, 200))
    mouse(video, "move", (270, 190))
    mouse(video, "release", (270, 190))
    assert np.allclose(video.to_widget(np.array([[100.0, 60.0]]))[0], before + np.array([20, -10]))
    assert ("marker" not in str(heard)) and ("background",) not in heard
    video.restore(state)
    assert video.state() == state and np.array_equal(picture(video), image)
    mouse(video, "double", (250, 200))
    assert video.state()["scale"] == 0
    video.restore({"scale": None})
    assert video.state()["scale"] == 0


def test_zoom_survives_the_next_frame_and_another_size_of_the_widget(video: VideoView, wheel: Callable) -> None:
    wheel(video, (250.0, 200.0), 480)
    state = video.state()
    video.set_frame(FRAME[::-1].copy())
    assert video.state() == state
    video.resize(400, 300)
    assert video.state() == state
    video.set_frame(None, "The video ends before this frame.")
    assert len(np.unique(picture(video).reshape(-1, 3), axis=0)) > 3, "the sentence is painted"
    video.set_frame(FRAME)
    assert video.state() == state
    video.set_frame(np.zeros((50, 50, 3), dtype=np.uint8))
    assert video.state()["scale"] == 0, "another video is fitted"


def test_the_frame_given_may_be_written_over(video: VideoView) -> None:
    frame = FRAME.copy()
    video.set_frame(frame)
    before = picture(video)
    frame[:] = 255
    assert np.array_equal(picture(video), before)


def test_a_file_holds_the_picture(video: VideoView, tmp_path: Path) -> None:
    video.save_png(tmp_path / "a.png")
    assert np.array_equal(to_rgb(QImage(str(tmp_path / "a.png"))), to_rgb(video.image()))


def test_an_outline_is_the_rim_of_a_convex_thing() -> None:
    """Of a box seen from outside, the outline is its convex hull: every edge of the hull, and none within."""
    from scipy.spatial import ConvexHull

    vertices, faces = box(0.5)
    outline = Outline(faces)
    for azimuth, elevation in ((0.3, 0.4), (2.0, -0.7), (-1.0, 1.2)):
        camera = Camera(target=(0, 0, 0), azimuth=azimuth, elevation=elevation, distance=4)
        pixels = camera.project(vertices, 800, 600)[0]
        found = outline.segments(pixels)
        got = {frozenset(map(tuple, np.round(segment, 6))) for segment in found}
        hull = ConvexHull(pixels)
        wanted = {frozenset(map(tuple, np.round(pixels[edge], 6))) for edge in hull.simplices}
        assert got == wanted
    pixels[faces[0, 0]] = np.nan
    assert np.isfinite(outline.segments(pixels)).all()
    assert not len(Outline(np.zeros((0, 3), int)).segments(np.zeros((0, 2)))), "no mesh, no outline"
    sheet = Outline(faces[:2]).segments(camera.project(vertices, 800, 600)[0])
    assert len(sheet) == 4, "the rim of an open sheet is outline, too"


def test_the_body_is_outlined_in_its_colour(video: VideoView) -> None:
    vertices, faces = box(1.0)
    pixels = Camera(target=(0, 0, 0), azimuth=0, elevation=0, distance=12).project(vertices, 200, 120)[0]
    before = picture(video)
    video.set_body(pixels, faces, (250, 9, 250))
    drawn = picture(video)
    (left, top), (right, _) = pixels.min(axis=0), pixels.max(axis=0)
    x, y = video.to_widget(np.array([[0.5 * (left + right), top]]))[0].round().astype(int)
    assert np.abs(drawn[y - 2 : y + 2, x] - [250, 9, 250]).max(axis=1).min() < 60
    assert np.array_equal(drawn[200, 250], before[200, 250]), "nothing is drawn inside"
    video.set_body(None, faces)
    assert np.array_equal(picture(video), before)
