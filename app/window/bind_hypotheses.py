"""The answers side by side: each with a picture of its body in the markers."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtGui import QImage

from markerscope.app.actions import Actions
from markerscope.app.actions.candidate_actions import PIN
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.hypotheses import HypothesesPicture, hypotheses_picture
from markerscope.app.views.posing import BONE_EDGES
from markerscope.app.window.ghosts import Ghosts
from markerscope.app.window.shown import Shown
from markerscope.widgets import palette
from markerscope.widgets.panels.hypotheses import HypothesesView
from markerscope.widgets.scene import Scene3D
from markerscope.widgets.scene.portraits import Portraits


class HypothesesBinder:
    """Fills the cards. The pictures are drawn one by one, each in its turn of the event loop."""

    def __init__(
        self,
        widget: HypothesesView,
        bench: Workbench,
        shown: Shown,
        ghosts: Ghosts,
        scene: Scene3D,
        table: Actions,
    ) -> None:
        self.widget, self.bench, self.shown, self.ghosts = widget, bench, shown, ghosts
        self._scene, self._table = scene, table
        self._portraits: Portraits | None = None
        self._blank = QImage(4, 3, QImage.Format.Format_RGB32)
        self._blank.fill(0x888888)
        self._picture: HypothesesPicture | None = None
        self._images: dict[int, QImage] = {}
        self._of: object = None
        self._timer = QTimer(widget, interval=0)
        self._timer.timeout.connect(self._draw_next)
        shown.changed.connect(self._changed)
        shown.dated.connect(lambda stages: self.fill())
        bench.document.changed.connect(lambda another: self.fill())
        bench.selection.changed.connect(lambda what: self._select())
        widget.hypothesis_selected.connect(lambda row: bench.selection.select(candidate=row, hypothesis=None))
        widget.pin_requested.connect(lambda row: table.do(PIN, row))

    def fill(self) -> None:
        """Show the answers that there are."""
        ranked = self.shown.get("orient")
        if ranked is None:
            self._picture, self._of = None, None
            self.widget.set_cards([])
            return
        if ranked is not self._of:
            self._of, self._images = ranked, {}
            self._timer.start()
        fit = self.bench.board.settings.get("fit") if self.bench.document.is_open else None
        before = self._picture
        verdict = None if self.shown.stale("check") else self.shown.get("check")
        row = getattr(fit, "candidate", None) or 0
        self._picture = hypotheses_picture(ranked, row, self.shown.get("solve"), verdict)
        if repr(self._picture) != repr(before):  # which takes NaN for NaN
            self._show()
        else:
            self._allow()

    def _allow(self) -> None:
        assert self._picture is not None
        cards = self._picture.cards
        self.widget.set_reasons({card.candidate: self._table.why_not_with(PIN, card.candidate) for card in cards})

    def _show(self) -> None:
        assert self._picture is not None
        cards = self._picture.cards
        self.widget.set_cards(cards, [self._images.get(c.candidate) for c in cards], self._picture.sentence)
        self._allow()
        self._select()

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"orient", "solve", "localize", "fit", "check"}:
            self.fill()

    def _select(self) -> None:
        row = self.bench.selection.candidate
        self.widget.set_selected(-1 if row is None else row)

    def _draw_next(self) -> None:
        """One picture at a time, so that nothing waits for all of them; only while somebody looks."""
        if not self.widget.isVisible():
            self._timer.setInterval(500)
            return
        self._timer.setInterval(0)
        cards = self._picture.cards if self._picture is not None else ()
        waiting = [card.candidate for card in cards if card.candidate not in self._images]
        if not waiting:
            self._timer.stop()
            return
        self._images[waiting[0]] = self._draw(waiting[0])
        if len(waiting) == 1:
            self._show()

    def _draw(self, row: int) -> QImage:
        track, markers = self.ghosts.candidate_track(row), self.shown.markers
        if self._portraits is None:
            self._portraits = self._scene.portraits()
        if track is None or markers is None:
            return QImage(self._blank)
        time = float(track.times[len(track.times) // 2])
        frame = int(np.clip(round((time - markers.time[0]) * markers.rate), 0, len(markers.positions) - 1))
        vertices, joints = track.vertices(time, "coarse"), track.joints(time)
        colour, points = palette.categorical(12)[row % 12], markers.positions[frame]
        return self._portraits.draw(vertices, track.faces("coarse"), joints, BONE_EDGES, points, colour)
