"""The head above the stages: Solve, the figures of the answer, what is to check."""

from __future__ import annotations

from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.candidate_actions import pinned
from markerscope.app.models.fields import title
from markerscope.app.models.jobs import Plan, Running
from markerscope.app.models.workbench import Workbench
from markerscope.app.window.concerned import Concerned
from markerscope.app.window.shown import Shown
from markerscope.solver.core.errors import InputError
from markerscope.solver.report.headlines import headlines
from markerscope.widgets.panels.glance_bar import GlanceBar, GlanceData, Tile
from markerscope.widgets.panels.stage_data import duration, left

_OF = {
    "Part": ("orient", "fit"),
    "Confidence": ("check", "orient"),
    "Marker residual": ("fit",),
    "Marker to skin": ("fit",),
    "Sync offset": ("sync",),
}
"""The stages whose doubts a figure shows."""
STANDS_ON = ("sync", "orient", "fit", "surface", "check")


class GlanceBinder:
    """Fills the head, and does what is asked for there."""

    def __init__(self, widget: GlanceBar, bench: Workbench, shown: Shown, concerned: Concerned, table: Actions) -> None:
        self.widget, self.bench, self.shown, self.concerned, self.table = widget, bench, shown, concerned, table
        self._at: Running | None = None
        self._filling = QTimer(widget, singleShot=True, interval=0)
        self._filling.timeout.connect(self.fill)
        bench.board.changed.connect(self._filling.start)
        bench.runner.changed.connect(self._filling.start)
        bench.runner.progressed.connect(self._progress)
        shown.changed.connect(lambda stages: self._filling.start())
        concerned.changed.connect(self._filling.start)
        widget.solve.connect(lambda: table.trigger("run.all"))
        widget.stop.connect(lambda: table.trigger("run.stop"))
        widget.check_chosen.connect(self._chosen)

    def fill(self) -> None:
        """Show how all stands."""
        bench = self.bench
        if not bench.document.is_open:
            self.widget.set_data(GlanceData(why_not="no session is open"))
            return
        running, why_not = bench.runner.running, self.table.why_not("run.all")
        board = bench.board
        failed = [name for name in board.names if board.state(name) == "failed"]
        tiles = self._tiles()
        old = bool(tiles) and any(self.shown.stale(name) for name in STANDS_ON)
        self.widget.set_data(
            GlanceData(
                self._doing() if running else self._plan(why_not),
                running,
                "" if running else why_not,
                tiles,
                old,
                tuple(concern.short for concern in self.concerned.all),
                f"{title(failed[0])} failed: see its card below." if failed else "",
            )
        )

    def _plan(self, why_not: str) -> str:
        if why_not:
            return f"{why_not[:1].upper()}{why_not[1:]}."
        try:
            plan = self.bench.runner.plan()
        except InputError as error:
            return str(error)
        return said_plan(plan)

    def _doing(self) -> str:
        at = self.bench.runner.at or Running()
        parts = [at.text or "working", "" if at.seconds_left is None else left(at.seconds_left)]
        return f"{title(at.stage) if at.stage else 'Starting'}: {', '.join(part for part in parts if part)}"

    def _progress(self, at: Running) -> None:
        if self.bench.runner.running and self.widget.stop_button.isVisibleTo(self.widget):
            self.widget.plan.setText(self._doing())

    def _tiles(self) -> tuple[Tile, ...]:
        sync, ranked, motion, surface, check = (self.shown.get(name) for name in STANDS_ON)
        if any(value is None for value in (sync, ranked, motion, surface, check)):
            return ()
        held, doubtful = pinned(self.bench), {concern.stage for concern in self.concerned.all}
        return tuple(
            Tile(row.label, row.value, row.note, bool(doubtful & set(_OF.get(row.label, ()))))
            for row in headlines(sync, ranked, motion, surface, check, held)
        )

    def _chosen(self, row: int) -> None:
        if 0 <= row < len(self.concerned.all):
            self.concerned.go_to(self.concerned.all[row])


def said_plan(plan: Plan) -> str:
    """What a run would do, and about how long it takes."""
    if not plan.stages:
        return "All results are there for these settings."
    names = [title(name) for name in plan.stages]
    which = names[0] if len(names) == 1 else f"{len(names)} stages, {names[0]} to {names[-1]}"
    return f"Computes {which}: about {duration(max(1.0, round(plan.seconds)))}."
