"""What keys and modifiers mean."""

from __future__ import annotations

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QAbstractItemView, QAbstractSlider, QApplication, QComboBox, QWidget

from markerscope.app.models.selection import How

_PRESS = (Qt.Key.Key_Space,)
_WAYS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Home, Qt.Key.Key_End)


def how(held: Qt.KeyboardModifier) -> How:
    """What a click does to the selection: Ctrl turns over, Shift adds, neither replaces."""
    if held & Qt.KeyboardModifier.ControlModifier:
        return "toggle"
    return "add" if held & Qt.KeyboardModifier.ShiftModifier else "replace"


def wants(event: QEvent) -> bool:
    """Whether a key that is about to become a shortcut of the window belongs to the control that has the focus.

    Space plays, but presses a button that was reached by Tab; arrows step, but move along a slider or a list.
    """
    if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
        return False
    focus = QApplication.focusWidget()
    return focus is not None and event.modifiers() == Qt.KeyboardModifier.NoModifier and _own(focus, event.key())


def _own(widget: QWidget, key: int) -> bool:
    if isinstance(widget, QAbstractButton):
        return key in _PRESS
    if isinstance(widget, QAbstractSlider):
        return key in _WAYS
    if isinstance(widget, QComboBox | QAbstractItemView):
        return key in (*_PRESS, Qt.Key.Key_Up, Qt.Key.Key_Down)
    return False
