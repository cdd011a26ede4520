"""Reading off what a widget drew."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget


def pixels(widget: QWidget) -> np.ndarray:
    """(H, W, 3) uint8 of a widget as it is shown now."""
    image = widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
    data = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
    return data[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).copy()


def distance(picture: np.ndarray, rgb: object) -> np.ndarray:
    """Largest difference of any channel to a colour, per pixel."""
    return np.abs(picture.astype(int) - np.asarray(rgb, int)).max(axis=-1)


def shows(picture: np.ndarray, at: tuple[float, float], rgb: object, within: int = 4) -> bool:
    """Whether the pixel at (x, y) has a colour."""
    return bool(distance(picture[round(at[1]), round(at[0])], rgb) <= within)
