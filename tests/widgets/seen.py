"""What the tests of the scene draw, and how they look at it."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from markerscope.widgets.images import to_rgb
from markerscope.widgets.scene import Scene3D

RED, GREEN, BLUE = (213, 94, 0), (0, 158, 115), (0, 114, 178)
SHIFT, CONTROL = Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier
THREE = np.array([[0.0, 0.0, 0.0], [0.0, 0.4, 0.3], [0.2, -0.5, -0.2]])
COLOURS = np.array([RED, GREEN, BLUE], dtype=np.uint8)


def box(size: float = 0.3, middle: tuple[float, float, float] = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """A cube's vertices (8, 3) and outward faces (12, 3)."""
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size + middle
    faces = np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ]
    )  # fmt: skip
    return vertices, faces


def picture(scene: Scene3D) -> np.ndarray:
    return to_rgb(scene.image()).astype(int)


def at(image: np.ndarray, pixel: np.ndarray) -> np.ndarray:
    """The mean colour of the 2 x 2 pixels about a place."""
    x, y = (round(float(v)) for v in pixel)
    return image[y - 1 : y + 1, x - 1 : x + 1].reshape(-1, 3).mean(axis=0)
