"""The cards of the stages: how each stands, its settings, its earlier results, and the way to run it."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.edit_actions import COMPARE, GO_BACK, SET_VALUE, Compared, Value
from markerscope.app.actions.run_actions import RUN_STAGE, RUN_TO
from markerscope.app.models.fields import title
from markerscope.app.models.jobs import Running
from markerscope.app.models.results import Ref
from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_data import StageProgress
from markerscope.widgets.panels.stage_panel import StagePanel


class StagesBinder:
    """Cards and the progress at the foot of the window."""

    def __init__(self, panel: StagePanel, strip: ProgressStrip, bench: Workbench, table: Actions) -> None:
        self.panel, self.strip, self.bench, self.table = panel, strip, bench, table
        self._stage = ""
        self._filling = QTimer(panel, singleShot=True, interval=0)  # many changes at once are shown once
        self._filling.timeout.connect(self._fill)
        bench.board.changed.connect(self.fill)
        bench.runner.changed.connect(self._ran)
        bench.runner.progressed.connect(self._progress)
        panel.run.connect(lambda name: table.do(RUN_STAGE, name))
        panel.run_to.connect(lambda name: table.do(RUN_TO, name))
        panel.stop.connect(lambda: table.trigger("run.stop"))
        strip.stop.connect(lambda: table.trigger("run.stop"))
        panel.setting_changed.connect(self._set)
        panel.earlier_chosen.connect(lambda stage, key: table.do(GO_BACK, Ref(stage, key)))
        panel.compare_toggled.connect(self._compare)
        panel.opened.connect(lambda name, is_open: bench.selection.select(stage=name) if is_open else None)

    def fill(self) -> None:
        """Show how every stage stands, as soon as all has changed that changes now."""
        self._filling.start()

    def _fill(self) -> None:
        cards = [
            replace(card, why_not=self.table.why_not_with(RUN_STAGE, card.name)) for card in self.bench.board.cards
        ]
        self.panel.set_stages(cards)  # type: ignore[arg-type]  # cards have what the panel reads

    def _ran(self) -> None:
        if not self.bench.runner.running:
            self._stage = ""
            self.strip.set_progress(None)
        else:
            self._progress(self.bench.runner.at or Running())
        self.fill()

    def _progress(self, at: Running) -> None:
        name = title(at.stage) if at.stage else "Starting"
        self.strip.set_progress(StageProgress(at.whole, at.text, at.seconds_left), name)
        if at.stage in self.bench.board.names and self.bench.board.state(at.stage) == "running":
            self.panel.set_progress(at.stage, StageProgress(at.part, at.text, at.stage_left))

    def _set(self, stage: str, name: str, value: object) -> None:
        if not self.table.do(SET_VALUE, Value(stage, name, value)):
            self.fill()

    def _compare(self, stage: str, key: str, on: bool) -> None:
        if not self.table.do(COMPARE, Compared(Ref(stage, key), on)):
            self.fill()
