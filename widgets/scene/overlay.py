"""What Qt paints over a picture of the scene: words, rings, axes. Sharp at any scale, and no cost to the scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPainterPath, QPen, QPixmap

from widgets import palette
from widgets.scene.camera import Camera
from widgets.theme import Colours, qcolour

_KEPT_WORDS = 800


class Words:
    """Short texts with an outline, each painted once and kept as a small picture."""

    def __init__(self) -> None:
        self._kept: dict[tuple[object, ...], QPixmap] = {}

    def size(self, text: str, font: QFont) -> tuple[float, float]:
        """Width and height of a text with its outline."""
        metrics = QFontMetricsF(font)
        return metrics.horizontalAdvance(text) + 4.0, metrics.height() + 2.0

    def draw(self, painter: QPainter, at: QPointF, text: str, ink: QColor, outline: QColor) -> None:
        """Paint a text with its upper left corner at ``at``, in the painter's font."""
        ratio = painter.device().devicePixelRatioF()
        key = (text, painter.font().key(), ink.rgba(), outline.rgba(), ratio)
        picture = self._kept.get(key)
        if picture is None:
            if len(self._kept) >= _KEPT_WORDS:
                self._kept.clear()
            picture = self._kept[key] = self._paint(text, painter.font(), ink, outline, ratio)
        painter.drawPixmap(at, picture)

    def _paint(self, text: str, font: QFont, ink: QColor, outline: QColor, ratio: float) -> QPixmap:
        width, height = self.size(text, font)
        picture = QPixmap(int(np.ceil(width * ratio)), int(np.ceil(height * ratio)))
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        path = QPainterPath()
        path.addText(QPointF(2.0, 1.0 + QFontMetricsF(font).ascent()), font, text)
        painter.strokePath(
            path, QPen(outline, 3.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap, Qt.PenJoinStyle.RoundJoin)
        )
        painter.setFont(font)  # filled by the font's own hinting, which is sharper than the path
        painter.setPen(ink)
        painter.drawText(QPointF(2.0, 1.0 + QFontMetricsF(font).ascent()), text)
        painter.end()
        return picture


class Places:
    """Which parts of the picture are taken by words already."""

    def __init__(self, taken: Sequence[QRectF] = ()) -> None:
        self._boxes = np.array([(r.left(), r.top(), r.right(), r.bottom()) for r in taken], dtype=float).reshape(-1, 4)

    def hold(self, left: float, top: float, width: float, height: float) -> None:
        """Take a box whether or not a part of it is taken."""
        self._boxes = np.concatenate([self._boxes, [[left, top, left + width, top + height]]])

    def take(self, left: float, top: float, width: float, height: float) -> bool:
        """Take a box unless a part of it is taken."""
        box = np.array([left, top, left + width, top + height])
        held = self._boxes
        if ((box[0] < held[:, 2]) & (box[2] > held[:, 0]) & (box[1] < held[:, 3]) & (box[3] > held[:, 1])).any():
            return False
        self._boxes = np.concatenate([held, box[None]])
        return True


def draw_labels(
    painter: QPainter,
    words: Words,
    places: Places,
    pixels: np.ndarray,
    texts: Sequence[str],
    ink: QColor,
    outline: QColor,
    reach: float,
) -> None:
    """Write each text beside its point of pixels (N, 2), NaN left out; one that finds no free place is not written."""
    for (x, y), text in zip(pixels, texts):
        if np.isnan(x) or not text:
            continue
        width, height = words.size(text, painter.font())
        for left, top in (
            (x + reach, y - 0.5 * height), (x - reach - width, y - 0.5 * height),
            (x - 0.5 * width, y - reach - height), (x - 0.5 * width, y + reach),
            (x + 0.7 * reach, y - reach - 0.7 * height), (x + 0.7 * reach, y + 0.4 * reach),
            (x - 0.7 * reach - width, y - reach - 0.7 * height), (x - 0.7 * reach - width, y + 0.4 * reach),
        ):  # fmt: skip
            if places.take(left + 2, top + 2, width - 4, height - 4):
                words.draw(painter, QPointF(left, top), text, ink, outline)
                break


def draw_ticks(
    painter: QPainter, words: Words, places: Places, pixels: np.ndarray, texts: Sequence[str], look: Colours
) -> None:
    """Write the floor's numbers centred on pixels (N, 2), leaving out those without room."""
    for (x, y), text in zip(pixels, texts):
        if np.isnan(x):
            continue
        width, height = words.size(text, painter.font())
        left, top = x - 0.5 * width, y - 0.5 * height
        if places.take(left, top, width, height):
            words.draw(painter, QPointF(left, top), text, qcolour(look.faint), qcolour(look.outline, 140))


def draw_rings(painter: QPainter, pixels: np.ndarray, radius: float, rgb: tuple[int, int, int], look: Colours) -> None:
    """A ring about each of pixels (N, 2), NaN left out."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for width, colour in ((4.0, qcolour(look.outline, 200)), (2.0, qcolour(rgb))):
        painter.setPen(QPen(colour, width))
        for x, y in pixels:
            if not np.isnan(x):
                painter.drawEllipse(QPointF(x, y), radius, radius)


def draw_axes(painter: QPainter, words: Words, camera: Camera, corner: QPointF, look: Colours) -> None:
    """The lab's axes about ``corner``, the farthest first."""
    right, up, back = camera.basis()
    colours = (palette.categorical(6)[5], palette.categorical(3)[2], palette.categorical(1)[0])
    reach = 26.0
    for axis in np.argsort(back):
        tip = QPointF(corner.x() + reach * right[axis], corner.y() - reach * up[axis])
        r, g, b = (int(part) for part in colours[axis])
        painter.setPen(QPen(qcolour((r, g, b)), 2.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        painter.drawLine(corner, tip)
        if np.hypot(right[axis], up[axis]) < 0.3:
            continue  # it points at who looks, and its letter would stand on the others
        text = "xyz"[axis]
        width, height = words.size(text, painter.font())
        beyond = QPointF(corner.x() + (reach + 9) * right[axis], corner.y() - (reach + 9) * up[axis])
        at = QPointF(beyond.x() - 0.5 * width, beyond.y() - 0.5 * height)
        words.draw(painter, at, text, qcolour(look.text), qcolour(look.outline, 180))


def draw_band(painter: QPainter, a: tuple[float, float], b: tuple[float, float], look: Colours) -> None:
    """The box being drawn about markers."""
    painter.setPen(QPen(qcolour(look.accent), 1.0, Qt.PenStyle.DashLine))
    painter.setBrush(qcolour(look.accent, 40))
    painter.drawRect(QRectF(QPointF(*a), QPointF(*b)).normalized())
