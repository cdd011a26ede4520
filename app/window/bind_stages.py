"""The cards of the stages: how each stands, its settings, its earlier results, and the way to run it."""

from __future__ import annotations

from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.candidate_actions import pinned
from markerscope.app.actions.edit_actions import COMPARE, GO_BACK, SET_VALUE, Compared, Value
from markerscope.app.actions.run_actions import RUN_STAGE, RUN_TO
from markerscope.app.models.fields import title
from markerscope.app.models.jobs import Running
from markerscope.app.models.results import Ref
from markerscope.app.models.stages import Card
from markerscope.app.models.workbench import Workbench
from markerscope.app.window.concerned import Concerned
from markerscope.solver.pipeline.stage import leading_to
from markerscope.solver.report.headlines import said_pinned
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_data import StageData, StageProgress
from markerscope.widgets.panels.stage_panel import StagePanel


class StagesBinder:
    """Cards and the progress at the foot of the window."""

    def __init__(
        self, panel: StagePanel, strip: ProgressStrip, bench: Workbench, concerned: Concerned, table: Actions
    ) -> None:
        self.panel, self.strip, self.bench, self.concerned, self.table = panel, strip, bench, concerned, table
        self._stage = ""
        self._filling = QTimer(panel, singleShot=True, interval=0)  # many changes at once are shown once
        self._filling.timeout.connect(self._fill)
        bench.board.changed.connect(self.fill)
        concerned.changed.connect(self.fill)
        panel.check_chosen.connect(self._to_check)
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
        self.panel.set_stages([self._card(card) for card in self.bench.board.cards])

    def _card(self, card: Card) -> StageData:
        checks = tuple(concern.text for concern in self.concerned.of(card.name)) if card.state == "cached" else ()
        return StageData(
            card.name,
            card.title,
            "check" if checks else card.state,
            card.seconds,
            card.headline,
            card.fields,  # type: ignore[arg-type]  # they have what the panel reads
            card.earlier,  # type: ignore[arg-type]
            card.help,
            self.table.why_not_with(RUN_STAGE, card.name),
            checks,
            self._note(card),
        )

    def _note(self, card: Card) -> str:
        """What a result rests on that was pinned by hand; the fit itself says so among what is to check."""
        held = pinned(self.bench)
        after = "fit" in leading_to(self.bench.board.graph, [card.name]) - {card.name}
        words = said_pinned(held) if after and card.state == "cached" else ""
        return f"{words[:1].upper()}{words[1:]}"

    def _to_check(self, stage: str, row: int) -> None:
        own = self.concerned.of(stage)
        if 0 <= row < len(own):
            self.concerned.go_to(own[row])

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
