"""Curves of markers below each other on one clock: painted once, with cursor and range laid over."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QFontMetricsF,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QToolTip, QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.decimate import envelope
from markerscope.widgets.plots.ink import colour, elided, em, faded, legible, pen, polyline, y_axis
from markerscope.widgets.plots.marker_curve_data import CurvePicture, CurvePlot, Line, Shade
from markerscope.widgets.plots.scales import Scale, clock, limits, number, time_ticks
from markerscope.widgets.plots.time_window import TimeWindow
from markerscope.widgets.theme import colours

_CLICK_PX = 4.0
_LEAST_EM, _GAP_EM = 4.6, 1.25
_READ = 3
"""Markers whose values are written beside the title of a plot."""
_TINT = {"gap": 46, "filled": 26, "outlier": 70}


def pen_of(line: Line) -> QPen:
    """How a line is drawn: by its kind, in its marker's colour."""
    ink = legible(line.colour)
    if line.kind == "raw":
        return pen(faded(ink), 1.0)
    if line.kind == "filled":
        made = pen(ink, 2.6, dashed=True)
        made.setDashPattern([1.0, 1.4])
        return made
    if line.kind == "body":
        return pen(ink, 1.2, dashed=True)
    if line.kind == "preview":
        chosen = legible(palette.SELECTED)
        made = pen(chosen, 2.2, dashed=True) if line.strong else pen(faded(chosen), 1.2, dashed=True)
        made.setDashPattern([5.0, 2.0, 1.0, 2.0])
        return made
    return pen(ink, 1.6)


class MarkerCurvePlots(QWidget):
    """The plots; see :class:`MarkerCurvesView` for what the user can do.

    Signals
    -------
    seeked(time) : s
    range_marked(range) : (start, end) in s
    menu_wanted(place) : on the screen
    """

    seeked = Signal(float)
    range_marked = Signal(object)
    menu_wanted = Signal(QPoint)

    def __init__(self, window: TimeWindow, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Curves of markers")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self._time = window
        self._shown = CurvePicture(np.zeros(0))
        self._limits: dict[str, tuple[float, float]] = {}
        self._drawn: dict[str, tuple[float, float]] = {}
        self._picture: QPixmap | None = None
        self._grabbed = ""
        self._pressed = QPointF()
        self._from = 0.0
        window.viewed.connect(self._repaint)
        window.moved.connect(self._move_cursor)
        window.ranged.connect(self.update)

    def set_picture(self, shown: CurvePicture) -> None:
        """Show these curves."""
        self._shown = shown
        self.setMinimumHeight(self.minimumSizeHint().height())
        self._repaint()

    def shown(self) -> CurvePicture:
        """What is shown."""
        return self._shown

    def reset(self) -> None:
        """Show all of the recording, and values as they are in it."""
        self._limits.clear()
        self._time.set_view(*self._time.span)
        self._repaint()

    def areas(self) -> list[QRectF]:
        """Where the curves of each plot are drawn."""
        line, count = em(self), len(self._shown.plots)
        left = QFontMetricsF(self.font()).horizontalAdvance("−00000 mm/s²") + 10
        bottom = 1.3 * line
        tall = max((self.height() - bottom) / max(count, 1), _LEAST_EM * line)
        head = _GAP_EM * line
        return [QRectF(left, k * tall + head, max(self.width() - left - 8, 1), tall - head - 3) for k in range(count)]

    def scale(self) -> Scale:
        """Time to pixels."""
        areas = self.areas()
        left, right = (areas[0].left(), areas[0].right()) if areas else (0.0, float(self.width()))
        return Scale(*self._time.view, left, right)

    def values_at(self, plot: CurvePlot, time: float) -> dict[str, float]:
        """What is known of each marker at a moment: cleaned, else filled."""
        if not len(self._shown.time):
            return {}
        frame = int(np.clip(np.searchsorted(self._shown.time, time - 1e-9), 0, len(self._shown.time) - 1))
        if frame and abs(self._shown.time[frame - 1] - time) < abs(self._shown.time[frame] - time):
            frame -= 1
        found: dict[str, float] = {}
        for line in plot.lines:
            place = frame - line.start
            inside = line.kind in ("measured", "filled") and 0 <= place < len(line.values)
            value = float(line.values[place]) if inside else float("nan")
            if np.isfinite(value) or line.label not in found:
                found[line.label] = value
        return found

    def shades_at(self, time: float) -> list[Shade]:
        """The marked stretches that a moment lies in, half a frame to either side."""
        if len(self._shown.time) < 2:
            return []
        frame = (time - self._shown.time[0]) / (self._shown.time[1] - self._shown.time[0])
        return [s for s in self._shown.shades if s.first - 0.5 <= frame <= s.last + 0.5]

    def sizeHint(self) -> QSize:
        """A dock across the window."""
        return QSize(700, round(20 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """Every plot at its least height."""
        return QSize(round(18 * em(self)), round((max(len(self._shown.plots), 1) * _LEAST_EM + 1.3) * em(self)))

    # what is drawn

    def _move_cursor(self, before: float, now: float) -> None:
        """Draw anew only where the cursor was and is, and the values at it."""
        areas, x, line = self.areas(), self.scale(), em(self)
        if not areas:
            return
        for time in (before, now):
            self.update(QRectF(x.at(time) - 3, 0, 6, self.height()).toAlignedRect())
        for area in areas:
            head = QRectF(area.left() + 6 * line, area.top() - 1.2 * line, area.width() - 6 * line + 8, 1.2 * line)
            self.update(head.toAlignedRect())

    def _repaint(self) -> None:
        self._picture = None
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out anew."""
        self._picture = None

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font or theme."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange):
            self.setMinimumHeight(self.minimumSizeHint().height())
            self._repaint()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Show the picture, the range, the cursor, and the values at it."""
        painter, look = QPainter(self), colours()
        if not self._shown.plots:
            painter.setPen(colour(look.faint))
            flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
            painter.drawText(QRectF(self.rect()).adjusted(12, 8, -12, -8), flags, self._shown.note)
            return
        if self._picture is None:
            self._picture = self._draw()
        painter.drawPixmap(0, 0, self._picture)
        areas, x = self.areas(), self.scale()
        top, bottom = areas[0].top(), areas[-1].bottom()
        painter.save()
        painter.setClipRect(QRectF(x.start, 0, x.end - x.start, self.height()))
        if self._time.range is not None:
            a, b = (x.at(t) for t in self._time.range)
            painter.fillRect(QRectF(a, top, max(b - a, 1.0), bottom - top), colour(palette.SELECTED, 26))
            painter.setPen(pen(palette.SELECTED, 1))
            for edge in (a, b):
                painter.drawLine(QPointF(edge, top), QPointF(edge, bottom))
        painter.setPen(pen(palette.SELECTED, 1.5))
        cursor = x.at(self._time.time)
        painter.drawLine(QPointF(cursor, top), QPointF(cursor, bottom))
        painter.restore()
        for plot, area in zip(self._shown.plots, areas):
            self._write_values(painter, plot, area)

    def _write_values(self, painter: QPainter, plot: CurvePlot, area: QRectF) -> None:
        metrics, right = QFontMetricsF(self.font()), area.right()
        inks = dict(self._shown.names)
        for label, value in list(self.values_at(plot, self._time.time).items())[:_READ][::-1]:
            text = f"{metrics.elidedText(label, Qt.TextElideMode.ElideRight, 8 * em(self))} {number(value, 0.1)}"
            width = metrics.horizontalAdvance(text) + 16
            if right - width < area.left() + 6 * em(self):
                break
            middle = area.top() - 0.6 * metrics.height()
            painter.setPen(pen(legible(inks.get(label, palette.LOST)), 3))
            painter.drawLine(QPointF(right - width, middle), QPointF(right - width + 9, middle))
            painter.setPen(colour(colours().text))
            box = QRectF(right - width + 13, area.top() - 1.15 * metrics.height(), width, 1.1 * metrics.height())
            painter.drawText(box, int(Qt.AlignmentFlag.AlignVCenter), text)
            right -= width + 8

    def _draw(self) -> QPixmap:
        ratio, look, line = self.devicePixelRatioF(), colours(), em(self)
        picture = QPixmap(round(self.width() * ratio), round(self.height() * ratio))
        picture.setDevicePixelRatio(ratio)
        picture.fill(colour(look.window))
        painter = QPainter(picture)
        painter.setFont(self.font())
        x, areas = self.scale(), self.areas()
        self._drawn = {}
        for plot, area in zip(self._shown.plots, areas):
            painter.fillRect(area, colour(look.base))
            painter.setPen(colour(look.text))
            name = QRectF(area.left(), area.top() - 1.15 * line, area.width() * 0.5, 1.1 * line)
            elided(painter, name, f"{plot.title} ({plot.unit})")
            short = [self._visible(one, x, area) for one in plot.lines]
            low, high = self._limits.get(plot.title) or limits([values for _, values in short])
            self._drawn[plot.title] = (low, high)
            y = Scale(low, high, area.bottom(), area.top())
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            y_axis(painter, area, y, "", 1.5 * line)
            painter.save()
            painter.setClipRect(area)
            self._draw_shades(painter, x, area)
            for one, (at, values) in zip(plot.lines, short):
                painter.setPen(pen_of(one))
                polyline(painter, x.pixel(at), y.pixel(values))
            painter.restore()
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(pen(look.border))
            painter.drawRect(area)
        self._draw_ruler(painter, x, areas[-1])
        painter.end()
        return picture

    def _visible(self, line: Line, x: Scale, area: QRectF) -> tuple[np.ndarray, np.ndarray]:
        time = self._shown.time[line.start : line.start + len(line.values)]
        return envelope(time, line.values[: len(time)], x.low, x.high, max(1, round(area.width())))

    def _draw_shades(self, painter: QPainter, x: Scale, area: QRectF) -> None:
        time, look = self._shown.time, colours()
        if len(time) < 2:
            return
        step = time[1] - time[0]
        ends = np.array([(s.first - 0.5, s.last + 0.5) for s in self._shown.shades]).reshape(-1, 2) * step + time[0]
        inside = (ends[:, 1] >= x.low) & (ends[:, 0] <= x.high)
        pixels = x.pixel(ends)
        for k in np.flatnonzero(inside).tolist():
            shade, (left, right) = self._shown.shades[k], pixels[k].tolist()
            box = QRectF(left, area.top(), max(right - left, 1.0), area.height())
            ink = palette.OUTLIER if shade.kind == "outlier" else shade.colour
            painter.fillRect(box, colour(ink, _TINT.get(shade.kind, 40)))
            if shade.target:
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.setPen(pen(look.text, 1.2))
                painter.drawRect(box.adjusted(0, 1, 0, -1))

    def _draw_ruler(self, painter: QPainter, x: Scale, area: QRectF) -> None:
        metrics, look = QFontMetricsF(self.font()), colours()
        width = metrics.horizontalAdvance("00:00.000 s")
        values, step = time_ticks(x.low, x.high, max(2, int((x.end - x.start) / (1.5 * width))))
        painter.setPen(colour(look.faint))
        for value in values:
            at = x.at(value)
            left = min(max(at - width / 2, x.start - 20), self.width() - width)
            box = QRectF(left, area.bottom() + 3, width, metrics.height())
            painter.drawLine(QPointF(at, area.bottom()), QPointF(at, area.bottom() + 3))
            painter.drawText(box, int(Qt.AlignmentFlag.AlignHCenter), clock(value, step))

    # what the user does

    def _plot_at(self, y: float) -> int:
        return next((k for k, a in enumerate(self.areas()) if a.top() - em(self) <= y <= a.bottom()), -1)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the view, or begin to mark a range."""
        self._pressed = event.position()
        self._from = self.scale().value(event.position().x())
        buttons = {Qt.MouseButton.LeftButton: "mark", Qt.MouseButton.MiddleButton: "view"}
        self._grabbed = buttons.get(event.button(), "") if self._shown.plots else ""

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what was grabbed."""
        time = self.scale().value(event.position().x())
        if self._grabbed == "view":
            self._time.pan(self._from - time)
        elif self._grabbed == "mark" and abs(event.position().x() - self._pressed.x()) > _CLICK_PX:
            low, high = self._time.span
            self.range_marked.emit(tuple(sorted(min(max(t, low), high) for t in (self._from, time))))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go; a click goes to its moment."""
        grabbed, self._grabbed = self._grabbed, ""
        if grabbed == "mark" and abs(event.position().x() - self._pressed.x()) <= _CLICK_PX:
            low, high = self._time.span
            self.seeked.emit(min(max(self._from, low), high))

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Go near to the gap under the pointer; elsewhere show all again."""
        self.show_gap(self.scale().value(event.position().x()))

    def show_gap(self, moment: float) -> None:
        """Show the marked stretch at a moment with three times its length about it, or all where there is none."""
        under = self.shades_at(moment)
        if not under or len(self._shown.time) < 2:
            self.reset()
            return
        step = self._shown.time[1] - self._shown.time[0]
        shade = min(under, key=lambda s: s.last - s.first)
        first, last = self._shown.time[0] + np.array([shade.first, shade.last]) * step
        room = max(3 * (last - first), 20 * step)
        self._time.set_view(first - room, last + room)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom in time; pan with Shift; zoom in values with Ctrl."""
        turn, keys = event.angleDelta(), event.modifiers()
        notches = (turn.y() or turn.x()) / 120
        if keys & Qt.KeyboardModifier.ControlModifier:
            self._zoom_values(event.position(), 1.2**notches)
        elif keys & Qt.KeyboardModifier.ShiftModifier or abs(turn.x()) > abs(turn.y()):
            self._time.pan(-0.1 * notches * (self._time.view[1] - self._time.view[0]))
        else:
            self._time.zoom(1.2**notches, self.scale().value(event.position().x()))
        event.accept()

    def _zoom_values(self, at: QPointF, factor: float) -> None:
        k = self._plot_at(at.y())
        if k < 0:
            return
        title, area = self._shown.plots[k].title, self.areas()[k]
        low, high = self._drawn.get(title, (0.0, 1.0))
        about = Scale(low, high, area.bottom(), area.top()).value(at.y())
        self._limits[title] = (about - (about - low) / factor, about + (high - about) / factor)
        self._repaint()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """``+`` and ``-`` zoom, ``0`` shows all."""
        if event.key() in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._time.zoom(1.5)
        elif event.key() == Qt.Key.Key_Minus:
            self._time.zoom(1 / 1.5)
        elif event.key() == Qt.Key.Key_0 and event.modifiers() == Qt.KeyboardModifier.NoModifier:
            self.reset()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Ask for the menu."""
        self.menu_wanted.emit(event.globalPos())

    def event(self, event: QEvent) -> bool:
        """Say what lies below the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            under = self.shades_at(self.scale().value(event.pos().x())) if self._shown.plots else []
            said = {"gap": "lost", "filled": "filled", "outlier": "cut as an outlier"}
            lines = [f"{s.label}: {said.get(s.kind, s.kind)} in frames {s.first} to {s.last}" for s in under]
            QToolTip.showText(event.globalPos(), "\n".join(lines), self)
            return True
        return super().event(event)
