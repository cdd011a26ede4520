"""What the user does to the scene, and what comes out of it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QImage, QKeyEvent
from PySide6.QtWidgets import QApplication

from markerscope.widgets.images import to_rgb
from markerscope.widgets.scene import Scene3D
from tests.widgets.seen import COLOURS, CONTROL, SHIFT, THREE, box, picture


def test_clicks_boxes_and_hovering_say_which_marker(scene: Scene3D, mouse: Callable[..., None]) -> None:
    scene.set_markers(THREE, COLOURS)
    heard: list[tuple] = []
    scene.marker_clicked.connect(lambda i, held: heard.append(("marker", i, held)))
    scene.markers_boxed.connect(lambda found, held: heard.append(("box", tuple(found), held)))
    scene.background_clicked.connect(lambda held: heard.append(("background",)))
    scene.hovered.connect(lambda i: heard.append(("hover", i)))
    scene.camera_changed.connect(lambda: heard.append(("camera",)))
    pixels = scene.project(THREE)
    for i, held in ((0, Qt.KeyboardModifier.NoModifier), (1, CONTROL), (2, SHIFT)):
        mouse(scene, "press", pixels[i] + 2, held=held)
        mouse(scene, "release", pixels[i] + 2, held=held)
        assert heard.pop() == ("marker", i, held)
    mouse(scene, "press", (5, 5))
    mouse(scene, "release", (5, 5))
    assert heard == [("background",)]
    heard.clear()
    mouse(scene, "move", pixels[1], Qt.MouseButton.NoButton)
    mouse(scene, "move", (5, 5), Qt.MouseButton.NoButton)
    assert heard == [("hover", 1), ("hover", -1)]
    heard.clear()
    two = np.minimum(pixels[0], pixels[2]) - 8, np.maximum(pixels[0], pixels[2]) + 8
    mouse(scene, "press", two[0], held=SHIFT)
    mouse(scene, "move", two[0] + 10, held=SHIFT)
    mouse(scene, "move", two[1], held=SHIFT)
    plain = picture(scene)
    band = to_rgb(scene.grab().toImage()).astype(int)
    inside = (np.round((pixels[0] + pixels[2]) / 2)).astype(int)
    assert np.abs(band[inside[1], inside[0]] - plain[inside[1], inside[0]]).max() > 5, "the box being drawn is seen"
    mouse(scene, "release", two[1], held=SHIFT)
    assert heard == [("box", (0, 2), SHIFT)]
    heard.clear()
    scene.set_tool("select")
    mouse(scene, "press", (1, 1))
    mouse(scene, "move", (479, 359))
    mouse(scene, "release", (479, 359))
    assert heard == [("box", (0, 1, 2), Qt.KeyboardModifier.NoModifier)]
    heard.clear()
    scene.show_layer("markers", False)
    mouse(scene, "press", pixels[0])
    mouse(scene, "release", pixels[0])
    assert heard == [("background",)], "what is hidden is not picked"
    with pytest.raises(ValueError, match="lasso"):
        scene.set_tool("lasso")


def test_mouse_and_keys_move_the_camera(scene: Scene3D, mouse: Callable[..., None], wheel: Callable[..., None]) -> None:
    scene.set_markers(THREE, COLOURS)
    before = scene.camera
    mouse(scene, "press", (100, 100))
    mouse(scene, "move", (160, 100))
    mouse(scene, "release", (160, 100))
    assert scene.camera.azimuth < before.azimuth and scene.camera.distance == before.distance
    pixels = scene.project(THREE[:1])[0]
    mouse(scene, "press", (100, 100), Qt.MouseButton.RightButton)
    mouse(scene, "move", (130, 120), Qt.MouseButton.RightButton)
    mouse(scene, "release", (130, 120), Qt.MouseButton.RightButton)
    assert np.allclose(scene.project(THREE[:1])[0], pixels + np.array([30, 20]), atol=0.5)
    wheel(scene, (300.0, 200.0), 240)
    assert scene.camera.distance < before.distance

    def key(code: Qt.Key, held: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> bool:
        event = QKeyEvent(QEvent.Type.KeyPress, code, held)
        event.setAccepted(True)
        QApplication.sendEvent(scene, event)
        return event.isAccepted()

    assert not key(Qt.Key.Key_1), "plain digits are the window's"
    assert key(Qt.Key.Key_1, CONTROL) and scene.camera.elevation == 0 and scene.camera.azimuth == pytest.approx(0)
    assert key(Qt.Key.Key_Up, CONTROL) and scene.camera.elevation == pytest.approx(np.radians(5))
    assert key(Qt.Key.Key_Minus) and key(Qt.Key.Key_0)
    far = np.abs(scene.project(THREE) / [480, 360] - 0.5).max()
    assert 0.40 < far < 0.5
    assert not key(Qt.Key.Key_Left) and not key(Qt.Key.Key_Space), "the window's own keys are left to it"


def test_the_camera_comes_back_exactly(scene: Scene3D) -> None:
    scene.set_markers(THREE, COLOURS)
    scene.set_floor(-0.3)
    scene.orbit(0.3, 0.1)
    scene.pan(12, 30)
    scene.zoom(1.3, (100, 80))
    scene.set_follow(True)
    scene.set_facing((0, 1))
    state, before = scene.camera_state(), picture(scene)
    scene.view_from("top")
    scene.set_follow(False)
    assert not np.array_equal(picture(scene), before)
    scene.restore_camera(state)
    assert scene.camera_state() == state and np.array_equal(picture(scene), before)
    scene.restore_camera({"target": "rubbish", "facing": "north"})
    picture(scene)


def test_the_camera_follows_a_point_and_loses_it_without_a_jump(scene: Scene3D) -> None:
    walker = np.array([0.0, 0.0, 0.0])
    scene.follow_point(walker)
    scene.set_follow(True)
    before = scene.project(walker[None])[0]
    for step in ([0.1, 0.2, 0.0], [np.nan] * 3, [0.4, 0.3, 0.1]):
        scene.follow_point(np.array(step))
    assert np.allclose(scene.project(np.array([[0.4, 0.3, 0.1]]))[0], before, atol=1e-6)
    scene.set_follow(False)
    scene.follow_point(np.array([5.0, 5.0, 0.0]))
    assert np.allclose(scene.project(np.array([[0.4, 0.3, 0.1]]))[0], before, atol=1e-6)


def test_a_file_holds_the_picture(scene: Scene3D, tmp_path: Path) -> None:
    scene.set_markers(THREE, COLOURS)
    scene.set_floor(-0.3)
    scene.save_png(tmp_path / "a.png")
    assert np.array_equal(to_rgb(QImage(str(tmp_path / "a.png"))), to_rgb(scene.image()))
    scene.save_png(tmp_path / "b.png", scale=2.0)
    assert to_rgb(QImage(str(tmp_path / "b.png"))).shape == (720, 960, 3)
    with pytest.raises(OSError, match="cannot be written"):
        scene.save_png(tmp_path / "nowhere" / "a.png")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.png", "b.png"]


def test_the_screen_comes_to_show_what_the_picture_shows(scene: Scene3D, qapp: QApplication) -> None:
    scene.clearFocus()
    scene.set_mesh("body", *box(), (200, 180, 170), 1.0)
    rough = to_rgb(scene.grab().toImage()).astype(int)
    waited = 0
    while not scene.settled and waited < 500:
        qapp.processEvents()
        scene._rest.setInterval(0) if scene._rest.isActive() else None
        waited += 1
    fine = to_rgb(scene.grab().toImage()).astype(int)
    assert np.array_equal(fine, picture(scene))
    assert np.abs(fine - rough).max() > 20, "edges are smoothed once all is at rest"


def test_a_turntable_goes_round_once_and_leaves_the_camera(scene: Scene3D) -> None:
    scene.set_markers(THREE + np.array([0.2, 0, 0]), COLOURS)
    before, state = picture(scene), scene.camera_state()
    frames = list(scene.turntable(4))
    assert [frame.shape for frame in frames] == [(360, 480, 3)] * 4
    assert np.array_equal(frames[0], before)
    assert all(np.abs(frames[k].astype(int) - frames[k - 1]).max() > 50 for k in range(4))
    assert scene.camera_state() == state
    for k, _ in enumerate(scene.turntable(4, size=(320, 200))):
        if k == 1:
            break  # whoever stops early finds the camera where it was, too
    assert scene.camera_state() == state and np.array_equal(picture(scene), before)


def test_without_opengl_it_says_what_to_install(tmp_path: Path) -> None:
    code = (
        "from PySide6.QtWidgets import QApplication; import numpy as np; app = QApplication([])\n"
        "from markerscope.widgets.scene import Scene3D; s = Scene3D(); s.resize(400, 300)\n"
        "s.set_markers(np.zeros((3, 3)), np.zeros((3, 3), np.uint8)); s.set_floor(0); s.view_from('fit'); s.show()\n"
        "app.processEvents(); s.save_png('a.png'); print(s.problem); s.orbit(1, 0); app.processEvents()"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")}
    environment |= {
        "QT_QPA_PLATFORM": "offscreen",
        "LIBGL_DRIVERS_PATH": str(tmp_path),
        "PYTHONPATH": os.environ["PYTHONPATH"],
    }
    environment |= {"GBM_BACKENDS_PATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    if "None" in run.stdout:
        pytest.skip("this machine's OpenGL does not look for its drivers where it is told to")
    assert "apt-get install libegl1" in run.stdout
    assert len(np.unique(to_rgb(QImage(str(tmp_path / "a.png"))).reshape(-1, 3), axis=0)) > 3, "the sentence is painted"


def test_no_reference_to_none_is_lost(scene: Scene3D, qapp: QApplication) -> None:
    """PySide6 6.12 on Python 3.11 dropped one at every void call, until the process ended."""
    scene.set_floor(0.0)
    vertices, faces = box()
    counts = []
    for _ in range(2):
        for k in range(150):
            scene.set_markers(THREE + 0.001 * k, COLOURS)
            scene.set_mesh("body", vertices + 0.001 * k, faces, (200, 180, 160), 0.5)
            scene.setToolTip(str(k))
            scene.update()
            qapp.processEvents()
        counts.append(sys.getrefcount(None))
    assert abs(counts[1] - counts[0]) < 75, f"{counts[1] - counts[0]} references to None in 150 frames"


def test_scenes_that_were_closed_harm_none_that_follow(tmp_path: Path) -> None:
    """A marker mapper that VTK frees takes the buffers of the scene that draws, and the process ends: so in a child."""
    root = Path(__file__).parents[2]
    names = ["scene_clusters", "scene_ghosts", "scene_residuals"]
    command = [
        sys.executable,
        "-m",
        "markerscope.widgets.gallery.__main__",
        "--shots",
        str(tmp_path),
        "--theme",
        "dark",
        *names,
    ]
    run = subprocess.run(command, cwd=root, env={**os.environ}, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    for name in names:
        drawn = to_rgb(QImage(str(tmp_path / f"{name}_dark_1x.png")))
        assert drawn.shape == (700, 900, 3) and len(np.unique(drawn.reshape(-1, 3), axis=0)) > 1000
