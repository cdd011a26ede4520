"""How long the gaps of markers are: a bar for each class of lengths."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets.plots.ink import colour, elided, em, pen
from markerscope.widgets.theme import colours

CLASSES = ((1, 1), (2, 3), (4, 7), (8, 15), (16, 31), (32, 63), (64, 127), (128, 255), (256, 10**9))
"""Frames, both inclusive: as many as real gaps, whose lengths have a heavy tail, need on one picture."""


def count_lengths(lengths: np.ndarray) -> np.ndarray:
    """How many of (n,) lengths, frames, fall into each class."""
    return np.array([int(((lengths >= low) & (lengths <= high)).sum()) for low, high in CLASSES])


class GapHistogram(QWidget):
    """Bars with their numbers; the classes double, as the lengths of real gaps do."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Lengths of gaps")
        self._title, self._counts, self._rate = "", np.zeros(len(CLASSES), int), 100.0

    def set_lengths(self, title: str, lengths: np.ndarray, rate: float) -> None:
        """Show the lengths (n,) of some gaps, frames, at a rate in Hz."""
        self._title, self._counts, self._rate = title, count_lengths(np.asarray(lengths)), rate
        self.setAccessibleDescription(title)
        self.update()

    def counts(self) -> list[int]:
        """What the bars show."""
        return self._counts.tolist()

    def sizeHint(self) -> QSize:
        """A low picture."""
        return QSize(round(18 * em(self)), round(9 * em(self)))

    def minimumSizeHint(self) -> QSize:
        """Five lines of text."""
        return QSize(round(12 * em(self)), round(5 * em(self)))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the bars."""
        painter, look, metrics = QPainter(self), colours(), QFontMetricsF(self.font())
        line = metrics.height()
        painter.setPen(colour(look.text))
        elided(painter, QRectF(6, 1, self.width() - 12, line), self._title or "Select markers to see their gaps.")
        area = QRectF(6, 2.2 * line, self.width() - 12, max(self.height() - 4.6 * line, 4.0))
        wide, most = area.width() / len(CLASSES), max(int(self._counts.max(initial=0)), 1)
        for k, (count, (low, high)) in enumerate(zip(self._counts.tolist(), CLASSES)):
            left, tall = area.left() + k * wide, area.height() * count / most
            painter.fillRect(QRectF(left + 2, area.bottom() - tall, wide - 4, tall), colour(look.accent, 190))
            painter.setPen(colour(look.text))
            if count:
                box = QRectF(left, area.bottom() - tall - line, wide, line)
                painter.drawText(box, int(Qt.AlignmentFlag.AlignHCenter), f"{count}")
            painter.setPen(colour(look.faint))
            word = f"{low}" if low == high else f"{low}+" if high > 10**6 else f"{low}-{high}"
            word = word if metrics.horizontalAdvance(word) < wide else f"{low}…"
            painter.drawText(QRectF(left, area.bottom() + 2, wide, line), int(Qt.AlignmentFlag.AlignHCenter), word)
        painter.setPen(pen(look.border))
        painter.drawLine(QPointF(area.left(), area.bottom()), QPointF(area.right(), area.bottom()))
        painter.setPen(colour(look.faint))
        said = f"frames lost in a row; 1 frame is {1000 / self._rate:.3g} ms"
        elided(painter, QRectF(6, area.bottom() + 2 + line, self.width() - 12, line), said)
