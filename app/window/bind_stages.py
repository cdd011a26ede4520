"""The cards of the stages: how each stands, its settings, its earlier results, and the way to run it."""

from __future__ import annotations

from PySide6.QtCore import QTimer

from markerscope.app.actions.run_actions import run_stage, run_until
from markerscope.app.models import edits
from markerscope.app.models.fields import title
from markerscope.app.models.jobs import Running
from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_data import StageProgress
from markerscope.widgets.panels.stage_panel import StagePanel


class StagesBinder:
    """Cards and the progress at the foot of the window."""

    def __init__(self, panel: StagePanel, strip: ProgressStrip, bench: Workbench) -> None:
        self.panel, self.strip, self.bench = panel, strip, bench
        self._stage = ""
        self._filling = QTimer(panel, singleShot=True, interval=0)  # many changes at once are shown once
        self._filling.timeout.connect(self._fill)
        bench.board.changed.connect(self.fill)
        bench.runner.changed.connect(self._ran)
        bench.runner.progressed.connect(self._progress)
        panel.run.connect(lambda name: self._run(name))
        panel.run_to.connect(lambda name: self._run_to(name))
        panel.stop.connect(bench.runner.cancel)
        strip.stop.connect(bench.runner.cancel)
        panel.setting_changed.connect(self._set)
        panel.earlier_chosen.connect(self._earlier)
        panel.compare_toggled.connect(bench.board.compare)
        panel.opened.connect(lambda name, is_open: bench.selection.select(stage=name) if is_open else None)

    def fill(self) -> None:
        """Show how every stage stands, as soon as all has changed that changes now."""
        self._filling.start()

    def _fill(self) -> None:
        self.panel.set_stages(self.bench.board.cards)  # type: ignore[arg-type]  # cards have what the panel reads

    def _run(self, stage: str) -> None:
        self.bench.selection.select(stage=stage)
        self.bench.attempt(lambda: run_stage(self.bench, stage))

    def _run_to(self, stage: str) -> None:
        self.bench.selection.select(stage=stage)
        self.bench.attempt(lambda: run_until(self.bench, stage))

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
        session = self.bench.document.session
        done = self.bench.attempt(lambda: self.bench.document.apply(edits.set_value(session, stage, name, value)))
        if not done:
            self.fill()

    def _earlier(self, stage: str, key: str) -> None:
        self.bench.attempt(lambda: self.bench.document.apply(self.bench.board.go_back(stage, key)))
