"""Every decision, to go back and forth in."""

from __future__ import annotations

from markerscope.app.actions import Actions
from markerscope.app.actions.edit_actions import GO_TO_STEP
from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.history import HistoryList


class HistoryBinder:
    """Shows the document's history."""

    def __init__(self, widget: HistoryList, bench: Workbench, table: Actions) -> None:
        self.widget, self.bench = widget, bench
        bench.document.changed.connect(lambda another: self.fill())
        widget.jump_requested.connect(lambda count: table.do(GO_TO_STEP, count))

    def fill(self) -> None:
        """Show it."""
        if not self.bench.document.is_open:
            self.widget.set_history([], 0)
            return
        history = self.bench.document.history
        sentences = [step.sentence for step in history.steps]
        self.widget.set_history(sentences[1:], history.position, sentences[0] or "As opened")
