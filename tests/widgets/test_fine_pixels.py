"""On a screen with fine pixels, everything is drawn where it belongs, and finer."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPT = """
import sys, time
import numpy as np
from PySide6.QtWidgets import QApplication
from markerscope.widgets import theme
from markerscope.widgets.images import to_rgb
from markerscope.widgets.scene import Scene3D

app = QApplication([])
theme.apply(app, "light", 1.0)
scene = Scene3D()
scene.resize(400, 300)
points = np.array([[0.6, 0.0, 0.4], [-0.5, 0.3, 1.2]])
colours = np.array([[255, 0, 0], [0, 0, 255]], np.uint8)
scene.set_markers(points, colours)
scene.show()
scene.view_from("front")
scene.frame(np.array([[-1.0, -1, 0], [1, 1, 2]]))
for wait in (0.0, 2.0):  # as it is drawn at once, and once it is at rest
    end = time.monotonic() + wait
    app.processEvents()
    while time.monotonic() < end:
        app.processEvents()
    seen = to_rgb(scene.grab().toImage()).astype(int)
    assert seen.shape[:2] == (600, 800), seen.shape
    for point, colour in zip(points, colours.astype(int)):
        other = seen[..., (colour == 0)].max(axis=-1)
        rows, columns = np.nonzero((seen[..., colour > 0][..., 0] > 120) & (other < 60))
        assert len(rows) > 20, (wait, colour, len(rows))
        expected = 2 * scene.project(point[None])[0]
        off = np.hypot(columns.mean() - expected[0], rows.mean() - expected[1])
        assert off < 6, (wait, colour, off, expected)
print("drawn", scene.devicePixelRatioF())
"""


def test_the_scene_with_two_pixels_a_point() -> None:
    environment = os.environ | {"QT_SCALE_FACTOR": "2", "PYTHONPATH": os.environ["PYTHONPATH"]}
    environment |= {"QT_QPA_PLATFORM": "offscreen", "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
    words = [sys.executable, "-c", SCRIPT]
    run = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=120)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == ["drawn", "2.0"]
