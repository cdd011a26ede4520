"""What went wrong, where, and what to do about it: above the work, never in front of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QFont, QKeyEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.theme import colours, qcolour

Level = Literal["error", "warning", "info", "good"]
_MOST = 3
_WORDS = {"error": "Error", "warning": "Warning", "info": "Note", "good": "Done"}
_INKS = {"error": "error", "warning": "warning", "info": "accent", "good": "good"}


@dataclass(frozen=True)
class Message:
    """One message.

    Attributes
    ----------
    level : how bad it is
    what : what happened, a sentence
    where : stage, file, marker or frame; "" if nowhere in particular
    remedy : what to do, "" if nothing
    action : title of a button that does it, "" for none
    key : a later message of the same key replaces it; by default the sentence itself
    """

    level: Level
    what: str
    where: str = ""
    remedy: str = ""
    action: str = ""
    key: str = ""


class MessageRow(QFrame):
    """One message with a sign, a word, and a way to put it away."""

    closed = Signal(object)
    action_wanted = Signal(object)

    def __init__(self, message: Message, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.message = message
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setAccessibleName(f"{_WORDS[message.level]}: {self.sentence()}")
        self._sign, self._text = QLabel(), QLabel()
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.TextFormat.PlainText)
        self._text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._text.setText(self.sentence())
        self._text.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        word = QLabel(_WORDS[message.level])
        bold = QFont(word.font())
        bold.setBold(True)
        word.setFont(bold)
        self._word = word
        close = QToolButton()
        close.setIcon(icon("close"))
        close.setAutoRaise(True)
        close.setToolTip("Put away (Escape)")
        close.setAccessibleName("Put away")
        close.clicked.connect(lambda: self.closed.emit(self))
        self.close_button = close
        layout = QHBoxLayout(self)
        layout.setContentsMargins(12, 4, 4, 4)
        layout.addWidget(self._sign)
        layout.addWidget(word)
        layout.addWidget(self._text, 1)
        if message.action:
            self.action_button = QPushButton(message.action)
            self.action_button.clicked.connect(lambda: self.action_wanted.emit(self))
            layout.addWidget(self.action_button)
        layout.addWidget(close)
        self._paint()

    def sentence(self) -> str:
        """All of it."""
        message = self.message
        where = f"{message.where}: " if message.where else ""
        what = message.what.rstrip(".") if where else (message.what[:1].upper() + message.what[1:]).rstrip(".")
        remedy = message.remedy[:1].upper() + message.remedy[1:]
        remedy = remedy if not remedy or remedy.endswith(".") else f"{remedy}."
        return f"{where}{what}. {remedy}".strip()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw a ground with an edge in the colour of the level."""
        painter, look = QPainter(self), colours()
        painter.setPen(qcolour(look.accent if self.hasFocus() else look.border))
        painter.setBrush(qcolour(look.raised))
        painter.drawRect(self.rect().adjusted(0, 0, -1, -1))
        painter.fillRect(0, 0, 4, self.height(), qcolour(getattr(look, _INKS[self.message.level])))

    def event(self, event: QEvent) -> bool:
        """Escape belongs to the message that has the focus, not to the window."""
        asked = isinstance(event, QKeyEvent) and event.type() == QEvent.Type.ShortcutOverride
        if asked and event.key() == Qt.Key.Key_Escape:  # type: ignore[attr-defined]
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape puts it away."""
        if event.key() == Qt.Key.Key_Escape:
            self.closed.emit(self)
        else:
            super().keyPressEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        """Follow another theme."""
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "_word"):
            self._paint()
        super().changeEvent(event)

    def _paint(self) -> None:
        ink = _INKS[self.message.level]
        side = self.fontMetrics().height()
        glyph = self.message.level
        self._sign.setPixmap(icon(glyph, ink).pixmap(QSize(side, side), self.devicePixelRatioF()))
        self._word.setStyleSheet(f"color: rgb{getattr(colours(), ink)}")


class MessageBar(QWidget):
    """The latest messages below each other; nothing waits for them, and no height is taken while there is none.

    Signals
    -------
    closed(message), action_wanted(message)
    """

    closed = Signal(object)
    action_wanted = Signal(object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Messages")
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(2)
        self._rows: list[MessageRow] = []
        self.hide()

    def show_message(self, message: Message) -> None:
        """Show one on top; of more than three, the oldest that is no error goes."""
        key = message.key or message.what
        for row in [row for row in self._rows if (row.message.key or row.message.what) == key]:
            self._drop(row)
        row = MessageRow(message)
        row.closed.connect(self._close)
        row.action_wanted.connect(self._act)  # no lambda: it would hold the bar, and let go of it inside a deletion
        self._rows.insert(0, row)
        self._layout.insertWidget(0, row)
        while len(self._rows) > _MOST:
            mild = [row for row in self._rows[1:] if row.message.level != "error"]
            self._drop(mild[-1] if mild else self._rows[-1])
        self.show()

    def clear(self, key: str = "") -> None:
        """Put away all messages, or those of one key."""
        for row in [row for row in self._rows if not key or (row.message.key or row.message.what) == key]:
            self._drop(row)

    def messages(self) -> list[Message]:
        """What is shown, the latest first."""
        return [row.message for row in self._rows]

    def rows(self) -> list[MessageRow]:
        """The rows, top down."""
        return list(self._rows)

    def _act(self, row: MessageRow) -> None:
        self.action_wanted.emit(row.message)

    def _close(self, row: MessageRow) -> None:
        self._drop(row)
        self.closed.emit(row.message)

    def _drop(self, row: MessageRow) -> None:
        self._rows.remove(row)
        self._layout.removeWidget(row)
        row.hide()
        row.deleteLater()
        self.setVisible(bool(self._rows))
