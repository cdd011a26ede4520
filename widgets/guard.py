"""Painting that goes wrong becomes a message: Qt would end the program."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QWidget

from widgets import theme


class PaintGuard:
    """Paints one widget.

    Parameters
    ----------
    widget : that is painted
    name : what to call it in the message
    tell : called with the message, once as long as it stays the same; never while the widget is painted
    """

    def __init__(self, widget: QWidget, name: str, tell: Callable[[str], object]) -> None:
        self._widget, self._name, self._tell = widget, name, tell
        self._told = ""

    def paint(self, draw: Callable[[QPainter], object]) -> None:
        """Have ``draw`` paint the widget, or paint why it could not."""
        painter = QPainter(self._widget)
        try:
            draw(painter)
        except Exception as error:
            said = f"{self._name} cannot be drawn: {error or type(error).__name__}"
        else:
            self._told = ""
            return
        finally:
            painter.end()
        self._paint_words(said)
        if said != self._told:
            self._told = said
            QTimer.singleShot(0, self._widget, lambda: self._tell(said))

    def _paint_words(self, said: str) -> None:
        look = theme.colours()
        painter = QPainter(self._widget)
        painter.fillRect(self._widget.rect(), theme.qcolour(look.base))
        painter.setPen(theme.qcolour(look.error))
        box = QRectF(self._widget.rect()).adjusted(16, 16, -16, -16)
        painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), said)
        painter.end()
