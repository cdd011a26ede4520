"""All keys on one sheet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.theme import colours


class ShortcutSheet(QDialog):
    """Groups of actions with their keys, in columns."""

    def __init__(self, groups: Mapping[str, Sequence[tuple[str, str]]], parent: QWidget | None = None) -> None:
        """Make the sheet.

        Parameters
        ----------
        groups : by title, (keys, what they do)
        """
        super().__init__(parent)
        self.setWindowTitle("Keyboard shortcuts")
        self.setAccessibleName("Keyboard shortcuts")
        columns: list[list[tuple[str, Sequence[tuple[str, str]]]]] = [[], []]
        lengths = [0, 0]
        for title, rows in groups.items():
            shorter = int(lengths[1] < lengths[0])
            columns[shorter].append((title, rows))
            lengths[shorter] += len(rows) + 2
        inner = QWidget()
        sheet = QHBoxLayout(inner)
        sheet.setSpacing(28)
        for column in columns:
            part = QVBoxLayout()
            part.setSpacing(4)
            for title, rows in column:
                part.addWidget(_heading(title))
                part.addLayout(_rows(rows))
                part.addSpacing(8)
            part.addStretch(1)
            sheet.addLayout(part, 1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setWidget(inner)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Close)
        buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(scroll, 1)
        layout.addWidget(buttons)
        self._inner = inner

    def sizeHint(self) -> QSize:
        """All of it where the screen allows."""
        inner = self._inner.sizeHint()
        return QSize(min(inner.width() + 50, 1100), min(inner.height() + 90, 760))


def _heading(text: str) -> QLabel:
    label = QLabel(text)
    bold = QFont(label.font())
    bold.setBold(True)
    label.setFont(bold)
    return label


def _rows(rows: Sequence[tuple[str, str]]) -> QGridLayout:
    grid, look = QGridLayout(), colours()
    grid.setColumnStretch(1, 1)
    grid.setHorizontalSpacing(12)
    grid.setVerticalSpacing(4)
    for row, (keys, what) in enumerate(rows):
        key, text = QLabel(keys), QLabel(what)
        key.setStyleSheet(
            f"border: 1px solid rgb{look.border}; border-radius: 3px; padding: 1px 5px; background: rgb{look.base};"
        )
        grid.addWidget(key, row, 0, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        grid.addWidget(text, row, 1)
    return grid
