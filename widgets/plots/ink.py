"""What all plots draw alike: lines with gaps, axes, names."""

from __future__ import annotations

from functools import cache

import numpy as np
import shiboken6
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.scales import Scale, number
from markerscope.widgets.theme import colours, qcolour

_CONTRAST = 3.0
"""What WCAG asks of lines and signs."""
_PIECE = 32
"""Points of a solid line drawn at once: Qt's time for a smoothed line grows with the square of them."""
_DASH, _GAP, _CLOSE = 5.0, 4.0, 2.5
"""Pixels along the clock of a dash and of the gap behind it, where points lie closer than the third."""
_DENSE = 1000
"""Points beyond which a line is thin and not smoothed: it is an envelope then, and Qt's wide joins would cost 20 ms."""


def colour(rgb: np.ndarray | tuple[int, ...], alpha: int = 255) -> QColor:
    """Qt's colour for a triple of numbers."""
    return qcolour(tuple(int(c) for c in rgb), alpha)


@cache
def _legible(rgb: tuple[int, ...], ground: tuple[int, int, int]) -> tuple[int, ...]:
    mixed, towards = np.array(rgb, np.float64), np.array(palette.text_on(ground), np.float64)
    for _ in range(12):
        if palette.contrast(mixed, ground) >= _CONTRAST:
            break
        mixed += 0.12 * (towards - mixed)
    return tuple(np.rint(mixed).astype(int).tolist())


def legible(rgb: np.ndarray | tuple[int, ...]) -> tuple[int, ...]:
    """The colour, or one of its hue that is told from the ground of a plot as a thin line, too."""
    return _legible(tuple(int(part) for part in rgb), colours().base)


def faded(rgb: np.ndarray | tuple[int, ...]) -> tuple[int, ...]:
    """The colour half way to the ground of a plot: what is out of date is pale, and words beside it say why."""
    mixed = 0.5 * np.array(rgb, np.float64) + 0.5 * np.array(colours().base, np.float64)
    return tuple(np.rint(mixed).astype(int).tolist())


def em(widget: QWidget) -> float:
    """Height of a line of text, the measure of everything that has to grow with the font."""
    return QFontMetricsF(widget.font()).height()


def image_of(picture: np.ndarray) -> QImage:
    """(H, W, 3) uint8 as an image with memory of its own."""
    picture = np.ascontiguousarray(picture)
    height, width = picture.shape[:2]
    return QImage(picture.data, width, height, 3 * width, QImage.Format.Format_RGB888).copy()


def polygon(x: np.ndarray, y: np.ndarray) -> QPolygonF:
    """Points as Qt wants them, without a loop."""
    points = QPolygonF()
    points.resize(len(x))
    memory = np.frombuffer(shiboken6.VoidPtr(points.data(), 16 * len(x), True), np.float64).reshape(-1, 2)  # type: ignore
    memory[:, 0], memory[:, 1] = x, y
    return points


def polyline(painter: QPainter, x: np.ndarray, y: np.ndarray) -> None:
    """A line that is interrupted where ``y`` is not finite; single points are drawn as dots."""
    good = np.isfinite(x) & np.isfinite(y)
    dense = len(x) > _DENSE
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, not dense)
    drawn_with = painter.pen()
    if drawn_with.style() != Qt.PenStyle.SolidLine and len(x) > 1 and abs(x[-1] - x[0]) < _CLOSE * len(x):
        good &= (x - x[0]) % (_DASH + _GAP) < _DASH  # Qt's own dashes of a long line take as long as a whole picture
        drawn_with.setStyle(Qt.PenStyle.SolidLine)
    drawn_with.setJoinStyle(Qt.PenJoinStyle.BevelJoin)  # looks the same on so narrow a line, in half the time
    if dense:
        drawn_with.setWidthF(1.0)
        drawn_with.setStyle(Qt.PenStyle.SolidLine)
    painter.setPen(drawn_with)
    solid = drawn_with.style() == Qt.PenStyle.SolidLine  # dashes would begin anew with every piece
    for start, end in runs(good):
        if end - start == 1:
            painter.drawPoint(QPointF(x[start], y[start]))
        else:
            piece = _PIECE if solid else end - start
            for first in range(start, end - 1, piece):
                stop = min(first + piece + 1, end)
                painter.drawPolyline(polygon(x[first:stop], y[first:stop]))


def runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """Stretches of True as (first, one past the last)."""
    steps = np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8))
    return list(zip(np.flatnonzero(steps == 1).tolist(), np.flatnonzero(steps == -1).tolist()))


def pen(rgb: np.ndarray | tuple[int, ...], width: float = 1.0, dashed: bool = False) -> QPen:
    """A pen that is as wide on every screen."""
    made = QPen(colour(rgb), width)
    made.setJoinStyle(Qt.PenJoinStyle.RoundJoin)
    made.setCapStyle(Qt.PenCapStyle.RoundCap if not dashed else Qt.PenCapStyle.FlatCap)
    if dashed:
        made.setDashPattern([4, 3])
    return made


def y_axis(painter: QPainter, area: QRectF, scale: Scale, unit: str, apart: float, names: bool = True) -> None:
    """Lines across the area and numbers left of it; the unit stands with the highest."""
    look, metrics = colours(), QFontMetricsF(painter.font())
    values = scale.ticks(apart)
    step = values[1] - values[0] if len(values) > 1 and not scale.log else None
    for value in values:
        y = scale.at(value)
        if not area.top() - 0.5 <= y <= area.bottom() + 0.5:
            continue
        painter.setPen(pen(look.grid))
        painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
        if names:
            painter.setPen(colour(look.faint))
            text = number(value, step)
            if value == values[-1] and unit:
                text = f"{text}{unit}" if unit == "°" else f"{text} {unit}"
            top = min(
                max(y - metrics.height() / 2, area.top() - metrics.height() * 0.4), area.bottom() - metrics.height()
            )
            box = QRectF(area.left() - 500, top, 500 - 5, metrics.height())
            painter.drawText(box, int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter), text)


def elided(painter: QPainter, box: QRectF, text: str, align: Qt.AlignmentFlag = Qt.AlignmentFlag.AlignLeft) -> None:
    """One line of text, shortened by an ellipsis where there is no room."""
    short = QFontMetricsF(painter.font()).elidedText(text, Qt.TextElideMode.ElideRight, box.width())
    painter.drawText(box, int(align | Qt.AlignmentFlag.AlignVCenter), short)
