"""A button that opens a menu, and says so by an arrow behind its word."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu, QToolButton, QWidget


def menu_button(text: str, tip: str, menu: QMenu | None = None, parent: QWidget | None = None) -> QToolButton:
    """The button; it gets an empty menu where none is given."""
    button = QToolButton(parent)
    button.setText(f"{text} ▾")  # the style's own arrow stands on the last letter
    button.setStyleSheet("QToolButton::menu-indicator { image: none; }")
    button.setAccessibleName(text)
    button.setToolTip(tip)
    button.setAutoRaise(True)
    button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
    button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    if menu is None:
        menu = QMenu(button)
    menu.setToolTipsVisible(True)
    button.setMenu(menu)
    return button
