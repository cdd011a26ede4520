"""The table of candidates: filling while they are searched, each with its ghost, one to go on from."""

from __future__ import annotations

from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.candidate_actions import PIN, pinned
from markerscope.app.models.fits import CANDIDATE_COLOURS
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.candidates import CandidateTable as Table
from markerscope.app.views.candidates import candidate_table, covered_by
from markerscope.app.views.running import candidates_so_far
from markerscope.app.window.ghosts import Ghosts
from markerscope.app.window.shown import Shown
from markerscope.solver.core.progress import Found
from markerscope.solver.fit.results import Localization
from markerscope.widgets import palette
from markerscope.widgets.tables.candidates import CandidateTable


class CandidatesBinder:
    """Fills the table, and takes the row that is chosen."""

    def __init__(self, widget: CandidateTable, bench: Workbench, shown: Shown, ghosts: Ghosts, table: Actions) -> None:
        self.widget, self.bench, self.shown, self.ghosts = widget, bench, shown, ghosts
        self.actions = table
        self._table: Table | None = None
        self._step = ""
        self._choosing = False
        self._filling = QTimer(widget, singleShot=True, interval=0)  # after the scene: a picture waits for no table
        self._filling.timeout.connect(self.fill)
        shown.changed.connect(self._changed)
        shown.dated.connect(lambda stages: self.fill())
        bench.document.changed.connect(lambda another: self.fill())
        bench.runner.found.connect(self._found)
        bench.runner.changed.connect(self.fill)
        bench.selection.changed.connect(lambda what: self._select())
        widget.row_selected.connect(self._chosen)
        widget.row_activated.connect(self._chosen)
        widget.pin_requested.connect(self._pin)
        widget.step_chosen.connect(self._to_step)
        widget.rows_kept.connect(self._leave_hidden)

    def fill(self) -> None:
        """Show what is known."""
        self._table = self._so_far() or self._result()
        if self._table is None:
            self.widget.set_steps([])
            self.widget.set_rows([])
            return
        table = self._table
        names = [step.name for step in table.steps]
        if self._step not in names:
            self._step = names[-1] if names else ""
        held = self._pinned()
        rows = table.rows
        place = next((i for i, row in enumerate(rows) if row.candidate == held), -1) if held is not None else -1
        inks = palette.categorical(CANDIDATE_COLOURS)
        of_ghost = [max(row.pool if row.candidate < 0 else row.candidate, 0) % CANDIDATE_COLOURS for row in rows]
        colours = inks[of_ghost] if rows else None
        reasons = [self._why_not(row.candidate) for row in rows]
        self.widget.set_rows(rows, place, table.score, table.unit, colours, table.meaning, reasons)
        self.widget.set_steps(table.steps, self._step)
        self._select()

    def _pinned(self) -> int | None:
        return pinned(self.bench)

    def _why_not(self, candidate: int) -> str:
        """Why a candidate cannot be pinned, or let go of where it is pinned."""
        if candidate >= 0 and candidate == self._pinned():
            return self.actions.why_not("candidate.unpin")
        return self.actions.why_not_with(PIN, candidate)

    def _so_far(self) -> Table | None:
        if not self.bench.runner.running:
            return None
        notes = [note for found in self.bench.runner.notes.values() for note in found]
        found = self.shown.get("localize")
        return candidates_so_far(notes, found if isinstance(found, Localization) else None)

    def _result(self) -> Table | None:
        found, ranked = self.shown.get("localize"), self.shown.get("orient")
        if found is None:
            return None
        if not self.shown.made_from("orient", "localize"):
            ranked = None  # of another search, or of another method
        in_use = None
        if ranked is not None:
            in_use = self._pinned() or 0
        covered = {} if ranked is None else self.shown.once("covered", (ranked, found), lambda: self._covered())
        return candidate_table(found, ranked, in_use, covered)

    def _covered(self) -> dict[int, float]:
        ranked, markers = self.shown.get("orient"), self.shown.markers
        covered: dict[int, float] = {}
        for row in range(len(ranked.candidates)):
            track = self.ghosts.candidate_track(row)
            if track is not None and markers is not None:
                covered[row] = covered_by(track, markers)
        return covered

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"localize", "orient", "fit", "markers", "clean"}:
            self._filling.start()

    def _found(self, found: Found) -> None:
        if found.kind in ("candidate", "chain"):
            self.fill()

    def _to_step(self, name: str) -> None:
        self._step = name

    def _leave_hidden(self) -> None:
        """Let go of a row that is not shown any more: P would hold what nobody sees."""
        chosen = self._row_selected()
        if chosen >= 0 and chosen not in self.widget.table.shown_rows():
            self.bench.selection.select(candidate=None, hypothesis=None)

    def _chosen(self, row: int) -> None:
        if self._table is None or not 0 <= row < len(self._table.rows):
            return
        own = self._table.rows[row]
        self._choosing = True
        try:
            self.bench.selection.select(
                candidate=own.candidate if own.candidate >= 0 else None,
                hypothesis=own.pool if own.candidate < 0 and own.pool >= 0 else None,
            )
        finally:
            self._choosing = False

    def _select(self) -> None:
        if self._table is not None and not self._choosing:
            self.widget.set_selected(self._row_selected())

    def _row_selected(self) -> int:
        """The row of the table that is what is selected, -1 for none."""
        if self._table is None:
            return -1
        chosen, pool = self.bench.selection.candidate, self.bench.selection.hypothesis
        rows = self._table.rows
        if chosen is not None:
            return next((i for i, row in enumerate(rows) if row.candidate == chosen), -1)
        if pool is not None:
            return next((i for i, row in enumerate(rows) if row.pool == pool), -1)
        return -1

    def _pin(self, row: int) -> None:
        if self._table is None or not 0 <= row < len(self._table.rows):
            return
        own = self._table.rows[row]
        if own.candidate >= 0 and own.candidate == self._pinned():
            self.actions.trigger("candidate.unpin")
        else:
            self.actions.do(PIN, own.candidate)
