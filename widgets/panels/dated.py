"""A panel that says when what it shows is out of date."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QLabel, QSizePolicy, QVBoxLayout, QWidget

from markerscope.widgets.theme import colours, qcolour

_STRIPE = 7.0


class DatedNote(QLabel):
    """A strip of words over a striped ground, hidden while there is nothing to say."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.setContentsMargins(14, 3, 6, 3)
        self.setVisible(False)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Stripes at the edge, in the colour of a warning, beside the words."""
        painter, look = QPainter(self), colours()
        painter.fillRect(self.rect(), qcolour(look.raised))
        edge = QRectF(0, 0, 8, self.height())
        painter.setClipRect(edge)
        painter.setPen(QPen(qcolour(look.warning), 3.0))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        top = -_STRIPE
        while top < self.height() + _STRIPE:
            painter.drawLine(QPointF(-1, top + 9), QPointF(9, top - 1))
            top += _STRIPE
        painter.setClipping(False)
        painter.setPen(qcolour(look.border))
        painter.drawLine(0, self.height() - 1, self.width(), self.height() - 1)
        painter.end()
        super().paintEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        """Follow another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self.update()
        super().changeEvent(event)


class Dated(QWidget):
    """A view below a note, which is seen while there is something to say.

    Parameters
    ----------
    view : what it shows; it has the focus where the panel is given it
    """

    def __init__(self, view: QWidget, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.view, self.note = view, DatedNote()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.note)
        layout.addWidget(view, 1)
        self.setFocusProxy(view)

    def set_note(self, text: str) -> None:
        """Say this above the view; nothing where it is empty."""
        if text != self.note.text():
            self.note.setText(text)
            self.note.setAccessibleName(text)
            self.note.setVisible(bool(text))
