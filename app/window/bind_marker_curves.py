"""The curves of the selected markers, and what is edited on them."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtWidgets import QMenu

from markerscope.app.actions import Actions
from markerscope.app.actions.clean_actions import ACCEPT, REJECT, SHOW
from markerscope.app.actions.play_actions import SET_RANGE
from markerscope.app.actions.track_actions import WAY_TITLES
from markerscope.app.models.gap_previews import best
from markerscope.app.models.gap_target import target_gaps
from markerscope.app.models.pending_fills import PendingFills
from markerscope.app.models.workbench import Workbench
from markerscope.app.models.working import Working
from markerscope.app.views import marker_curves as views
from markerscope.app.window.actions import native
from markerscope.app.window.once import Once
from markerscope.app.window.shown import Shown
from markerscope.solver.cleaning.gaps import Gap
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.widgets.allow import allow
from markerscope.widgets.panels.track_editor import EDITS, TrackEditor
from markerscope.widgets.plots.marker_curve_data import CurvePicture
from markerscope.widgets.plots.marker_curves import MarkerCurvesView
from markerscope.widgets.plots.timelines import Timelines

_WALKS = ("go.gap", "go.gap_back", "go.outlier", "go.outlier_back")
_OFFERED = (
    "go.gap", "go.gap_back", "", "tracks.delete", "tracks.cut", "tracks.join", "tracks.exchange", "tracks.put_back",
    "", "clean.accept", "clean.reject", "clean.run", "", "no_range",
)  # fmt: skip
_NOT_YET = "The cleaning has not been run: it finds outliers and proposes edits of tracks."
_NONE = "The cleaning proposes no edit of tracks."
_TO_RUN = "Accepted edits are applied, all together, by the next cleaning."


class MarkerCurvesBinder(QObject):
    """Fills the plots and the editor beside them; both are made anew only while they are to be seen."""

    def __init__(
        self,
        widget: MarkerCurvesView,
        editor: TrackEditor,
        timelines: Timelines,
        bench: Workbench,
        shown: Shown,
        table: Actions,
    ) -> None:
        super().__init__(widget)
        self.widget, self.editor, self.timelines = widget, editor, timelines
        self.bench, self.shown, self.table = bench, shown, table
        self.pending = PendingFills()
        self._way = ""
        self._gap: Gap | None = None
        self._targets: tuple[Gap, ...] = ()
        self._span: tuple[float, float] | None = None
        self._filling = Once(widget, self._fill)
        self._reasons = Once(widget, self._say_reasons)
        for signal in (shown.changed, shown.dated, bench.document.changed, bench.board.changed, bench.opened):
            signal.connect(self._filling.ask)
        bench.selection.changed.connect(self._selected)
        bench.clock.moved.connect(self._moved)
        bench.clock.changed.connect(self._clock)
        bench.previews.changed.connect(self._filling.ask)
        self.pending.changed.connect(self._filling.ask)
        bench.pending.append(self.pending)
        widget.seeked.connect(bench.clock.seek)
        widget.range_marked.connect(lambda ends: table.do(SET_RANGE, ends))
        widget.options_changed.connect(self._filling.ask)
        widget.asked.connect(table.trigger)
        widget.menu_wanted.connect(self._menu)
        widget.view_changed.connect(timelines.set_view)
        timelines.view_changed.connect(widget.window_of_time.set_view)
        editor.asked.connect(table.trigger)
        editor.way_shown.connect(self._look_at)
        editor.proposal_shown.connect(self._show_proposal)
        editor.accepted.connect(lambda rows: table.do(ACCEPT, self._proposals(rows)))
        editor.rejected.connect(lambda rows: table.do(REJECT, self._proposals(rows)))
        widget.installEventFilter(self)
        self._fill()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Fill it as it comes to be seen."""
        if event.type() == QEvent.Type.Show:
            self._filling.ask()
        return False

    def now(self) -> None:
        """Fill what is pending at once."""
        self._filling.now()
        self._reasons.now()

    def _work(self) -> Working | None:
        return self.bench.working.now() if self.bench.document.is_open else None

    def _chosen(self, work: Working) -> list[int]:
        count = work.edited.positions.shape[1]
        return sorted(m for m in self.bench.selection.markers if m < count)

    def _selected(self, what: frozenset[str]) -> None:
        if "markers" in what:
            self._filling.ask()

    def _moved(self, time: float) -> None:
        self.widget.window_of_time.set_time(time)
        if self.widget.isVisible() and not self.bench.clock.playing:
            work = self._work()
            if work is not None and self._targets != target_gaps(work, self.bench.clock, self._chosen(work)):
                self._filling.ask()
            self._reasons.ask()

    def _clock(self) -> None:
        window, span = self.widget.window_of_time, self.bench.clock.span
        if span != self._span and span[1] > span[0]:
            self._span = span
            window.set_span(*span)
            window.set_view(*self.timelines.view())
        window.set_range(self.bench.clock.loop)
        self._filling.ask()

    def _looks(self) -> views.Looks:
        on = self.widget.on
        return views.Looks(
            tuple(c for c, name in enumerate("xyz") if on(name)),
            tuple(name for name in views.QUANTITIES if on(name)),
            on("raw"),
            on("filled"),
            on("body"),
            on("metres"),
        )

    def _fill(self) -> None:
        if not self.widget.isVisible():
            return
        work, bench = self._work(), self.bench
        self.editor.set_proposals(views.proposal_rows(work), self._said_proposals(work))
        if work is None:
            bench.previews.ask(None, None, None)
            self.pending.ask(None, frozenset())
            self._targets = ()
            self.widget.set_picture(CurvePicture(np.zeros(0), note=views.UNREAD))
            self.editor.set_gap(views.heading_of(None, (), ()), ())
            self._reasons.ask()
            return
        chosen = self._chosen(work)
        self._targets = target_gaps(work, bench.clock, chosen)
        motion = self.shown.get("fit")
        placed = motion.placed if motion is not None and motion.placed.shape == work.measured.positions.shape else None
        gap = self._targets[0] if self._targets else None
        if gap != self._gap:
            self._gap, self._way = gap, ""
        bench.previews.ask(work, placed if not self.shown.stale("fit") else None, gap)
        self.pending.ask(None if work.in_force else work, frozenset(chosen))
        likely, done = best(bench.previews.found), None if gap is None else views.fill_in(work, self.pending.parts, gap)
        found = (
            done.method if done is not None else likely.way if likely is not None and not bench.previews.busy else ""
        )
        way = self._way or found
        self.widget.set_picture(
            views.curves_picture(
                work,
                chosen,
                self._looks(),
                pending=self.pending.parts,
                placed=placed,
                targets=self._targets,
                previewed=bench.previews.gap,
                previews=bench.previews.found if self._way or done is None else (),
                way=way,
            )
        )
        helps = {name: self.table.table[f"fill.{name}"].help for name in WAY_TITLES}
        ways = views.ways_of(bench.previews.found, WAY_TITLES, helps) if gap is not None else ()
        self.editor.set_gap(views.heading_of(work, chosen, self._targets, done), ways, way)
        self._histogram(work, chosen)
        self.widget.window_of_time.set_time(bench.clock.time)
        self._reasons.ask()

    def _histogram(self, work: Working, chosen: list[int]) -> None:
        everyone = chosen or list(range(work.measured.positions.shape[1]))
        lengths = np.array([gap.length for m in everyone for gap in work.of_marker.get(m, ())], dtype=int)
        whose = "all markers" if not chosen else ", ".join(work.edited.labels[m] for m in chosen[:4])
        lost = 1 - float(work.measured.present[:, everyone].mean()) if everyone else 0.0
        title = f"{whose}: {len(lengths)} gaps, {100 * lost:.1f} % of the samples"
        self.editor.histogram.set_lengths(title, lengths, work.measured.rate)

    def _say_reasons(self) -> None:
        if not self.widget.isVisible():
            return
        names = [*(name for name, _ in EDITS), "fill.best", *_WALKS]
        said = {name: (self.table.why_not(name), self._tip(name)) for name in names}
        self.editor.set_reasons(said)
        self.widget.set_reasons(said)

    def _tip(self, name: str) -> str:
        action = self.table.table[name]
        keys = native(action)
        return f"{action.help} ({keys})" if keys else action.help

    def _said_proposals(self, work: Working | None) -> str:
        if work is None or work.cleaned is None:
            return _NOT_YET
        if not work.proposals and not work.rejected:
            return _NONE
        waiting = any(work.accepted(p) for p in work.proposals)
        return _TO_RUN if waiting and not work.in_force else ""

    def _look_at(self, way: str) -> None:
        if way and way != self._way:
            self._way = way
            self._filling.ask()

    def _proposals(self, rows: list[int]) -> tuple[Proposal, ...]:
        work = self._work()
        everyone = () if work is None else (*work.proposals, *work.rejected)
        return tuple(everyone[row] for row in rows if row < len(everyone))

    def _show_proposal(self, row: int) -> None:
        for proposal in self._proposals([row]):
            self.table.do(SHOW, proposal)

    def menu(self) -> QMenu:
        """All that can be done to what is selected, and why the rest cannot."""
        menu = QMenu(self.widget)
        menu.setToolTipsVisible(True)
        fill = menu.addMenu("Fill the gap")
        fill.setToolTipsVisible(True)
        for name in ("fill.best", *(f"fill.{way}" for way in WAY_TITLES)):
            self._offer(fill, name)
        for name in _OFFERED:
            if name:
                self._offer(menu, name if name in self.table.table else f"play.{name}")
            else:
                menu.addSeparator()
        menu.addAction("Show all", self.widget.plots.reset)
        return menu

    def _offer(self, menu: QMenu, name: str) -> None:
        action: Any = self.table.table[name]
        keys = native(action)
        made = menu.addAction(f"{action.title}\t{keys}" if keys else action.title, partial(self.table.trigger, name))
        allow(made, self.table.why_not(name), action.help)

    def _menu(self, place: QPoint) -> None:
        menu = self.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(place)
