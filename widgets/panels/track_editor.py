"""Beside the curves: ways to fill the gap, what else can be done to a trajectory, proposed edits, lengths of gaps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGridLayout,
    QHeaderView,
    QLabel,
    QPushButton,
    QTabWidget,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.plots.gap_histogram import GapHistogram
from markerscope.widgets.plots.marker_curve_data import ProposalRow, Way

_NAME = Qt.ItemDataRole.UserRole
EDITS = (("tracks.delete", "Delete"), ("tracks.cut", "Cut in two"), ("tracks.join", "Join"),
         ("tracks.exchange", "Exchange"), ("tracks.put_back", "Put back"), ("clean.run", "Run cleaning"))  # fmt: skip
"""Buttons below the ways: the action each does, and its word."""


class TrackEditor(QTabWidget):
    """Three pages; nothing is decided in here.

    Signals
    -------
    way_shown(name) : a way is looked at, "" for none
    asked(action) : a button asks for an action by its id
    proposal_shown(row), accepted(rows), rejected(rows)
    """

    way_shown = Signal(str)
    asked = Signal(str)
    proposal_shown = Signal(int)
    accepted = Signal(list)
    rejected = Signal(list)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Edits of trajectories")
        self.setDocumentMode(True)
        self.heading = QLabel()
        self.heading.setWordWrap(True)
        self.heading.setAlignment(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignLeft)
        self.ways = _table("Ways to fill the gap", ["Fill by", "Expected error"])
        self.ways.currentItemChanged.connect(lambda now, before: self.way_shown.emit(self.way()))
        self.ways.itemActivated.connect(lambda item: self.asked.emit(f"fill.{self.way()}"))
        self.fill = QPushButton("Fill")
        self.fill.clicked.connect(lambda: self.asked.emit(f"fill.{self.way()}" if self.way() else "fill.best"))
        self.buttons: dict[str, QPushButton] = {}
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(4)
        for k, (name, text) in enumerate(EDITS):
            button = self.buttons[name] = QPushButton(text)
            button.clicked.connect(lambda checked=False, name=name: self.asked.emit(name))
            grid.addWidget(button, k // 3, k % 3)
        self.addTab(_page(self.heading, self.ways, self.fill, grid), "Gap")
        self.proposals = _table("Proposed edits", ["Proposed edit", "Time", "State"])
        self.proposals.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.proposals.itemActivated.connect(lambda item: self.proposal_shown.emit(self._row(item)))
        self.proposals.itemClicked.connect(lambda item: self.proposal_shown.emit(self._row(item)))
        self.none = QLabel()
        self.none.setWordWrap(True)
        self.accept, self.reject = QPushButton("Accept"), QPushButton("Reject")
        self.accept.clicked.connect(lambda: self.accepted.emit(self.chosen()))
        self.reject.clicked.connect(lambda: self.rejected.emit(self.chosen()))
        self.run = QPushButton("Run cleaning")
        self.run.clicked.connect(lambda: self.asked.emit("clean.run"))
        row = QGridLayout()
        row.setSpacing(4)
        for k, button in enumerate((self.accept, self.reject, self.run)):
            row.addWidget(button, 0, k)
        self.addTab(_page(self.none, self.proposals, row), "Proposals")
        self.histogram = GapHistogram()
        self.addTab(self.histogram, "Gap lengths")
        for k, tip in enumerate(
            (
                "Fill the gap, or edit the trajectory",
                "Exchanged and broken tracks that the cleaning found",
                "How long the gaps of the selected markers are",
            )
        ):
            self.setTabToolTip(k, tip)
        self.set_gap("", ())
        self.set_proposals((), "")

    def sizeHint(self) -> QSize:
        """Beside the plots."""
        return QSize(round(24 * self.fontMetrics().height()), round(15 * self.fontMetrics().height()))

    def way(self) -> str:
        """The way that is looked at, "" for none."""
        item = self.ways.currentItem()
        return "" if item is None else str(item.data(0, _NAME))

    def set_gap(self, heading: str, ways: Sequence[Way], keep: str = "") -> None:
        """Offer ways to fill a gap; the one called ``keep`` is the current one."""
        self.heading.setText(heading)
        keep = keep or self.way()
        with QSignalBlocker(self.ways):
            self.ways.clear()
            for way in ways:
                item = QTreeWidgetItem(self.ways, [way.title, way.error or ("cannot" if way.why_not else "…")])
                item.setData(0, _NAME, way.name)
                item.setTextAlignment(1, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                item.setDisabled(bool(way.why_not))
                tip = f"{way.help} Not here: {way.why_not}." if way.why_not else way.help
                for column in range(2):
                    item.setToolTip(column, tip)
                if way.name == keep and not way.why_not:
                    self.ways.setCurrentItem(item)
        self.ways.setVisible(bool(ways))

    def set_reasons(self, reasons: Mapping[str, tuple[str, str]]) -> None:
        """Why each action cannot be done now (empty if it can), and what it does, by its id."""
        for name, button in self.buttons.items():
            allow(button, *reasons.get(name, ("", button.text())))
        allow(self.run, *reasons.get("clean.run", ("", "Run cleaning")))
        allow(self.fill, *reasons.get("fill.best", ("", "Fill")))

    def set_proposals(self, rows: Sequence[ProposalRow], none: str) -> None:
        """List proposed edits; ``none`` is said above them, or in their place."""
        chosen = self.chosen()
        with QSignalBlocker(self.proposals):
            self.proposals.clear()
            for k, row in enumerate(rows):
                item = QTreeWidgetItem(self.proposals, [row.sentence, row.time, row.state])
                item.setData(0, _NAME, k)
                item.setToolTip(0, row.sentence)
                item.setSelected(k in chosen)
        self.none.setText(none)
        self.none.setVisible(bool(none))
        open_ones = sum(row.state == "proposed" for row in rows)
        self.setTabText(1, f"Proposals ({open_ones})" if open_ones else "Proposals")
        for button, tip in ((self.accept, "Make the chosen edits"), (self.reject, "Have them not offered any more")):
            allow(button, "" if rows else "none is proposed", tip)

    def chosen(self) -> list[int]:
        """Rows of the proposals that are chosen."""
        return sorted(self._row(item) for item in self.proposals.selectedItems())

    def _row(self, item: QTreeWidgetItem) -> int:
        return int(item.data(0, _NAME))


def _table(name: str, titles: list[str]) -> QTreeWidget:
    made = QTreeWidget()
    made.setAccessibleName(name)
    made.setHeaderLabels(titles)
    made.setRootIsDecorated(False)
    made.setUniformRowHeights(True)
    made.setTextElideMode(Qt.TextElideMode.ElideRight)
    head = made.header()
    head.setStretchLastSection(False)
    head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
    for k in range(1, len(titles)):
        head.setSectionResizeMode(k, QHeaderView.ResizeMode.ResizeToContents)
    return made


def _page(*parts: object) -> QWidget:
    made = QWidget()
    layout = QVBoxLayout(made)
    layout.setContentsMargins(6, 4, 6, 4)
    layout.setSpacing(4)
    for part in parts:
        if isinstance(part, QWidget):
            layout.addWidget(part, 1 if isinstance(part, QTreeWidget) else 0)
        else:
            layout.addLayout(part)  # type: ignore[arg-type]
    return made
