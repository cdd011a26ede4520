"""What is to check of the results in force, once for all that say it, and the way to what it is about."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

from markerscope.app.actions.candidate_actions import pinned
from markerscope.app.models.signal import Signal
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.concerns import Concern, concerns
from markerscope.app.window.shown import Shown

_LOOKED_AT = ("markers", "landmarks", "sync", "orient", "fit", "check")


class Concerned:
    """What is to check.

    Attributes
    ----------
    all : now, in the order of the stages
    changed : emitted when it is something else
    """

    def __init__(self, owner: QObject, bench: Workbench, shown: Shown, bring: Callable[[str], None]) -> None:
        self.bench, self.shown, self._bring = bench, shown, bring
        self.changed: Signal[[]] = Signal()
        self.all: tuple[Concern, ...] = ()
        self._timer = QTimer(owner, singleShot=True, interval=0)
        self._timer.timeout.connect(self.look)
        shown.changed.connect(lambda stages: self._timer.start())
        shown.dated.connect(lambda stages: self._timer.start())
        bench.board.changed.connect(self._timer.start)

    def look(self) -> None:
        """Look again."""
        found: tuple[Concern, ...] = ()
        if self.bench.document.is_open:
            there = {name: self.shown.get(name) for name in _LOOKED_AT if not self.shown.stale(name)}
            given = tuple(there.values())
            held = pinned(self.bench)
            name = f"concerns {held}"
            found = self.shown.once(name, given, lambda: concerns(there, held))
        if found != self.all:
            self.all = found
            self.changed.emit()

    def of(self, stage: str) -> tuple[Concern, ...]:
        """What speaks against a stage."""
        return tuple(concern for concern in self.all if concern.stage == stage)

    def go_to(self, concern: Concern) -> None:
        """Bring what it is about into sight: the panel, the time, the markers, the candidate."""
        bench = self.bench
        if concern.time is not None:
            bench.clock.seek(concern.time)
        if concern.markers:
            bench.selection.select_markers(concern.markers)
        bench.selection.select(stage=concern.stage)
        if concern.candidate is not None:
            bench.selection.select(candidate=concern.candidate, hypothesis=None)
        if concern.panel:
            self._bring(concern.panel)
