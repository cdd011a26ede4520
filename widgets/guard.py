"""Painting that goes wrong becomes a message: Qt would end the program."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps

from PySide6.QtCore import QRectF, Qt, QTimer
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets import theme


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
        paint_words(self._widget, said)
        if said != self._told:
            self._told = said
            QTimer.singleShot(0, self._widget, lambda: self._tell(said))


def guard_paints(tell: Callable[[Exception], object], package: str = "markerscope.widgets.") -> None:
    """Have every widget class of a package that is known by now paint under guard; a class is guarded once.

    Parameters
    ----------
    tell : called with what went wrong, never while a widget is painted
    """
    classes: list[type[QWidget]] = [QWidget]
    while classes:
        kind = classes.pop()
        classes += kind.__subclasses__()
        paint = kind.__dict__.get("paintEvent")
        if kind.__module__.startswith(package) and paint is not None and not hasattr(paint, "__wrapped__"):
            kind.paintEvent = _guarded(paint, tell)  # type: ignore[method-assign]


def end_painters(error: BaseException) -> None:
    """End the painters of the functions that an error went through: one left open ends the program as Qt shows it."""
    trace = error.__traceback__
    while trace is not None:
        for value in list(trace.tb_frame.f_locals.values()):
            if isinstance(value, QPainter) and value.isActive():
                value.end()
        trace = trace.tb_next


def paint_words(widget: QWidget, said: str) -> None:
    """Fill a widget with a sentence on what went wrong."""
    look = theme.colours()
    painter = QPainter(widget)
    painter.fillRect(widget.rect(), theme.qcolour(look.base))
    painter.setPen(theme.qcolour(look.error))
    box = QRectF(widget.rect()).adjusted(16, 16, -16, -16)
    painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), said)
    painter.end()


def _guarded(
    paint: Callable[[QWidget, QPaintEvent], None], tell: Callable[[Exception], object]
) -> Callable[[QWidget, QPaintEvent], None]:
    @wraps(paint)
    def guarded(self: QWidget, event: QPaintEvent) -> None:
        try:
            paint(self, event)
        except Exception as error:
            failed = error  # the name of the clause ends with it
            end_painters(failed)
            paint_words(self, f"This cannot be drawn: {failed or type(failed).__name__}")
            QTimer.singleShot(0, self, lambda: tell(failed))

    return guarded
