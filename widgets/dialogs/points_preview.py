"""One frame of a marker file from the front and from the side, with a measure."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets.plots.ink import colour, em, pen
from markerscope.widgets.plots.scales import nice_step, number
from markerscope.widgets.theme import colours


class PointsPreview(QWidget):
    """Points left out are hollow; the floor is where z is 0, if that is near."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Points of one frame")
        self.setToolTip("One frame from two sides. A person should stand upright, and be as tall as one.")
        self._points = np.zeros((0, 3))
        self._out: frozenset[int] = frozenset()

    def set_points(self, points: np.ndarray, left_out: Iterable[int] = ()) -> None:
        """Show points (M, 3) m, z up, NaN = lost."""
        self._points, self._out = np.asarray(points, float), frozenset(left_out)
        self.setAccessibleDescription(f"{int(np.isfinite(self._points).all(axis=1).sum())} points")
        self.update()

    def sizeHint(self) -> QSize:
        """Two figures beside each other."""
        return QSize(round(22 * em(self)), round(18 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """Small figures."""
        return QSize(round(14 * em(self)), round(11 * em(self)))

    def scale(self) -> float:
        """Pixels a metre, the same for both figures."""
        seen = self._points[np.isfinite(self._points).all(axis=1)]
        if not len(seen):
            return 1.0
        size = np.maximum(np.ptp(seen, axis=0), 1e-6)
        line = em(self)
        return float(
            min((self.width() / 2 - 30) / max(size[0], size[1]), (self.height() - 3.2 * line) / max(size[2], 1e-6))
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw both, and how much a metre is."""
        painter, look = QPainter(self), colours()
        painter.fillRect(self.rect(), colour(look.base))
        painter.setPen(pen(look.border))
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        line = QFontMetricsF(self.font()).height()
        shown = np.flatnonzero(np.isfinite(self._points).all(axis=1))
        if not len(shown):
            painter.setPen(colour(look.faint))
            painter.drawText(self.rect(), int(Qt.AlignmentFlag.AlignCenter), "no points")
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        seen, scale = self._points[shown], self.scale()
        low, high = seen.min(axis=0), seen.max(axis=0)
        bottom = self.height() - 1.6 * line
        if abs(low[2]) < 0.3 * max(high[2] - low[2], 0.1):
            floor = bottom + low[2] * scale
            painter.setPen(pen(look.border, 1.5))
            painter.drawLine(QPointF(8, floor), QPointF(self.width() - 8, floor))
        for axis, name, middle in ((0, "x and z", self.width() / 4), (1, "y and z", 3 * self.width() / 4)):
            painter.setPen(colour(look.faint))
            painter.drawText(
                QRectF(middle - self.width() / 4, 3, self.width() / 2, line), int(Qt.AlignmentFlag.AlignHCenter), name
            )
            for k, point in zip(shown, seen):
                x = middle + (point[axis] - 0.5 * (low[axis] + high[axis])) * scale
                out = int(k) in self._out
                painter.setPen(pen(look.faint if out else look.accent, 1.2))
                painter.setBrush(Qt.BrushStyle.NoBrush if out else colour(look.accent))
                painter.drawEllipse(QPointF(x, bottom - (point[2] - low[2]) * scale), 2.6, 2.6)
        self._paint_measure(painter, scale, line, float(high[2] - low[2]))

    def _paint_measure(self, painter: QPainter, scale: float, line: float, tall: float) -> None:
        look = colours()
        length = nice_step(0.12 * self.width() / scale)
        y, right = self.height() - 0.35 * line, self.width() - 10.0
        painter.setPen(pen(look.text, 1.5))
        painter.drawLine(QPointF(right - length * scale, y), QPointF(right, y))
        painter.setPen(colour(look.text))
        box = QRectF(0, self.height() - 1.35 * line, right - length * scale - 6, 1.2 * line)
        unit, factor = ("m", 1.0) if length >= 0.1 else ("mm", 1e3)
        painter.drawText(
            box, int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter), f"{number(length * factor)} {unit}"
        )
        painter.drawText(
            box.adjusted(8, 0, 0, 0), int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter),
            f"{number(tall, 0.01)} m tall",
        )  # fmt: skip
