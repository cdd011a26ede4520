"""Above the stages: what a solve would do or does now, the figures of the answer, and what of it is to check."""

from __future__ import annotations

import html
from dataclasses import dataclass

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPushButton, QSizePolicy, QVBoxLayout, QWidget

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.theme import colours

_MOST = 3
"""Things to check that are listed here; the others stand on the cards."""


@dataclass(frozen=True)
class Tile:
    """One figure: what it is, its value with its unit, how to read it, and whether it is to check."""

    label: str
    value: str
    note: str = ""
    check: bool = False


@dataclass(frozen=True)
class GlanceData:
    """All that the bar shows.

    Attributes
    ----------
    plan : what Solve would do and about how long it takes, or what is done now
    running : whether something runs
    why_not : why Solve cannot be pressed, a clause; empty if it can
    tiles : the figures of the answer
    old : whether they are of before a change
    checks : what is to check, one sentence each
    failed : why the last run ended, a sentence; empty where it did not fail
    """

    plan: str = ""
    running: bool = False
    why_not: str = ""
    tiles: tuple[Tile, ...] = ()
    old: bool = False
    checks: tuple[str, ...] = ()
    failed: str = ""


class GlanceBar(QFrame):
    """The bar.

    Signals
    -------
    solve(), stop()
    check_chosen(row) : show what this is about
    """

    solve = Signal()
    stop = Signal()
    check_chosen = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("At a glance")
        self._shown = GlanceData()
        self.solve_button, self.stop_button = QPushButton(icon("run"), "Solve"), QPushButton(icon("stop"), "Stop")
        self.solve_button.clicked.connect(self.solve)
        self.stop_button.clicked.connect(self.stop)
        self.plan = _wrapping("What Solve does")
        self.checks = _wrapping("To check")
        self.checks.setTextFormat(Qt.TextFormat.RichText)
        self.checks.setTextInteractionFlags(Qt.TextInteractionFlag.LinksAccessibleByMouse
                                            | Qt.TextInteractionFlag.LinksAccessibleByKeyboard)  # fmt: skip
        self.checks.linkActivated.connect(lambda link: self.check_chosen.emit(int(link)))
        self._tiles, self._grid = QWidget(), QGridLayout()
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setVerticalSpacing(2)
        self._grid.setColumnStretch(1, 1)
        self._tiles.setLayout(self._grid)
        head = QHBoxLayout()
        head.addWidget(self.solve_button, 0, Qt.AlignmentFlag.AlignTop)
        head.addWidget(self.plan, 1)
        head.addWidget(self.stop_button, 0, Qt.AlignmentFlag.AlignTop)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(10, 8, 10, 6)
        outer.setSpacing(4)
        outer.addLayout(head)
        outer.addWidget(self._tiles)
        outer.addWidget(self.checks)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self.set_data(GlanceData(why_not="no session is open"))

    def set_data(self, data: GlanceData) -> None:
        """Show this."""
        if data == self._shown:
            return
        before, self._shown = self._shown, data
        self.solve_button.setVisible(not data.running)
        self.stop_button.setVisible(data.running)
        allow(self.solve_button, data.why_not, f"{data.plan} (F5)")
        self.stop_button.setToolTip("End the run; what was computed before stays")
        self.plan.setText(data.plan or data.why_not)
        if (before.tiles, before.old) != (data.tiles, data.old):
            self._fill()
        self._say()

    def tiles(self) -> list[tuple[str, str]]:
        """Label and value of each figure, as shown."""
        return [(tile.label, tile.value) for tile in self._shown.tiles]

    def changeEvent(self, event: QEvent) -> None:
        """Follow another theme."""
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "_grid"):
            self._fill()
            self._say()
        super().changeEvent(event)

    def _fill(self) -> None:
        while (item := self._grid.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        look = colours()
        for row, tile in enumerate(self._shown.tiles):
            name, value = QLabel(tile.label), _wrapping(f"{tile.label}: {tile.value}")
            name.setStyleSheet(f"color: rgb{look.faint}")
            ink = look.warning if tile.check else look.faint if self._shown.old else look.text
            value.setStyleSheet(f"color: rgb{ink}; font-weight: 600")
            value.setText(f"{tile.value}, out of date" if self._shown.old and row == 0 else tile.value)
            for label in (name, value):
                label.setToolTip(f"{tile.label}: {tile.value}. {tile.note[:1].upper()}{tile.note[1:]}".strip())
            self._grid.addWidget(name, row, 0, Qt.AlignmentFlag.AlignTop)
            self._grid.addWidget(value, row, 1)
        self._tiles.setVisible(bool(self._shown.tiles))

    def _say(self) -> None:
        data, look = self._shown, colours()
        lines = [f"<span style='color: rgb{look.error}'>{html.escape(data.failed)}</span>"] if data.failed else []
        if data.checks:
            count = len(data.checks)
            lines.append(f"<b style='color: rgb{look.warning}'>{count} to check</b>")
            lines += [link(i, text) for i, text in enumerate(data.checks[:_MOST])]
            if count > _MOST:
                lines.append(f"and {count - _MOST} more on the stages below")
        elif data.tiles and not data.old and not data.running:
            lines.append(f"<span style='color: rgb{look.good}'>Nothing speaks against this answer.</span>")
        self.checks.setText("<br>".join(lines))
        self.checks.setVisible(bool(lines))


def link(row: int, text: str) -> str:
    """A sentence to click, in the ink of a warning."""
    return f"<a href='{row}' style='color: rgb{colours().warning}'>{html.escape(text)}</a>"


class _Wrapped(QLabel):
    """Words that wrap, with all the height that they need at the width they have."""

    def setText(self, text: str) -> None:
        """Show it."""
        super().setText(text)
        self._grow()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Need another height at another width."""
        super().resizeEvent(event)
        self._grow()

    def _grow(self) -> None:
        needed = self.heightForWidth(self.width())
        if needed != self.minimumHeight():
            self.setMinimumHeight(max(needed, 0))


def _wrapping(name: str) -> QLabel:
    label = _Wrapped()
    label.setWordWrap(True)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setAccessibleName(name)
    return label
