"""What keys and modifiers mean."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QAbstractItemView, QAbstractSlider, QComboBox, QWidget

from app.models.selection import How

_PRESS = (Qt.Key.Key_Space,)
_WAYS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Home, Qt.Key.Key_End)


def how(held: Qt.KeyboardModifier) -> How:
    """What a click does to the selection: Ctrl turns over, Shift adds, neither replaces."""
    if held & Qt.KeyboardModifier.ControlModifier:
        return "toggle"
    return "add" if held & Qt.KeyboardModifier.ShiftModifier else "replace"


class KeysFirst(QObject):
    """Lets a control that has the focus use its own keys before they are shortcuts of the window.

    Space plays, but presses a button that was reached by Tab; arrows step, but move along a slider or a list.
    """

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Claim the key for the control."""
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(watched, QWidget):
            assert isinstance(event, QKeyEvent)
            if event.modifiers() == Qt.KeyboardModifier.NoModifier and _own(watched, event.key()):
                event.accept()
                return True
        return False


def _own(widget: QWidget, key: int) -> bool:
    if isinstance(widget, QAbstractButton):
        return key in _PRESS
    if isinstance(widget, QAbstractSlider):
        return key in _WAYS
    if isinstance(widget, QComboBox | QAbstractItemView):
        return key in (*_PRESS, Qt.Key.Key_Up, Qt.Key.Key_Down)
    return False
