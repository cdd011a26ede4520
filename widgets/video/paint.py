"""Drawing over a video: every stroke on a darker one, so that it is seen on any picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen

from markerscope.widgets import palette

_LANDMARK = (240, 228, 66)


def draw_lines(painter: QPainter, ends: np.ndarray, rgb: tuple[int, int, int], width: float) -> None:
    """Lines with ends (S, 4) px, NaN left out."""
    lines = [QLineF(*line) for line in ends[np.isfinite(ends).all(axis=1)].tolist()]
    if lines:
        for colour, wide in ((QColor(0, 0, 0, 140), width + 2.0), (QColor(*rgb), width)):
            # Square ends close the joints as round ones do, at a fraction of the time.
            painter.setPen(QPen(colour, wide, Qt.PenStyle.SolidLine, Qt.PenCapStyle.SquareCap))
            painter.drawLines(lines)


def stroke(width: float, height: float) -> float:
    """How large dots and lines are drawn over a picture shown so large, px; 1 where it is some 900 by 500."""
    return min(max((width * height) ** 0.5 / 675.0, 0.45), 1.4)


def draw_landmarks(
    painter: QPainter, at: np.ndarray, links: np.ndarray, visibility: np.ndarray, size: float = 1.0
) -> None:
    """Dots at (L, 2) px, NaN left out, linked by (E, 2), as strong as they are sure (L)."""
    for a, b in links:
        if np.isfinite(at[[a, b]]).all():
            sure = min(visibility[a], visibility[b])
            line = QLineF(*at[a].tolist(), *at[b].tolist())
            for colour, width in ((QColor(0, 0, 0, int(40 + 110 * sure)), 3.5 * size), (_faded(sure), 1.8 * size)):
                painter.setPen(QPen(colour, width))
                painter.drawLine(line)
    painter.setPen(QPen(QColor(0, 0, 0, 170), 1.0))
    for (x, y), sure in zip(at.tolist(), visibility):
        if x == x:
            painter.setBrush(_faded(sure))
            painter.drawEllipse(QPointF(x, y), 3.2 * size, 3.2 * size)


def draw_markers(
    painter: QPainter, at: np.ndarray, colours: np.ndarray, selected: Sequence[int], size: float = 1.0
) -> None:
    """Balls at (M, 2) px, NaN left out, in colours (M, 3), with a ring about those that are selected."""
    painter.setPen(QPen(QColor(0, 0, 0, 200), 1.2 * min(size, 1.0)))
    for (x, y), rgb in zip(at.tolist(), colours.tolist()):
        if x == x:
            painter.setBrush(QColor(*rgb))
            painter.drawEllipse(QPointF(x, y), 4.5 * size, 4.5 * size)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for i in selected:
        if i < len(at) and not np.isnan(at[i, 0]):
            for colour, width in ((QColor(255, 255, 255, 200), 4.0), (QColor(*palette.SELECTED), 2.0)):
                painter.setPen(QPen(colour, width))
                painter.drawEllipse(QPointF(*at[i].tolist()), 4.5 * size + 3.0, 4.5 * size + 3.0)


def draw_text(painter: QPainter, text: str, width: float) -> None:
    """Words in the upper left corner, cut to fit a picture of this width."""
    metrics = QFontMetricsF(painter.font())
    shown = metrics.elidedText(text, Qt.TextElideMode.ElideRight, width - 32.0)
    box = QRectF(8, 8, metrics.horizontalAdvance(shown) + 16, metrics.height() + 8)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(0, 0, 0, 150))
    painter.drawRoundedRect(box, 4, 4)
    painter.setPen(QColor(255, 255, 255))
    painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), shown)


def _faded(sure: float) -> QColor:
    return QColor(*_LANDMARK, int(60 + 195 * sure))
