"""What Qt paints over a picture of the scene: words, rings, axes. Sharp at any scale, and no cost to the scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPainterPath, QPen, QPixmap

from markerscope.widgets import palette
from markerscope.widgets.scene.camera import Camera
from markerscope.widgets.theme import Colours, qcolour

_KEPT_WORDS = 800


class Words:
    """Short texts with an outline, each painted once and kept as a small picture."""

    def __init__(self) -> None:
        self._kept: dict[tuple[object, ...], QPixmap] = {}
        self._sizes: dict[tuple[str, str], tuple[float, float]] = {}

    def size(self, text: str, font: QFont) -> tuple[float, float]:
        """Width and height of a text with its outline."""
        key = (text, font.key())
        if key not in self._sizes:
            if len(self._sizes) >= _KEPT_WORDS:
                self._sizes.clear()
            metrics = QFontMetricsF(font)
            self._sizes[key] = metrics.horizontalAdvance(text) + 4.0, metrics.height() + 2.0
        return self._sizes[key]

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

    def __init__(self) -> None:
        self._boxes = np.zeros((64, 4))  # left, top, right, bottom
        self._count = 0

    def hold(self, boxes: np.ndarray) -> None:
        """Take boxes (N, 4), left, top, right and bottom, whether or not parts of them are taken."""
        while self._count + len(boxes) > len(self._boxes):
            self._boxes = np.concatenate([self._boxes, np.zeros_like(self._boxes)])
        self._boxes[self._count : self._count + len(boxes)] = boxes
        self._count += len(boxes)

    def take(self, boxes: np.ndarray) -> int:
        """Take the first of boxes (N, 4) of which no part is taken, and return which; -1 where there is none."""
        held = self._boxes[: self._count]
        low, high = boxes[:, None, :2] < held[None, :, 2:], boxes[:, None, 2:] > held[None, :, :2]
        free = np.flatnonzero(~np.any((low & high).all(axis=2), axis=1))
        if not len(free):
            return -1
        first = int(free[0])
        self.hold(boxes[first : first + 1])
        return first


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
    font = painter.font()
    for (x, y), text in zip(pixels.tolist(), texts):
        if x != x or not text:
            continue
        width, height = words.size(text, font)
        near, far = 0.7 * reach, 0.4 * reach
        left, right, above, below = x - reach - width, x + reach, y - reach - height, y + reach
        corners = np.array(
            [
                (right, y - 0.5 * height), (left, y - 0.5 * height), (x - 0.5 * width, above), (x - 0.5 * width, below),
                (x + near, above + 0.3 * height), (x + near, y + far),
                (x - near - width, above + 0.3 * height), (x - near - width, y + far),
            ]
        )  # fmt: skip
        found = places.take(np.concatenate([corners + 2, corners + np.array([width - 2, height - 2])], axis=1))
        if found >= 0:
            words.draw(painter, QPointF(*corners[found].tolist()), text, ink, outline)


def draw_ticks(
    painter: QPainter, words: Words, places: Places, pixels: np.ndarray, texts: Sequence[str], look: Colours
) -> None:
    """Write the floor's numbers centred on pixels (N, 2), leaving out those without room."""
    font = painter.font()
    for (x, y), text in zip(pixels.tolist(), texts):
        if x != x:
            continue
        width, height = words.size(text, font)
        left, top = x - 0.5 * width, y - 0.5 * height
        if places.take(np.array([[left, top, left + width, top + height]])) >= 0:
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
