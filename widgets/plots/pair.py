"""The distance of two markers over time."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.curve_paint import frame_at
from markerscope.widgets.plots.decimate import envelope
from markerscope.widgets.plots.ink import colour, elided, em, pen, polyline, y_axis
from markerscope.widgets.plots.scales import Scale, clock, limits, number, time_ticks
from markerscope.widgets.theme import colours


class PairPlot(QWidget):
    """One curve in mm with its mean and standard deviation, and the cursor; a drag seeks.

    Signals
    -------
    seeked(time) : s
    """

    seeked = Signal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Distance of a pair of markers")
        self._names = ("", "")
        self._time, self._distance = np.zeros(0), np.zeros(0)
        self._cursor = 0.0

    def set_pair(self, first: str, second: str, time: np.ndarray, distance: np.ndarray) -> None:
        """Show the distance (T,) m of two markers at times (T,) s; NaN where one is lost."""
        self._names = (first, second)
        self._time, self._distance = np.asarray(time, float), np.asarray(distance, float) * 1e3
        self.setAccessibleDescription(self.sentence())
        self.update()

    def set_time(self, time: float) -> None:
        """Move the cursor to a moment, s."""
        if time != self._cursor:
            self._cursor = time
            self.update()

    def sentence(self) -> str:
        """The pair's figures, in words."""
        finite = self._distance[np.isfinite(self._distance)]
        if not len(finite):
            return f"{self._names[0]} and {self._names[1]} were never seen together" if self._names[0] else ""
        return (
            f"{self._names[0]} – {self._names[1]}: {number(float(finite.mean()), 0.1)} mm, "
            f"SD {number(float(finite.std()), 0.1)} mm"
        )

    def sizeHint(self) -> QSize:
        """A low plot."""
        return QSize(500, round(9 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """Six lines of text."""
        return QSize(200, round(6 * em(self)))

    def area(self) -> QRectF:
        """Where the curve is drawn."""
        metrics = QFontMetricsF(self.font())
        left, line = metrics.horizontalAdvance("0000.0 mm") + 10, metrics.height()
        return QRectF(left, line + 5, max(self.width() - left - 10, 1), max(self.height() - 2 * line - 12, 1))

    def scales(self) -> tuple[Scale, Scale]:
        """Time (s) and distance (mm) to pixels."""
        area = self.area()
        ends = (float(self._time[0]), float(self._time[-1])) if len(self._time) > 1 else (0.0, 1.0)
        return Scale(*ends, area.left(), area.right()), Scale(*limits([self._distance]), area.bottom(), area.top())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        painter, look, area = QPainter(self), colours(), self.area()
        line = QFontMetricsF(self.font()).height()
        text = self.sentence() or "Click on a cell of the matrix to see a pair's distance over time."
        painter.setPen(colour(look.text if self.sentence() else look.faint))
        elided(painter, QRectF(8, 2, self.width() - 16, line), text)
        finite = self._distance[np.isfinite(self._distance)]
        if not len(finite):
            return
        x, y = self.scales()
        painter.fillRect(area, colour(look.base))
        y_axis(painter, area, y, "mm", 1.6 * line)
        painter.setClipRect(area)
        mean, spread = float(finite.mean()), float(finite.std())
        band = QRectF(area.left(), y.at(mean + spread), area.width(), y.at(mean - spread) - y.at(mean + spread))
        painter.fillRect(band, colour(look.accent, 45))
        painter.setPen(pen(look.accent, 1.2, dashed=True))
        painter.drawLine(QPointF(area.left(), y.at(mean)), QPointF(area.right(), y.at(mean)))
        at, values = envelope(self._time, self._distance, x.low, x.high, max(1, round(area.width())))
        painter.setPen(pen(look.text, 1.4))
        polyline(painter, x.pixel(at), y.pixel(values))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(pen(palette.SELECTED, 1.5))
        cursor = x.at(self._cursor)
        painter.drawLine(QPointF(cursor, area.top()), QPointF(cursor, area.bottom()))
        painter.setClipping(False)
        width = QFontMetricsF(self.font()).horizontalAdvance("00:00.00 s")
        moments, step = time_ticks(x.low, x.high, max(2, int(area.width() / (1.6 * width))))
        painter.setPen(colour(look.faint))
        for moment in moments:
            left = min(max(x.at(moment) - width / 2, 0), self.width() - width)
            painter.drawText(
                QRectF(left, area.bottom() + 2, width, line), int(Qt.AlignmentFlag.AlignHCenter), clock(moment, step)
            )
        value = self._distance[frame_at(self._time, self._cursor)] if len(self._time) else np.nan
        if np.isfinite(value):
            shown = f"{number(float(value), 0.1)} mm"
            width = QFontMetricsF(self.font()).horizontalAdvance(shown) + 8
            left = cursor + 4 if cursor + 4 + width < area.right() else cursor - 4 - width
            box = QRectF(left, area.top() + 2, width, line)
            painter.fillRect(box, colour(look.base, 225))
            painter.setPen(colour(look.text))
            painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), shown)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek."""
        self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Seek on."""
        if event.buttons() & Qt.MouseButton.LeftButton and len(self._time):
            x = self.scales()[0]
            self.seeked.emit(min(max(x.value(event.position().x()), x.low), x.high))
