"""Small plots of joint angles below and beside each other, on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QHelpEvent, QMouseEvent, QPainter, QPaintEvent, QPixmap, QResizeEvent
from PySide6.QtWidgets import QToolTip, QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.curve_paint import draw_band, draw_curve, frame_at
from markerscope.widgets.plots.ink import colour, elided, em, faded, legible, pen, y_axis
from markerscope.widgets.plots.rows import Curve
from markerscope.widgets.plots.scales import Scale, clock, limits, number, time_ticks
from markerscope.widgets.theme import colours

OUT_OF_DATE = "out of date"
_JUMP_DEG = 120.0
"""A larger step between two frames is one of the reading, which came in again at the other end of its range."""
_PALE, _PALER = 90, 30
"""Opacity, of 255, of the band of what was measured and of what was not."""
_COLUMN_EM = 34.0
"""Lines of text that a column of plots is wide before there are two."""


class AnglePlots(QWidget):
    """Paints once; the cursor and its values are laid over.

    Signals
    -------
    seeked(time) : s
    """

    seeked = Signal(float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Plots of joint angles")
        self._time = np.zeros(0)
        self._plots: tuple[Any, ...] = ()
        self._view = (0.0, 1.0)
        self._cursor = 0.0
        self._joint: str | None = None
        self._old = False
        self._picture: QPixmap | None = None

    def set_joint(self, joint: str | None) -> None:
        """Frame the plots of a joint, None for none."""
        if joint != self._joint:
            self._joint = joint
            self.update()

    def set_plots(self, time: np.ndarray, plots: Sequence[Any], view: tuple[float, float], old: bool = False) -> None:
        """Show these, see :class:`AnglePlot`, over the part ``view`` of the clock, s; pale where they are ``old``."""
        self._old = old
        self._time, self._plots, self._view = time, tuple(plots), view
        self._picture = None
        self._fit()
        self.update()

    def set_time(self, time: float) -> None:
        """Move the cursor."""
        if time != self._cursor:
            self._cursor = time
            self.update()

    def columns(self) -> int:
        """How many plots stand beside each other."""
        return max(1, min(3, int(self.width() / (_COLUMN_EM * em(self)) + 0.3), len(self._plots)))

    def areas(self) -> list[QRectF]:
        """Where the curves of each plot are drawn."""
        metrics, line, columns = QFontMetricsF(self.font()), em(self), self.columns()
        rows = max(1, -(-len(self._plots) // columns))
        left, bottom = metrics.horizontalAdvance("−000 °") + 12, 1.3 * line
        wide, tall = self.width() / columns, max((self.height() - bottom) / rows, self._least())
        return [
            QRectF(
                (k % columns) * wide + left, (k // columns) * tall + 1.35 * line, wide - left - 10, tall - 1.7 * line
            )
            for k in range(len(self._plots))
        ]

    def scale(self, area: QRectF) -> Scale:
        """Time to pixels."""
        return Scale(*self._view, area.left(), area.right())

    def values_at(self, plot: int, time: float) -> list[float]:
        """Degrees of each curve of a plot."""
        if not len(self._time) or not self._time[0] - 1e-9 <= time <= self._time[-1] + 1e-9:
            return [float("nan")] * len(self._plots[plot].curves)
        frame = frame_at(self._time, time)
        return [float(curve.degrees[frame]) for curve in self._plots[plot].curves]

    def sizeHint(self) -> QSize:
        """Room for every plot."""
        return self.minimumSizeHint()

    def minimumSizeHint(self) -> QSize:
        """All plots at their least height."""
        rows = -(-len(self._plots) // self.columns()) if self._plots else 1
        return QSize(round(16 * em(self)), round(rows * self._least() + 1.3 * em(self)))

    def _least(self) -> float:
        return 6.5 * em(self)

    def _fit(self) -> None:
        self.setMinimumHeight(self.minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Lay out anew."""
        self._picture = None
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font or theme."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange):
            self._picture = None
            self._fit()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Show the picture, the cursor, and the values below it."""
        painter, look = QPainter(self), colours()
        if not self._plots:
            painter.setPen(colour(look.faint))
            flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
            text = "Choose angles at the left." if len(self._time) else "There are no angles yet: run the stage Angles."
            painter.drawText(QRectF(self.rect()).adjusted(10, 10, -10, -10), flags, text)
            return
        if self._picture is None:
            self._picture = self._draw()
        painter.drawPixmap(0, 0, self._picture)
        metrics = QFontMetricsF(self.font())
        for k, (plot, area) in enumerate(zip(self._plots, self.areas())):
            if plot.joint == self._joint:
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.setPen(pen(palette.SELECTED, 2))
                painter.drawRect(area)
            x = self.scale(area).at(self._cursor)
            if area.left() <= x <= area.right():
                painter.setPen(pen(palette.SELECTED, 1.5))
                painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom()))
            right = area.right()
            for curve, value in reversed(list(zip(plot.curves, self.values_at(k, self._cursor)))):
                text = f"{curve.side[:1].upper()} {number(value, 0.1)}°".strip()
                width = metrics.horizontalAdvance(text) + 18
                painter.setPen(pen(legible(curve.colour), 3))
                middle = area.top() - 0.65 * metrics.height()
                painter.drawLine(QPointF(right - width + 2, middle), QPointF(right - width + 11, middle))
                painter.setPen(colour(look.text))
                box = QRectF(right - width + 15, area.top() - 1.2 * metrics.height(), width, 1.1 * metrics.height())
                painter.drawText(box, int(Qt.AlignmentFlag.AlignVCenter), text)
                right -= metrics.horizontalAdvance("L −000.0°") + 24

    def _draw(self) -> QPixmap:
        ratio, look, line = self.devicePixelRatioF(), colours(), em(self)
        picture = QPixmap(round(self.width() * ratio), round(self.height() * ratio))
        picture.setDevicePixelRatio(ratio)
        picture.fill(colour(look.window))
        painter = QPainter(picture)
        painter.setFont(self.font())
        areas, columns = self.areas(), self.columns()
        for k, (plot, area) in enumerate(zip(self._plots, areas)):
            painter.fillRect(area, colour(look.base))
            painter.setPen(colour(look.warning if self._old else look.text))
            metrics = QFontMetricsF(self.font())
            beside = len(plot.curves) * (metrics.horizontalAdvance("L −000.0°") + 24)
            room = QRectF(area.left(), area.top() - 1.2 * line, max(area.width() - beside, 40), 1.1 * line)
            elided(painter, room, f"{plot.title}, {OUT_OF_DATE}" if self._old else plot.title)
            shown = [c.degrees for c in plot.curves] + [c.reference for c in plot.curves if c.reference is not None]
            # The band of what is hardly known would flatten what is measured.
            shown += [edge for c in plot.curves if c.band is not None and not c.unmeasured for edge in c.band]
            low, high = limits(shown)
            if high - low < 10:  # a joint that rests should look at rest
                low, high = (low + high) / 2 - 5, (low + high) / 2 + 5
            x, y = self.scale(area), Scale(low, high, area.bottom(), area.top())
            y_axis(painter, area, y, "°", 1.5 * line)
            painter.setClipRect(area)
            if low < 0 < high:
                painter.setPen(pen(look.border, 1.2))
                painter.drawLine(QPointF(area.left(), y.at(0)), QPointF(area.right(), y.at(0)))
            for curve in plot.curves:
                if curve.band is not None:
                    below, above = curve.band
                    ground = colour(faded(legible(curve.colour)), _PALER if curve.unmeasured else _PALE)
                    draw_band(painter, x, y, self._time, (below, above), ground)
            for curve in plot.curves:
                ink = np.array(curve.colour, np.uint8)
                if curve.reference is not None:
                    reference = _broken("", self._time, curve.reference, ink, dashed=True)
                    draw_curve(painter, area, x, y, reference, self._time)
                pale = self._old or curve.unmeasured
                own = _broken(curve.name, self._time, curve.degrees, ink, dashed=curve.unmeasured, old=pale)
                draw_curve(painter, area, x, y, own, self._time)
            painter.setClipping(False)
            if k + columns >= len(areas):
                self._draw_clock(painter, area, x)
        painter.end()
        return picture

    def _said_error(self, curve: Any) -> str:
        """The standard error at the cursor, in words."""
        if curve.error is None or not len(self._time):
            return ""
        error = float(curve.error[frame_at(self._time, self._cursor)])
        return f"; standard error {number(error, 0.1)}° here" if np.isfinite(error) else ""

    def _draw_clock(self, painter: QPainter, area: QRectF, x: Scale) -> None:
        metrics = QFontMetricsF(self.font())
        width = metrics.horizontalAdvance("00:00.00 s")
        values, step = time_ticks(x.low, x.high, max(2, int(area.width() / (1.6 * width))))
        painter.setPen(colour(colours().faint))
        for value in values:
            left = min(max(x.at(value) - width / 2, area.left() - width / 2), area.right() - 0.8 * width)
            box = QRectF(left, area.bottom() + 2, width, metrics.height())
            painter.drawText(box, int(Qt.AlignmentFlag.AlignHCenter), clock(value, step))

    def _at(self, point: QPointF) -> int:
        room = 1.4 * em(self)
        found = [k for k, area in enumerate(self.areas()) if area.adjusted(-60, -room, 10, 8).contains(point)]
        return found[0] if found else -1

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Seek."""
        self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Seek on."""
        plot = self._at(event.position())
        if event.buttons() & Qt.MouseButton.LeftButton and plot >= 0:
            x = self.scale(self.areas()[plot])
            self.seeked.emit(min(max(x.value(event.position().x()), x.low), x.high))

    def event(self, event: QEvent) -> bool:
        """Say what an angle means."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            plot = self._at(QPointF(event.pos()))
            lines = []
            for curve in self._plots[plot].curves if plot >= 0 else ():
                meaning = f": positive is {curve.positive}" if curve.positive else ""
                rests = f" (rests on {curve.rests_on})" if curve.rests_on else ""
                lines.append(f"{curve.name}, degrees{meaning}{rests}{self._said_error(curve)}")
            QToolTip.showText(event.globalPos(), "\n".join(lines), self)
            return True
        return super().event(event)


def _broken(
    name: str, time: np.ndarray, degrees: np.ndarray, ink: Any, *, dashed: bool = False, old: bool = False
) -> Curve:
    """A curve that is interrupted where the reading jumps, instead of crossing the plot upright."""
    after = np.flatnonzero(np.abs(np.diff(degrees)) > _JUMP_DEG) + 1
    at, values = np.insert(time, after, (time[after - 1] + time[after]) / 2), np.insert(degrees, after, np.nan)
    return Curve(name, values, ink, time=at, dashed=dashed, old=old)
