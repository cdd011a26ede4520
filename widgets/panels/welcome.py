"""What an empty window offers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QPalette
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QScrollArea, QVBoxLayout, QWidget

from markerscope.widgets.icons import icon


@dataclass(frozen=True)
class Recent:
    """A session opened before: its path, its name, where and when in words, and whether it is still there."""

    path: str
    name: str
    where: str = ""
    present: bool = True


class WelcomePage(QWidget):
    """Three ways to begin, and the recent sessions; files can be dropped on it.

    Signals
    -------
    example_wanted(), markers_wanted(), session_wanted()
    recent_chosen(path)
    files_dropped(paths)
    """

    example_wanted = Signal()
    markers_wanted = Signal()
    session_wanted = Signal()
    recent_chosen = Signal(str)
    files_dropped = Signal(list)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Welcome")
        self.setAcceptDrops(True)
        self._title = QLabel("Markerscope")
        self._what = QLabel("From unlabelled optical markers and one ordinary video to a body and its joint angles.")
        self._what.setWordWrap(True)
        self._drop = QLabel("Or drop a marker file (C3D, TRC, CSV) with its video, or a session, here.")
        self._drop.setWordWrap(True)
        self.example = self._button("idea", "Open the example", "A short recording with its video")
        self.markers = self._button("markers", "Open markers...", "Begin a session from a marker file and a video")
        self.session = self._button("open", "Open a session...", "Go on with one that was saved")
        self.example.clicked.connect(self.example_wanted)
        self.markers.clicked.connect(self.markers_wanted)
        self.session.clicked.connect(self.session_wanted)
        self._heading = QLabel("Recent sessions")
        self._recent = QVBoxLayout()
        self._recent.setSpacing(2)
        column = QVBoxLayout()
        column.addStretch(1)
        for part in (self._title, self._what):
            column.addWidget(part)
        column.addSpacing(10)
        for button in (self.example, self.markers, self.session):
            column.addWidget(button)
        column.addSpacing(6)
        column.addWidget(self._drop)
        column.addSpacing(14)
        column.addWidget(self._heading)
        column.addLayout(self._recent)
        column.addStretch(2)
        inner, page = QWidget(), QWidget()
        page.setLayout(column)
        page.setMaximumWidth(48 * self.fontMetrics().height())
        middle = QHBoxLayout(inner)
        middle.addStretch(1)
        middle.addWidget(page, 100)
        middle.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setWidget(inner)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(scroll)
        self.set_recent([])
        self._paint()

    def set_recent(self, recent: Sequence[Recent]) -> None:
        """Offer these sessions, the latest first."""
        while (item := self._recent.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        self._heading.setVisible(bool(recent))
        for entry in recent:
            text = f"{entry.name}   {entry.where}" if entry.present else f"{entry.name}   not found: {entry.path}"
            button = QPushButton(icon("history", "faint"), text)
            button.setFlat(True)
            button.setEnabled(entry.present)
            button.setStyleSheet("text-align: left; padding: 4px;")
            button.setToolTip(entry.path)
            button.setAccessibleName(f"Open {entry.name}")
            button.clicked.connect(lambda _=False, path=entry.path: self.recent_chosen.emit(path))
            self._recent.addWidget(button)

    def recent_buttons(self) -> list[QPushButton]:
        """One a recent session."""
        items = [self._recent.itemAt(k) for k in range(self._recent.count())]
        return [w for item in items if item is not None and isinstance(w := item.widget(), QPushButton)]

    def sizeHint(self) -> QSize:
        """A page."""
        return QSize(760, 560)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Tell which."""
        paths = [url.toLocalFile() for url in event.mimeData().urls() if url.isLocalFile()]
        if paths:
            event.acceptProposedAction()
            self.files_dropped.emit(paths)

    def changeEvent(self, event: QEvent) -> None:
        """Follow another size of text."""
        if event.type() == QEvent.Type.FontChange and hasattr(self, "_drop"):
            self._paint()
        super().changeEvent(event)

    def _button(self, glyph: str, text: str, tip: str) -> QPushButton:
        button = QPushButton(icon(glyph, "accent"), f"  {text}")
        side = round(1.6 * self.fontMetrics().height())
        button.setIconSize(QSize(side, side))
        button.setMinimumHeight(round(2.6 * self.fontMetrics().height()))
        button.setStyleSheet("text-align: left; padding-left: 12px;")
        button.setToolTip(tip)
        button.setAccessibleName(text)
        button.setCursor(Qt.CursorShape.PointingHandCursor)
        return button

    def _paint(self) -> None:
        # As style sheets: fonts that are set are lost when the page is given to a window.
        self._title.setStyleSheet(f"font-size: {1.9 * self.font().pointSizeF():.1f}pt; font-weight: bold")
        self._heading.setStyleSheet("font-weight: bold")
        self._drop.setForegroundRole(QPalette.ColorRole.PlaceholderText)
