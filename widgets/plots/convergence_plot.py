"""Energies over iterations, logarithmic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.ink import colour, em, legible, pen, polyline, y_axis
from markerscope.widgets.plots.scales import Scale, number
from markerscope.widgets.theme import colours


class ConvergencePlot(QWidget):
    """A line a descent; the chosen one is heavy and carries the cursor.

    Signals
    -------
    pointed(curve, iteration) : a click or a drag
    """

    pointed = Signal(int, int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Energy per iteration")
        self._curves: tuple[Any, ...] = ()
        self._unit = ""
        self._chosen, self._iteration = -1, 0

    def set_curves(self, curves: Sequence[Any], unit: str = "") -> None:
        """Show these; each has ``iteration``, ``energy``, ``label`` and ``colour``."""
        self._curves, self._unit = tuple(curves), unit
        self.update()

    def set_cursor(self, curve: int, iteration: int) -> None:
        """Choose a curve and a place on it."""
        self._chosen, self._iteration = curve, iteration
        self.update()

    def sizeHint(self) -> QSize:
        """A plot."""
        return QSize(460, round(16 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """A small one."""
        return QSize(round(14 * em(self)), round(8 * em(self)))

    def area(self) -> QRectF:
        """Where the lines are drawn."""
        metrics = QFontMetricsF(self.font())
        left, line = metrics.horizontalAdvance("0.0e−00") + 12, metrics.height()
        return QRectF(left, 1.5 * line, max(self.width() - left - 10, 1), max(self.height() - 3.7 * line, 1))

    def scales(self) -> tuple[Scale, Scale]:
        """Iterations and energies to pixels."""
        area = self.area()
        last = max((int(c.iteration[-1]) for c in self._curves if len(c.iteration)), default=1)
        found = [c.energy[np.isfinite(c.energy) & (c.energy > 0)] for c in self._curves]
        found = [energy for energy in found if len(energy)]
        low = min((float(energy.min()) for energy in found), default=0.1)
        high = max((float(energy.max()) for energy in found), default=1.0)
        room = max(high / low, 1.2) ** 0.05
        return Scale(0, max(last, 1), area.left(), area.right()), Scale(
            low / room, high * room, area.bottom(), area.top(), log=True
        )

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it."""
        painter, look, area = QPainter(self), colours(), self.area()
        metrics = QFontMetricsF(self.font())
        line = metrics.height()
        if not any(len(curve.iteration) for curve in self._curves):
            painter.setPen(colour(look.faint))
            flags = int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap)
            text = "Nothing was solved yet, or the method kept no trace."
            painter.drawText(QRectF(self.rect()).adjusted(10, 10, -10, -10), flags, text)
            return
        x, y = self.scales()
        painter.fillRect(area, colour(look.base))
        painter.setPen(colour(look.faint))
        painter.drawText(QRectF(4, 2, self.width() - 8, line), 0, f"Energy{f', {self._unit}' if self._unit else ''}")
        y_axis(painter, area, y, "", 1.8 * line)
        painter.setPen(colour(look.faint))
        for value in x.ticks(metrics.horizontalAdvance("00000") * 2):
            if value == int(value):
                width = metrics.horizontalAdvance("00000")
                left = min(max(x.at(value) - width / 2, 0), self.width() - width)
                box = QRectF(left, area.bottom() + 2, width, line)
                painter.drawText(box, int(Qt.AlignmentFlag.AlignHCenter), str(int(value)))
        box = QRectF(area.left(), area.bottom() + 1.05 * line, area.width(), line)
        painter.drawText(box, int(Qt.AlignmentFlag.AlignHCenter), "iteration")
        painter.setClipRect(area)
        order = [k for k in range(len(self._curves)) if k != self._chosen]
        for k in [*order, *([self._chosen] if 0 <= self._chosen < len(self._curves) else [])]:
            curve = self._curves[k]
            painter.setPen(pen(legible(curve.colour), 2.6 if k == self._chosen else 1.2))
            values = np.where(curve.energy > 0, curve.energy, np.nan)
            polyline(painter, x.pixel(np.asarray(curve.iteration, float)), y.pixel(values))
        if 0 <= self._chosen < len(self._curves) and len(self._curves[self._chosen].energy):
            self._paint_cursor(painter, area, x, y)
        painter.setClipping(False)

    def _paint_cursor(self, painter: QPainter, area: QRectF, x: Scale, y: Scale) -> None:
        curve, look = self._curves[self._chosen], colours()
        row = max(0, int(np.searchsorted(curve.iteration, self._iteration, side="right")) - 1)
        at = x.at(self._iteration)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(pen(palette.SELECTED, 1.5))
        painter.drawLine(QPointF(at, area.top()), QPointF(at, area.bottom()))
        painter.setBrush(colour(curve.colour))
        painter.setPen(pen(look.base, 1.5))
        if curve.energy[row] > 0:
            painter.drawEllipse(QPointF(x.at(int(curve.iteration[row])), y.at(float(curve.energy[row]))), 4.5, 4.5)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the nearest curve, and the iteration."""
        if event.button() == Qt.MouseButton.LeftButton and self._curves:
            x, y = self.scales()
            away = []
            for curve in self._curves:
                row = max(0, int(np.searchsorted(curve.iteration, x.value(event.position().x()), side="right")) - 1)
                energy = float(curve.energy[row]) if len(curve.energy) else np.nan
                away.append(abs(y.at(energy) - event.position().y()) if energy > 0 else np.inf)
            self._point(int(np.argmin(away)), event.position().x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move along it."""
        if event.buttons() & Qt.MouseButton.LeftButton and 0 <= self._chosen < len(self._curves):
            self._point(self._chosen, event.position().x())

    def _point(self, curve: int, pixel: float) -> None:
        last = int(self._curves[curve].iteration[-1]) if len(self._curves[curve].iteration) else 0
        self.pointed.emit(curve, min(max(round(self.scales()[0].value(pixel)), 0), last))


def energy_text(value: float) -> str:
    """An energy with three digits that count."""
    return number(float(f"{value:.3g}")) if np.isfinite(value) else "–"
