"""Between NumPy's pictures and Qt's."""

from __future__ import annotations

import os
import secrets
from contextlib import suppress
from pathlib import Path

import numpy as np
from PySide6.QtCore import QRect
from PySide6.QtGui import QImage, QPainter

from markerscope.widgets import theme


def of_rgba(picture: np.ndarray) -> QImage:
    """Qt's picture of (H, W, 4) uint8, the fourth ignored; shares memory and keeps it alive."""
    height, width = picture.shape[:2]
    return QImage(picture.data, width, height, 4 * width, QImage.Format.Format_RGBX8888)


def of_rgb(picture: np.ndarray) -> QImage:
    """Qt's picture of (H, W, 3) uint8, copied into the format that it draws fastest."""
    whole = np.ascontiguousarray(picture)
    height, width = whole.shape[:2]
    return QImage(whole.data, width, height, 3 * width, QImage.Format.Format_RGB888).convertToFormat(
        QImage.Format.Format_RGB32
    )


def to_rgb(picture: QImage) -> np.ndarray:
    """(H, W, 3) uint8 of Qt's picture, in its own pixels."""
    plain = picture.convertToFormat(QImage.Format.Format_RGBX8888)
    return np.frombuffer(plain.constBits(), np.uint8).reshape(plain.height(), plain.width(), 4)[..., :3].copy()


def draw_focus(painter: QPainter, area: QRect) -> None:
    """A line about a picture that has the keyboard."""
    colour = theme.qcolour(theme.colours().accent, 160)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    for side in (
        QRect(0, 0, area.width(), 1), QRect(0, area.height() - 1, area.width(), 1),
        QRect(0, 1, 1, area.height() - 2), QRect(area.width() - 1, 1, 1, area.height() - 2),
    ):  # fmt: skip
        painter.fillRect(side, colour)


def save(picture: QImage, path: str | Path) -> None:
    """Write a picture in the format of the path's suffix, whole or not at all."""
    path = Path(path)
    temporary = path.with_name(f".{path.stem[:40]}.{secrets.token_hex(4)}{path.suffix}")
    try:
        if not picture.save(str(temporary)):
            raise OSError(f"{path} cannot be written: choose a folder you may write to, and a name that ends in .png")
        os.replace(temporary, path)
    finally:
        with suppress(OSError):
            temporary.unlink()
