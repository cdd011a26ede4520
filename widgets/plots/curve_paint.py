"""Lines over time, their names, and their values at a moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter

from markerscope.widgets.plots.decimate import envelope
from markerscope.widgets.plots.ink import colour, faded, legible, pen, polygon, polyline, runs
from markerscope.widgets.plots.rows import Curve
from markerscope.widgets.plots.scales import Scale
from markerscope.widgets.theme import colours

_BAND_POINTS = 600


def frame_at(time: np.ndarray, at: float) -> int:
    """The nearest frame to a moment."""
    after = int(np.searchsorted(time, at))
    if after == 0 or after == len(time):
        return min(after, len(time) - 1)
    return after if time[after] - at < at - time[after - 1] else after - 1


def curve_value(curve: Curve, time: np.ndarray, at: float) -> float:
    """Value of a curve at a moment; NaN outside of it."""
    own = time if curve.time is None else curve.time
    if not len(own) or at < own[0] - 1e-9 or at > own[-1] + 1e-9:
        return float("nan")
    return float(curve.values[frame_at(own, at)])


def ink_of(curve: Curve) -> tuple[int, ...]:
    """What a curve is drawn with: its colour as far as it can be told from the ground, pale where it is out of date."""
    return faded(legible(curve.colour)) if curve.old else legible(curve.colour)


def draw_curve(
    painter: QPainter, area: QRectF, x: Scale, y: Scale, curve: Curve, time: np.ndarray, own: np.ndarray | None = None
) -> None:
    """One line, decimated to the pixels of the area."""
    clock_of = own if own is not None else (time if curve.time is None else curve.time)
    at, values = envelope(clock_of, curve.values, x.low, x.high, max(1, round(area.width())))
    painter.setPen(pen(ink_of(curve), 1.6, curve.dashed))
    polyline(painter, x.pixel(at), y.pixel(values))


def draw_band(
    painter: QPainter, x: Scale, y: Scale, time: np.ndarray, edges: tuple[np.ndarray, np.ndarray], ground: QColor
) -> None:
    """An area between two curves (T,), interrupted where they are not finite; as many points as there are pixels."""
    low, high = edges
    seen = np.flatnonzero((time >= x.low) & (time <= x.high))
    if not len(seen):
        return
    first, last = max(int(seen[0]) - 1, 0), min(int(seen[-1]) + 2, len(time))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    for start, end in runs(np.isfinite(low[first:last]) & np.isfinite(high[first:last])):
        count = min(end - start, _BAND_POINTS)
        at = first + np.unique(np.linspace(start, end - 1, count).round().astype(int))
        across = x.pixel(time[at])
        edge = np.concatenate([y.pixel(high[at]), y.pixel(low[at])[::-1]])
        painter.drawPolygon(polygon(np.concatenate([across, across[::-1]]), edge))
    painter.setBrush(Qt.BrushStyle.NoBrush)


def legend(painter: QPainter, area: QRectF, curves: tuple[Curve, ...]) -> None:
    """Names of the curves in the upper right corner, on a ground of their own; the longest are shortened first."""
    metrics, look = QFontMetricsF(painter.font()), colours()
    right = area.right() - 6
    longest = shortened([metrics.horizontalAdvance(curve.label) + 30 for curve in curves], right - area.left() - 10)
    for curve in reversed(curves):
        text = metrics.elidedText(curve.label, Qt.TextElideMode.ElideRight, max(longest - 30, 12))
        width = metrics.horizontalAdvance(text) + 26
        box = QRectF(right - width, area.top() + 2, width, metrics.height() + 2)
        painter.fillRect(box, colour(look.base, 215))
        painter.setPen(pen(ink_of(curve), 2.0, curve.dashed))
        middle = box.center().y()
        painter.drawLine(QPointF(box.left() + 4, middle), QPointF(box.left() + 18, middle))
        painter.setPen(colour(look.text))
        painter.drawText(box.adjusted(22, 0, 0, 0), int(Qt.AlignmentFlag.AlignVCenter), text)
        right -= width + 4


def shortened(widths: Sequence[float], room: float) -> float:
    """The width beyond which each of several is cut, so that together they have room; the widest where all have."""
    left = sorted(widths)
    for k, width in enumerate(left):
        share = room / (len(left) - k)
        if width > share:
            return share
        room -= width
    return max(widths, default=0.0)
