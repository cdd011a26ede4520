"""Above the rows: the whole recording with the visible part in it, and a ruler of that part."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QMouseEvent, QPainter, QPaintEvent, QPolygonF, QWheelEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.decimate import Counts, shown_frames
from markerscope.widgets.plots.ink import colour, em, image_of, pen
from markerscope.widgets.plots.rows import PresenceRow, Row
from markerscope.widgets.plots.scales import Scale, clock, time_ticks
from markerscope.widgets.plots.time_window import TimeWindow
from markerscope.widgets.theme import colours

_REACH = 6.0
"""px from an end within which it is grabbed."""


class TimelineHeader(QWidget):
    """Overview strip (drag the frame to pan, its ends to zoom) over a ruler (drag to seek, with Shift to mark a range).

    Signals
    -------
    seeked(time), range_marked(range) : as of :class:`Timelines`
    """

    seeked = Signal(float)
    range_marked = Signal(object)

    def __init__(self, window: TimeWindow, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Overview and ruler")
        self.setToolTip(
            "The whole recording: how many markers are seen. Drag the frame to move the visible part, "
            "its ends to zoom.\n"
            "Ruler below: drag to move the cursor, drag with Shift to mark the range to loop over, "
            "double-click to clear it."
        )
        self.setMouseTracking(True)
        self._time = window
        self._margins = (0.0, 0.0)
        self._seen: tuple[np.ndarray, Counts] | None = None
        self._grabbed = ""
        self._from = 0.0
        for signal in (window.viewed, window.ranged, window.moved):
            signal.connect(self.update)

    def set_rows(self, rows: Sequence[Row]) -> None:
        """Take the first row of markers for the overview."""
        row = next((row for row in rows if isinstance(row, PresenceRow)), None)
        self._seen = None
        if row is not None and row.present.size:
            share = row.present.mean(axis=1)
            # levels instead of the mean, so that the blocks of the long recording serve here, too
            self._seen = (row.time, Counts(share[:, None] > np.array([0.05, 0.5, 0.7, 0.85, 0.95, 0.999])))
        self.update()

    def set_margins(self, left: float, right: float) -> None:
        """Room beside the clock, px, that the rows below use for names and a scroll bar."""
        if (left, right) != self._margins:
            self._margins = (left, right)
            self.update()

    def sizeHint(self) -> QSize:
        """A strip and a line of numbers."""
        return QSize(600, round(2.9 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """As high as it wants to be."""
        return QSize(100, self.sizeHint().height())

    def whole(self) -> Scale:
        """Clock of the overview."""
        return Scale(*self._time.span, self._margins[0], self.width() - self._margins[1])

    def visible(self) -> Scale:
        """Clock of the ruler and the rows."""
        return Scale(*self._time.view, self._margins[0], self.width() - self._margins[1])

    def strip(self) -> QRectF:
        """Where the overview is."""
        x = self.whole()
        return QRectF(x.start, 4, max(x.end - x.start, 1), round(1.15 * em(self)))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw both."""
        painter = QPainter(self)
        look, strip, whole = colours(), self.strip(), self.whole()
        painter.setPen(pen(look.border))
        painter.setBrush(colour(look.base))
        painter.drawRect(strip)
        if self._seen is not None:
            width = max(1, round(strip.width() * self.devicePixelRatioF()))
            first, last, inside = shown_frames(self._seen[0], *self._time.span, width)
            seen = self._seen[1].share(first, last).mean(axis=1) * inside
            ground, ink = np.array(look.base, float), np.array(look.accent, float)
            picture = ground + (0.75 * seen)[:, None] * (ink - ground)
            painter.drawImage(strip.adjusted(1, 1, 0, 0), image_of(np.rint(picture).astype(np.uint8)[None]))
        if self._time.range is not None:
            a, b = (whole.at(t) for t in self._time.range)
            painter.fillRect(QRectF(a, strip.bottom() - 3, b - a, 3), colour(palette.SELECTED))
        a, b = (whole.at(t) for t in self._time.view)
        shade = colour(look.window, 190)
        painter.fillRect(QRectF(strip.left(), strip.top(), a - strip.left(), strip.height() + 1), shade)
        painter.fillRect(QRectF(b, strip.top(), strip.right() - b + 1, strip.height() + 1), shade)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(pen(look.text, 1.5))
        painter.drawRect(QRectF(a, strip.top(), b - a, strip.height()))
        cursor = whole.at(self._time.time)
        painter.setPen(pen(palette.SELECTED, 1.5))
        painter.drawLine(QPointF(cursor, strip.top()), QPointF(cursor, strip.bottom()))
        self._paint_ruler(painter)

    def _paint_ruler(self, painter: QPainter) -> None:
        look, metrics, x = colours(), QFontMetricsF(self.font()), self.visible()
        top, bottom = self.strip().bottom() + 3, float(self.height())
        if x.end <= x.start:
            return
        painter.setPen(colour(look.faint))
        clip = QRectF(0, top, self.width(), bottom - top)
        painter.drawText(QRectF(8, top, max(self._margins[0] - 8, 0), metrics.height()), 0, "Time")
        painter.setClipRect(clip)
        if self._time.range is not None:
            a, b = (x.at(t) for t in self._time.range)
            painter.fillRect(QRectF(a, top, b - a, bottom - top), colour(palette.SELECTED, 50))
            painter.setPen(pen(palette.SELECTED, 2))
            for edge in (a, b):
                painter.drawLine(QPointF(edge, top), QPointF(edge, bottom))
        width = metrics.horizontalAdvance("00:00.000 s")
        values, step = time_ticks(x.low, x.high, max(2, int((x.end - x.start) / (1.5 * width))))
        for value in values:
            at = x.at(value)
            painter.setPen(pen(look.faint))
            painter.drawLine(QPointF(at, bottom - 4), QPointF(at, bottom))
            left = min(max(at - width / 2, x.start - self._margins[0]), self.width() - width)
            painter.drawText(
                QRectF(left, top, width, metrics.height()), int(Qt.AlignmentFlag.AlignHCenter), clock(value, step)
            )
        cursor, half = x.at(self._time.time), 0.35 * metrics.height()
        if x.start - 1 <= cursor <= x.end + 1:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(colour(palette.SELECTED))
            corners = [QPointF(cursor - half, bottom - half), QPointF(cursor + half, bottom - half)]
            painter.drawPolygon(QPolygonF([*corners, QPointF(cursor, bottom)]))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab what lies below the pointer."""
        if event.button() != Qt.MouseButton.LeftButton:
            return
        at = event.position()
        self._grabbed = self._below(at, bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier))
        self._from = self.whole().value(at.x()) if self._grabbed == "frame" else self.visible().value(at.x())
        if self._grabbed == "frame" and not self._time.view[0] <= self._from <= self._time.view[1]:
            width = self._time.view[1] - self._time.view[0]
            self._time.set_view(self._from - width / 2, self._from + width / 2)
        self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag it, or show what could be dragged."""
        x = event.position().x()
        whole, visible, window = self.whole().value(x), self.visible().value(x), self._time
        if not self._grabbed:
            below = self._below(event.position(), False)
            ends = below in ("view start", "view end", "range start", "range end")
            self.setCursor(Qt.CursorShape.SizeHorCursor if ends else Qt.CursorShape.ArrowCursor)
        elif self._grabbed == "frame":
            window.pan(whole - self._from)
            self._from = whole
        elif self._grabbed == "view start":
            window.set_view(min(whole, window.view[1] - 0.05), window.view[1])
        elif self._grabbed == "view end":
            window.set_view(window.view[0], max(whole, window.view[0] + 0.05))
        elif self._grabbed == "mark":
            if abs(self.visible().at(self._from) - x) > 2:
                self.range_marked.emit((self._from, visible))
        elif self._grabbed == "range start" and window.range is not None:
            self.range_marked.emit((min(visible, window.range[1] - 1e-3), window.range[1]))
        elif self._grabbed == "range end" and window.range is not None:
            self.range_marked.emit((window.range[0], max(visible, window.range[0] + 1e-3)))
        elif self._grabbed == "seek":
            self.seeked.emit(min(max(visible, window.span[0]), window.span[1]))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go."""
        self._grabbed = ""

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """On the overview: show all. On the ruler: clear the range."""
        if event.position().y() <= self.strip().bottom() + 2:
            self._time.set_view(*self._time.span)
        else:
            self.range_marked.emit(None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom about the pointer."""
        self._time.zoom(1.2 ** (event.angleDelta().y() / 120), self.visible().value(event.position().x()))
        event.accept()

    def _below(self, at: QPointF, mark: bool) -> str:
        x, y = at.x(), at.y()
        if y <= self.strip().bottom() + 2:
            scale, names = self.whole(), ("view start", "view end")
            ends: tuple[float, ...] = self._time.view
            if self._time.view == self._time.span and not any(abs(scale.at(t) - x) <= _REACH for t in ends):
                return "frame"
            other = "frame"
        else:
            scale, names = self.visible(), ("range start", "range end")
            ends = self._time.range or ()
            other = "mark" if mark else "seek"
        near = [name for name, t in zip(names, ends) if abs(scale.at(t) - x) <= _REACH]
        return near[0] if near and not mark else other
