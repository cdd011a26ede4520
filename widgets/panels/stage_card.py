"""One stage: how it stands, what it found, what is set, and what it found before under other settings."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QFont, QPalette
from PySide6.QtWidgets import (
    QCheckBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.panels.bar import show_part
from markerscope.widgets.panels.fields import SettingsForm
from markerscope.widgets.panels.glance_bar import link
from markerscope.widgets.panels.stage_data import MEANING, EarlierResult, StageData, StageProgress, duration, left
from markerscope.widgets.theme import colours

_WORDS = {"not run": "to do", "cached": "done", "check": "to check", "stale": "out of date"}
"""What a state is called where that is another word."""
_LOOK = {
    "not run": ("not_run", "faint"),
    "cached": ("cached", "good"),
    "check": ("warning", "warning"),
    "stale": ("stale", "faint"),
    "running": ("running", "accent"),
    "failed": ("failed", "error"),
}


class StageCard(QFrame):
    """A card that opens to its settings and earlier results.

    Signals
    -------
    run(name), run_to(name) : this stage, also where it is there; what is missing of all stages down to this one
    stop() : the run in progress
    setting_changed(name, field, value)
    earlier_chosen(name, key) : go back to this result
    compare_toggled(name, key, on) : show it beside the one in force
    opened(name, open) : the card was opened or closed
    check_chosen(name, row) : show what one of the things to check is about
    """

    run = Signal(str)
    run_to = Signal(str)
    stop = Signal()
    setting_changed = Signal(str, str, object)
    earlier_chosen = Signal(str, str)
    compare_toggled = Signal(str, str, bool)
    opened = Signal(str, bool)
    check_chosen = Signal(str, int)

    def __init__(self, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.name = name
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.setAutoFillBackground(True)
        self.setBackgroundRole(QPalette.ColorRole.AlternateBase)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        self._data = StageData(name, name)
        self._shown: StageData | None = None
        self._icon, self._title, self._state, self._seconds = QLabel(), QLabel(), QLabel(), QLabel()
        self._headline = QLabel()
        self._headline.setWordWrap(True)
        self._headline.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._checks, self._note = QLabel(), QLabel()
        self._checks.setWordWrap(True)
        self._checks.setTextFormat(Qt.TextFormat.RichText)
        by = Qt.TextInteractionFlag
        self._checks.setTextInteractionFlags(by.LinksAccessibleByMouse | by.LinksAccessibleByKeyboard)
        self._checks.setAccessibleName("To check")
        self._checks.linkActivated.connect(lambda row: self.check_chosen.emit(self.name, int(row)))
        self._note.setWordWrap(True)
        self._note.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self.toggle = QToolButton()
        self.toggle.setAutoRaise(True)
        self.toggle.setCheckable(True)
        self.toggle.toggled.connect(self._open)
        self.bar, self._left, self.stop_button = QProgressBar(), QLabel(), QPushButton(icon("stop"), "Stop")
        self._left.setWordWrap(True)
        for label in (self._seconds, self._left):
            label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self.stop_button.setToolTip("End the run; what was computed before stays")
        self.stop_button.clicked.connect(self.stop)
        self.form = SettingsForm()
        self.form.changed.connect(lambda field, value: self.setting_changed.emit(self.name, field, value))
        self.run_button, self.run_to_button = (
            QPushButton(icon("run"), "Run"),
            QPushButton(icon("run_to"), "Run to here"),
        )
        self.run_button.clicked.connect(lambda: self.run.emit(self.name))
        self.run_to_button.clicked.connect(lambda: self.run_to.emit(self.name))
        self._earlier = QVBoxLayout()
        self._earlier_shown: tuple[EarlierResult, ...] | None = None
        self._lay_out()
        self._open(False)

    def _lay_out(self) -> None:
        bold = QFont(self.font())
        bold.setBold(True)
        self._title.setFont(bold)
        head = QHBoxLayout()
        head.setSpacing(6)
        for part in (self._icon, self._title, self._state):
            head.addWidget(part)
        head.addStretch(1)
        head.addWidget(self._seconds)
        head.addWidget(self.toggle)
        self._running = QWidget()
        progress = QVBoxLayout(self._running)
        progress.setContentsMargins(0, 0, 0, 0)
        row = QHBoxLayout()
        row.addWidget(self.bar, 1)
        row.addWidget(self.stop_button)
        progress.addLayout(row)
        progress.addWidget(self._left)
        self._details = QWidget()
        details = QVBoxLayout(self._details)
        details.setContentsMargins(0, 4, 0, 0)
        details.addWidget(self.form)
        buttons = QHBoxLayout()
        buttons.addWidget(self.run_button)
        buttons.addWidget(self.run_to_button)
        buttons.addStretch(1)
        details.addLayout(buttons)
        details.addLayout(self._earlier)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(10, 6, 8, 8)
        outer.setSpacing(4)
        outer.addLayout(head)
        outer.addWidget(self._headline)
        outer.addWidget(self._checks)
        outer.addWidget(self._note)
        outer.addWidget(self._running)
        outer.addWidget(self._details)
        self._running.hide()

    def set_data(self, data: StageData) -> None:
        """Show how the stage stands."""
        if data == self._shown:
            if self.is_open():
                self.form.set_fields(data.fields)  # a value that was not taken gives way to the one in force
            return
        self._data = self._shown = data
        self.setAccessibleName(f"{data.title}: {_WORDS.get(data.state, data.state)}")
        self._title.setText(data.title)
        self._title.setToolTip(data.help)
        self._state.setText(_WORDS.get(data.state, data.state))
        self._state.setToolTip(MEANING[data.state])
        self._seconds.setText("" if data.seconds is None else duration(data.seconds))
        self._seconds.setToolTip("How long it took to compute")
        self._headline.setText(data.headline)
        self._headline.setVisible(bool(data.headline))
        self._checks.setVisible(bool(data.checks))
        self._note.setText(data.note)
        self._note.setVisible(bool(data.note))
        self._running.setVisible(data.state == "running")
        there = "once more: its result is there already" if data.state in ("cached", "check") else "now"
        alone = f"Compute this stage {there}. What it is computed from is computed only where it is missing."
        down = "Compute what is missing of the stages from the first down to this one. What is there stays as it is."
        for button, what in ((self.run_button, alone), (self.run_to_button, down)):
            allow(button, data.why_not, what)
        if self.is_open():
            self._fill_details()
        self._paint()

    def set_progress(self, progress: StageProgress) -> None:
        """Show how far it is."""
        show_part(self.bar, progress.part)
        parts = [progress.text, "" if progress.seconds_left is None else left(progress.seconds_left)]
        self._left.setText(", ".join(part for part in parts if part))
        self._left.setVisible(bool(self._left.text()))

    def is_open(self) -> bool:
        """Whether settings are shown."""
        return self.toggle.isChecked()

    def set_open(self, on: bool) -> None:
        """Show or hide settings and earlier results."""
        self.toggle.setChecked(on)

    def earlier_rows(self) -> list[QWidget]:
        """The rows of earlier results, below their title."""
        items = [self._earlier.itemAt(k) for k in range(1, self._earlier.count())]
        return [row for item in items if item is not None and (row := item.widget()) is not None]

    def changeEvent(self, event: QEvent) -> None:
        """Follow another theme or font."""
        if event.type() in (QEvent.Type.PaletteChange, QEvent.Type.FontChange) and hasattr(self, "_details"):
            bold = QFont(self.font())
            bold.setBold(True)
            self._title.setFont(bold)
            self._paint()
            if event.type() == QEvent.Type.FontChange and self._earlier_shown:
                results, self._earlier_shown = self._earlier_shown, None
                self._show_earlier(results)
        super().changeEvent(event)

    def _fill_details(self) -> None:
        """Settings and earlier results; only of an open card, since all of them take longer than a picture may."""
        self.form.set_fields(self._data.fields)
        self.form.setVisible(bool(self._data.fields))
        self._show_earlier(self._data.earlier)

    def _open(self, on: bool) -> None:
        if on:
            self._fill_details()
        self._details.setVisible(on)
        self.toggle.setIcon(icon("up" if on else "down"))
        self.toggle.setToolTip("Hide the settings" if on else "Show the settings and earlier results")
        self.toggle.setAccessibleName(self.toggle.toolTip())
        self.opened.emit(self.name, on)

    def _paint(self) -> None:
        look = colours()
        glyph, ink = _LOOK[self._data.state]
        side = self.fontMetrics().height()
        self._icon.setPixmap(icon(glyph, ink).pixmap(QSize(side, side), self.devicePixelRatioF()))
        self._checks.setText("<br>".join(link(row, text) for row, text in enumerate(self._data.checks)))
        self._state.setStyleSheet(f"color: rgb{getattr(look, ink)}")
        self._headline.setStyleSheet(f"color: rgb{look.error if self._data.state == 'failed' else look.text}")

    def _show_earlier(self, results: tuple[EarlierResult, ...]) -> None:
        if results == self._earlier_shown:
            return
        self._earlier_shown = results
        while (item := self._earlier.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        if not results:
            return
        title = QLabel("Results in store")
        title.setToolTip("Go back to one at once, or tick those to be shown beside the one in force")
        self._earlier.addWidget(title)
        for result in results:
            self._earlier.addWidget(self._row(result))

    def _row(self, result: EarlierResult) -> QWidget:
        row = QWidget()
        layout = QHBoxLayout(row)
        layout.setContentsMargins(0, 0, 0, 0)
        compare = QCheckBox()
        compare.setChecked(result.compared or result.current)
        compare.setEnabled(not result.current)
        compare.setToolTip("Show it beside the one in force" if not result.current else "The one in force")
        compare.setAccessibleName(f"Compare: {result.settings}")
        compare.toggled.connect(partial(self.compare_toggled.emit, self.name, result.key))
        text = QLabel(
            f"{result.settings}\n{', '.join(part for part in (result.headline, result.when) if part)}".strip()
        )
        text.setWordWrap(True)
        text.setMinimumHeight(text.heightForWidth(max(self.width() - 9 * self.fontMetrics().height(), 60)))
        use: QWidget
        if result.current:
            use = QLabel("in force")
        else:
            use = button = QPushButton("Use")
            button.setAccessibleName(f"Use: {result.settings}")
            button.setToolTip("Set the stage as it was for this result, which is there at once; can be undone")
            button.clicked.connect(partial(self.earlier_chosen.emit, self.name, result.key))
        layout.addWidget(compare, 0, Qt.AlignmentFlag.AlignTop)
        layout.addWidget(text, 1)
        layout.addWidget(use, 0, Qt.AlignmentFlag.AlignTop)
        return row
