"""What the user decided, in order, to go back to any point of it."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QFont, QKeyEvent
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.theme import colours, qcolour


class HistoryList(QListWidget):
    """Sentences, the first decision on top; those below the current one were undone and can be redone.

    Signals
    -------
    jump_requested(count) : keep the first ``count`` decisions, 0 for none of them
    """

    jump_requested = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("History")
        self.setWordWrap(True)
        self.setToolTip("Click on a decision to go back to just after it; what is below can be redone")
        self.itemClicked.connect(lambda item: self.jump_requested.emit(self.row(item)))

    def set_history(self, sentences: Sequence[str], done: int, start: str = "As opened") -> None:
        """Show all decisions, of which the first ``done`` hold."""
        self.clear()
        for k, sentence in enumerate([start, *sentences]):
            item = QListWidgetItem(sentence)
            if k == done:
                bold = QFont(self.font())
                bold.setBold(True)
                item.setFont(bold)
                item.setIcon(icon("right", "on_accent"))
            elif k > done:
                item.setForeground(qcolour(colours().faint))
                item.setIcon(icon("redo", "faint"))
                item.setToolTip("Undone; click to redo up to here")
            else:
                item.setIcon(icon("check", "good"))
            self.addItem(item)
        self.setCurrentRow(done)
        self.scrollToItem(self.item(done))

    def sizeHint(self) -> QSize:
        """A dozen lines."""
        return QSize(18 * self.fontMetrics().height(), 14 * self.fontMetrics().height())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Enter goes to the current row."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.currentRow() >= 0:
            self.jump_requested.emit(self.currentRow())
        else:
            super().keyPressEvent(event)
