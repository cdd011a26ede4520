"""What an energy is made of, as a bar, and the key to its colours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QEvent, QRectF, QSize, Qt
from PySide6.QtGui import QHelpEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from markerscope.widgets.plots.ink import colour, em, pen
from markerscope.widgets.plots.scales import number
from markerscope.widgets.theme import colours


class EnergyBar(QWidget):
    """Terms stacked along a line, to a scale that all answers share."""

    def __init__(self, terms: Sequence[Any], highest: float, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._terms, self._highest = tuple(terms), highest
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Energy by term")
        self.setAccessibleDescription(", ".join(f"{term.title} {number(term.value)}" for term in terms))

    def sizeHint(self) -> QSize:
        """A line of text high."""
        return QSize(120, round(em(self)))

    def parts(self) -> list[tuple[Any, QRectF]]:
        """Each term and where it is drawn."""
        left, found, wide = 0.0, [], (self.width() - 1) / (self._highest or 1.0)
        for term in self._terms:
            found.append((term, QRectF(left, 0, term.value * wide, self.height() - 1)))
            left += term.value * wide
        return found

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the terms, each apart from the next."""
        painter, look = QPainter(self), colours()
        painter.fillRect(self.rect(), colour(look.base))
        for term, rect in self.parts():
            painter.fillRect(rect, colour(term.colour))
            painter.fillRect(QRectF(rect.right() - 1, 0, 1, rect.height()), colour(look.base))
        painter.setPen(pen(look.border))
        painter.drawRect(QRectF(0, 0, self.width() - 1, self.height() - 1))

    def event(self, event: QEvent) -> bool:
        """Say what each term is."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            found = next((term for term, rect in self.parts() if rect.contains(event.pos().toPointF())), None)
            text = "" if found is None else f"{found.title}: {number(found.value)}. {found.help}"
            QToolTip.showText(event.globalPos(), text, self)
            return True
        return super().event(event)


class TermKey(QWidget):
    """What the colours of the bars mean, on as many lines as are needed."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._terms: tuple[Any, ...] = ()
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Minimum)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)

    def set_terms(self, terms: Sequence[Any]) -> None:
        """Show these."""
        self._terms = tuple(terms)
        self.updateGeometry()
        self.update()

    def hasHeightForWidth(self) -> bool:
        """It has."""
        return True

    def heightForWidth(self, width: int) -> int:
        """Lines that are needed."""
        places = self._places(width)
        return round(places[-1].bottom() + 2) if places else 0

    def sizeHint(self) -> QSize:
        """One line."""
        return QSize(300, self.heightForWidth(max(self.width(), 300)))

    def _places(self, width: float) -> list[QRectF]:
        x, y, line, found = 0.0, 0.0, em(self), []
        for term in self._terms:
            wide = self.fontMetrics().horizontalAdvance(term.title) + 1.6 * line
            if x and x + wide > width:
                x, y = 0.0, y + 1.25 * line
            found.append(QRectF(x, y, wide, 1.2 * line))
            x += wide + 6
        return found

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw swatches and names."""
        painter, line = QPainter(self), em(self)
        for term, box in zip(self._terms, self._places(self.width())):
            painter.fillRect(QRectF(box.left(), box.top() + 0.25 * line, 0.7 * line, 0.7 * line), colour(term.colour))
            painter.setPen(colour(colours().text))
            painter.drawText(box.adjusted(line, 0, 0, 0), int(Qt.AlignmentFlag.AlignVCenter), term.title)
