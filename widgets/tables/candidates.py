"""The chains of bones that the groups could be, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QAbstractButton,
    QButtonGroup,
    QHBoxLayout,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.plots.scales import HEADING, degrees, figure
from markerscope.widgets.tables.array_table import ArrayTable
from markerscope.widgets.tables.candidate_data import CandidateRecord, SearchStep
from markerscope.widgets.tables.columns import Column

MARGIN = "Score over that of the best: near 1 they tie. None where the two were not scored on the same frames"


def candidate_columns(
    rows: Sequence[CandidateRecord],
    score: str = "Score",
    unit: str = "",
    colours: np.ndarray | None = None,
    meaning: str = "",
) -> list[Column]:
    """The table of candidates, given what they are ranked by; ``colours`` (N, 3) uint8 are those of their ghosts."""

    def figures(name: str, factor: float = 1.0) -> np.ndarray:
        return factor * np.array([getattr(row, name) for row in rows], float)

    states = [f"{row.fate}, same as 1" if row.same_as_first else row.fate for row in rows]
    states = [f"{state}: repeats chain {row.repeats}" if row.repeats else state for state, row in zip(states, rows)]
    states = [f"{state}, in use" if row.in_use else state for state, row in zip(states, rows)]
    columns = [
        _numbers(rows, colours),
        Column(
            "Differs by",
            [", ".join(row.differs) for row in rows],
            tooltip="The bones that not every row has, those of the fewest rows first",
            tips=[", ".join(row.differs) for row in rows],
        ),
        Column(
            "Bones",
            [row.part for row in rows],
            tooltip="The part of the body that the groups are taken for",
            tips=[", ".join(row.bones) for row in rows],
        ),
        Column(score, figures("score"), unit, figure, meaning or "What the candidates are ranked by, the least first"),
        Column("Margin", figures("margin"), "× best", ".2f", MARGIN),
        Column("E_S", figures("energy"), "", figure, "Energy of laying it over the markers (equations 1 and 2)"),
        Column("Markers", figures("covered", 100), "%", ".0f", "Share of the markers that it explains", bar=(0, 100)),
        Column("Camera heading", figures("heading_deg"), "°", degrees, HEADING),
        Column("Start yaw", figures("yaw_deg"), "°", degrees, "Turn about the vertical that it was started from"),
        Column("Distance", figures("distance"), "mm", ".0f", "From the markers to the body as first laid over them"),
        Column("State", states, tooltip="How far the search took it"),
    ]
    if any(row.chain for row in rows):
        numbers = [row.chain or float("nan") for row in rows]
        columns.insert(1, Column("Chain", np.array(numbers, float), "", ".0f", "Number of the chain of bones"))
    else:
        columns = [column for column in columns if column.title != "E_S"]
    return [replace(column, none="") for column in columns]


def _numbers(rows: Sequence[CandidateRecord], colours: np.ndarray | None) -> Column:
    """The candidates' numbers, by which all views call them; their places for as long as none has one."""
    numbers = np.array([row.number for row in rows], float)
    if not numbers.any():
        return Column("Rank", np.arange(1, len(rows) + 1), tooltip="Place, the best first", colours=colours)
    tip = "The candidate's number in every view and in the report, the best first; none for what went no further"
    return Column("No.", np.where(numbers > 0, numbers, np.nan), "", ".0f", tip, colours=colours)


class CandidateTable(QWidget):
    """A table that fills while the search runs, and buttons for its steps.

    Signals
    -------
    row_selected(row), row_activated(row), pin_requested(row) : as of :class:`ArrayTable`
    step_chosen(name) : show what the search had after this step
    rows_kept() : other rows are shown, after a step was chosen or words to filter by were typed
    """

    row_selected = Signal(int)
    row_activated = Signal(int)
    pin_requested = Signal(int)
    step_chosen = Signal(str)
    rows_kept = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Candidates")
        self.table = ArrayTable("Candidates", can_pin=True)
        self.pin_button = QPushButton(icon("pin"), "Pin")
        self.pin_button.clicked.connect(lambda: self.pin_requested.emit(self.table.current_row()))
        self.table.top.addWidget(self.pin_button)
        self._steps = QHBoxLayout()
        self._steps.setSpacing(4)
        self._group = QButtonGroup(self)
        self._group.buttonClicked.connect(self._choose)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(self._steps)
        layout.addWidget(self.table, 1)
        self.table.row_selected.connect(self.row_selected)
        self.table.row_selected.connect(lambda row: self._allow())
        self.table.filter.textChanged.connect(lambda text: self.rows_kept.emit())
        self.table.row_activated.connect(self.row_activated)
        self.table.pin_requested.connect(self.pin_requested)
        self._known: tuple[SearchStep, ...] = ()
        self._reasons: Sequence[str] = ()
        self._allow()

    def set_steps(self, steps: Sequence[SearchStep], current: str = "") -> None:
        """Offer the steps of the search; the rows of one are shown, all of them where ``current`` is none."""
        if [step.name for step in steps] != [step.name for step in self._known]:
            for old in self._group.buttons():
                self._group.removeButton(old)
                old.deleteLater()
            while self._steps.takeAt(0) is not None:
                pass
            for step in steps:
                button = QToolButton()
                button.setCheckable(True)
                button.setProperty("step", step.name)
                self._group.addButton(button)
                self._steps.addWidget(button)
            self._steps.addStretch(1)
        self._known = tuple(steps)
        for made, step in zip(self._group.buttons(), steps):
            made.setText(f"{step.name.capitalize()} ({len(step.rows)})")
            made.setToolTip(step.help)
            made.setChecked(step.name == current)
        self._keep(current)

    def step_buttons(self) -> list[QAbstractButton]:
        """One a step."""
        return list(self._group.buttons())

    def set_rows(
        self,
        rows: Sequence[CandidateRecord],
        pinned: int = -1,
        score: str = "Score",
        unit: str = "",
        colours: np.ndarray | None = None,
        meaning: str = "",
        reasons: Sequence[str] = (),
    ) -> None:
        """Show candidates, see :func:`candidate_columns`; more may come while the search runs.

        ``reasons`` say of each row why it cannot be pinned (or let go of) now, "" where it can.
        """
        self.table.set_columns(candidate_columns(rows, score, unit, colours, meaning), pinned)
        self._reasons = tuple(reasons)
        self.table.set_unpinnable({row: reason for row, reason in enumerate(reasons) if reason})
        self._allow()

    def _keep(self, name: str) -> None:
        kept = next((step.rows for step in self._known if step.name == name), None)
        self.table.set_kept(None if kept is None else frozenset(kept))

    def _choose(self, button: QAbstractButton) -> None:
        self._keep(button.property("step"))
        self.step_chosen.emit(button.property("step"))
        self.rows_kept.emit()

    def set_selected(self, row: int) -> None:
        """Select a row, -1 for none; nothing is emitted."""
        self.table.set_selected([row] if row >= 0 else [])
        self._allow()

    def _allow(self) -> None:
        """Offer to pin the row that is selected, or say why it cannot be."""
        row = self.table.current_row()
        reason = self._reasons[row] if 0 <= row < len(self._reasons) else "" if row >= 0 else "no candidate is selected"
        held = row >= 0 and row == self.table.model.pinned
        self.pin_button.setText("Unpin" if held else "Pin")
        tip = "Go on from the best candidate again" if held else "Hold this candidate, and go on from it"
        allow(self.pin_button, reason, f"{tip}; can be undone (P)")
