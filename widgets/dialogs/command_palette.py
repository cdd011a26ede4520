"""Every action of the program, found by a few letters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, QRect, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QFrame,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.dialogs.fuzzy import score
from markerscope.widgets.icons import icon
from markerscope.widgets.tables.model import Index
from markerscope.widgets.theme import colours, qcolour

_ENTRY = int(Qt.ItemDataRole.UserRole)


@dataclass(frozen=True)
class PaletteEntry:
    """An action; any object with these attributes will do: ``why_not`` says why it cannot be done now."""

    id: str
    title: str
    shortcut: str = ""
    help: str = ""
    enabled: bool = True
    why_not: str = ""


class _Delegate(QStyledItemDelegate):
    """Title, below it the help or why it cannot be done, and the keys at the right."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw a row."""
        look, entry = colours(), index.data(_ENTRY)
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        rect: QRect = option.rect.adjusted(10, 4, -10, -4)
        if chosen:
            painter.fillRect(option.rect, qcolour(look.accent))
        line = option.fontMetrics.height()
        strong = look.on_accent if chosen else look.text
        weak = look.on_accent if chosen else look.faint
        keys = option.fontMetrics.horizontalAdvance(entry.shortcut) + 12 if entry.shortcut else 0
        painter.setPen(qcolour(strong if entry.enabled else weak, 255 if entry.enabled else 190))
        room = rect.width() - keys
        title = option.fontMetrics.elidedText(entry.title, Qt.TextElideMode.ElideRight, room)
        painter.drawText(QRect(rect.left(), rect.top(), room, line), int(Qt.AlignmentFlag.AlignLeft), title)
        painter.setPen(qcolour(weak))
        painter.drawText(
            QRect(rect.right() - keys, rect.top(), keys, line), int(Qt.AlignmentFlag.AlignRight), entry.shortcut
        )
        below = entry.help if entry.enabled else f"Not now: {entry.why_not}" if entry.why_not else "Not now"
        below = option.fontMetrics.elidedText(below, Qt.TextElideMode.ElideRight, rect.width())
        painter.drawText(
            QRect(rect.left(), rect.top() + line, rect.width(), line), int(Qt.AlignmentFlag.AlignLeft), below
        )

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """Two lines."""
        return QSize(200, 2 * option.fontMetrics.height() + 8)


class CommandPalette(QFrame):
    """A line to type into over a list; Up, Down and Enter choose, Escape leaves.

    Signals
    -------
    chosen(id) : only of actions that can be done now
    closed()
    """

    chosen = Signal(str)
    closed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Search for an action")
        self.line, self.list = QLineEdit(), QListWidget()
        self.line.setPlaceholderText("What do you want to do?")
        self.line.setAccessibleName("Search for an action")
        self.line.addAction(icon("search", "faint"), QLineEdit.ActionPosition.LeadingPosition)
        self.line.textChanged.connect(self._search)
        self.line.installEventFilter(self)
        self.list.setItemDelegate(_Delegate(self.list))
        self.list.setAccessibleName("Actions")
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.itemClicked.connect(lambda item: self._take(item))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.addWidget(self.line)
        layout.addWidget(self.list)
        self._entries: tuple[PaletteEntry, ...] = ()
        if parent is None:
            self.setWindowFlag(Qt.WindowType.Popup)

    def open_with(self, entries: Sequence[PaletteEntry]) -> None:
        """Show the palette over its parent, with all actions as they are now."""
        self._entries = tuple(entries)
        self.line.clear()
        self._search("")
        if (parent := self.parentWidget()) is not None:
            line = self.fontMetrics().height()
            wide = min(max(34 * line, 420), parent.width() - 20)
            top = min(60, parent.height() // 10)
            self.setGeometry((parent.width() - wide) // 2, top, wide, min(26 * line, parent.height() - top - 10))
            self.raise_()
        self.show()
        self.line.setFocus()

    def shown(self) -> list[str]:
        """Ids that fit, the best first."""
        return [self.list.item(k).data(_ENTRY).id for k in range(self.list.count())]

    def sizeHint(self) -> QSize:
        """Ten rows."""
        return QSize(34 * self.fontMetrics().height(), 26 * self.fontMetrics().height())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw a ground that stands out from what is below."""
        painter, look = QPainter(self), colours()
        painter.setPen(qcolour(look.faint))
        painter.setBrush(qcolour(look.raised))
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keys of the list while the line has the focus."""
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.ShortcutOverride:
            if event.key() == Qt.Key.Key_Escape:  # else it is a shortcut of the window
                event.accept()
                return True
        elif isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            key, row = event.key(), self.list.currentRow()
            steps = {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1, Qt.Key.Key_PageDown: 8, Qt.Key.Key_PageUp: -8}
            if key in steps and self.list.count():
                self.list.setCurrentRow(min(max(row + steps[Qt.Key(key)], 0), self.list.count() - 1))
                return True
            if key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self._take(self.list.currentItem())
                return True
            if key == Qt.Key.Key_Escape:
                self._leave()
                return True
        elif event.type() == QEvent.Type.FocusOut and not self.isAncestorOf(self.focusWidget() or self):
            self._leave()
        return super().eventFilter(watched, event)

    def _search(self, text: str) -> None:
        found = []
        for k, entry in enumerate(self._entries):
            by_title, by_help = score(text, entry.title), score(text, entry.help) if len(text) > 2 else None
            best = max(
                (s for s in (by_title, None if by_help is None else by_help - 60) if s is not None), default=None
            )
            if best is not None:
                found.append((-best - (0 if entry.enabled else -20), k))
        self.list.clear()
        for _, k in sorted(found):
            item = QListWidgetItem()
            item.setData(_ENTRY, self._entries[k])
            item.setData(Qt.ItemDataRole.AccessibleTextRole, self._entries[k].title)
            item.setToolTip(self._entries[k].help)
            self.list.addItem(item)
        self.list.setCurrentRow(0)

    def _take(self, item: QListWidgetItem | None) -> None:
        if item is not None and item.data(_ENTRY).enabled:
            self._leave()
            self.chosen.emit(item.data(_ENTRY).id)

    def _leave(self) -> None:
        if self.isVisible():
            self.hide()
            self.closed.emit()
