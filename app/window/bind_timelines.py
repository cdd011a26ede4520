"""The timelines: every stream along the clock, its cursor, its range, and the offset of the video."""

from __future__ import annotations

from typing import cast

import numpy as np
from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.edit_actions import SET_OFFSET
from markerscope.app.actions.play_actions import SET_RANGE
from markerscope.app.models.fits import CachedFits, colour_places
from markerscope.app.models.offsets import found_sync
from markerscope.app.models.workbench import Workbench
from markerscope.app.views import timelines as views
from markerscope.app.views.colours import by_cluster
from markerscope.app.window.ghosts import Ghosts
from markerscope.app.window.keys import how
from markerscope.app.window.residual_menu import ResidualMenu
from markerscope.app.window.shown import Shown
from markerscope.solver.fit.counting import candidate_number
from markerscope.widgets import palette
from markerscope.widgets.plots.rows import Curve, CurveRow, Row
from markerscope.widgets.plots.timelines import Timelines

RESIDUAL = "Residual"
_LONGEST = 34


class TimelinesBinder:
    """Fills the rows, and takes what is dragged."""

    def __init__(self, widget: Timelines, bench: Workbench, shown: Shown, ghosts: Ghosts, table: Actions) -> None:
        self.widget, self.bench, self.shown, self.ghosts = widget, bench, shown, ghosts
        self.fits = CachedFits(bench.board)
        self.menu = ResidualMenu(bench, self.fits, table)
        tip = "Which fits are compared, over which markers, and by which value, in mm"
        widget.set_row_menu(RESIDUAL, "Compare", tip, self.menu.menu)
        self.table = table
        self._asked: dict[str, object] = {}
        self._span: tuple[float, float] | None = None
        self._filling = QTimer(widget, singleShot=True, interval=0)  # after the scene, so that neither waits for both
        self._filling.timeout.connect(self._follow)
        bench.clock.moved.connect(widget.set_time)
        bench.clock.changed.connect(self._clock)
        bench.selection.changed.connect(self._select)
        bench.display.changed.connect(self._display)
        self.fits.changed.connect(lambda: self._filling.start())
        bench.opened.connect(self._opened)
        shown.changed.connect(self._changed)
        shown.dated.connect(lambda stages: self._filling.start())
        widget.seeked.connect(bench.clock.seek)
        widget.range_changed.connect(self._range)
        widget.offset_dragged.connect(lambda offset: bench.clock.set_sync(offset, bench.clock.timing.rate_ratio))
        widget.offset_committed.connect(self._offset)
        widget.row_clicked.connect(self._clicked)

    def _opened(self) -> None:
        self._span = None
        self.widget.set_rows([])

    def _clock(self) -> None:
        span = self.bench.clock.span
        if span != self._span and span[1] > span[0]:
            self._span = span
            self.widget.set_span(*span)
            view = self.bench.document.view.get("timelines") if self.bench.document.is_open else None
            if isinstance(view, list) and len(view) == 2 and all(isinstance(end, int | float) for end in view):
                self.widget.set_view(*view)
        self.widget.set_range(self.bench.clock.loop)
        self.widget.set_offset(self.bench.clock.timing.offset)

    def _offset(self, offset: float) -> None:
        self.table.do(SET_OFFSET, offset)

    def _range(self, ends: tuple[float, float] | None) -> None:
        if not self.table.do(SET_RANGE, ends):
            self.widget.set_range(self.bench.clock.loop)

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"markers", "clean", "landmarks", "prior", "sync", "segment", "fit", "compared"}:
            self._filling.start()

    def _follow(self) -> None:
        self._fill()
        self._clock()
        self.widget.set_time(self.bench.clock.time)
        self.widget.set_selected(self.bench.selection.markers)

    def _fill(self) -> None:
        self.widget.set_rows(self.rows())

    def _display(self, names: frozenset[str]) -> None:
        if names & {"residual", "residual_selected", "hidden_fits"}:
            self._fill()

    def _select(self, what: frozenset[str]) -> None:
        self.widget.set_selected(self.bench.selection.markers)
        if "candidate" in what or ("markers" in what and self.bench.display.residual_selected):
            self._fill()

    def rows(self) -> list[Row]:
        """All that is known along the clock."""
        shown, found = self.shown, list[Row]()
        tracks, sync, seen, prior = shown.tracks, shown.get("sync"), shown.get("landmarks"), shown.get("prior")
        watched = seen if seen is not None else prior
        if tracks is None or not self.bench.document.is_open:
            return found
        if sync is not None and watched is not None:
            found.append(shown.once("video row", (watched, sync), lambda: views.video_row(watched, sync)))
        clusters = shown.clusters
        found.append(
            shown.once(
                "presence",
                (tracks, clusters),
                lambda: (
                    views.presence_row(tracks)
                    if clusters is None
                    else views.presence_row(tracks, views.strip_order(clusters), by_cluster(clusters).colours)
                ),
            )
        )
        cleaning = shown.once("cleaning", (tracks,), lambda: views.cleaning_row(tracks))
        if cleaning is not None:
            found.append(cleaning)
        residual = self._residual()
        if residual is not None:
            found.append(residual)
        if sync is not None and watched is not None:
            own = (sync, tracks.markers, watched)
            found.append(shown.once("offset", own, lambda: views.offset_row(*own, found_sync(self.bench.board))))
        return found

    def _residual(self) -> CurveRow | None:
        """Every fit that is in the store and not hidden, the one shown in the scene first, and the chosen candidate."""
        shown, display, board = self.shown, self.bench.display, self.bench.board
        tracks, motion = shown.tracks, shown.get("fit")
        assert tracks is not None
        chosen = self._chosen()
        fits: dict[str, views.Residuals] = {}
        ranks: dict[str, int] = {}
        own, old = None, shown.stale("fit")
        if motion is not None and shown.key("fit") not in display.hidden_fits:
            own = "fit, out of date" if old else "fit in force"
            fits[own], ranks[own] = motion, 0
        for key, place in colour_places(board).items():
            residual = self.fits.known.get(key)
            if residual is None:
                continue
            if (
                key in display.hidden_fits
                or key == shown.key("fit")
                or (chosen is not None and residual.residual.shape[1] <= chosen.max(initial=-1))
            ):
                continue
            said = self.fits.said(key)
            label = said if len(said) <= _LONGEST else f"{said[:_LONGEST]}…"
            label = f"{label} ({key[:4]})" if label in fits else label
            fits[label], ranks[label] = residual, place
        also = self._candidate(chosen)
        if not fits and also is None:
            return None
        asked = self._same("row", (display.residual, None if chosen is None else chosen.tolist(), list(fits), own, old))
        made = shown.once(
            "residual",
            (*fits.values(), tracks, also, asked),
            lambda: views.residual_row(
                fits,
                tracks.markers.time,
                display.residual,
                chosen,
                ranks,
                () if also is None else (also,),
                own=own,
                old=old,
            ),
        )
        return cast(CurveRow, made)

    def _same(self, name: str, asked: object) -> object:
        """The object that was asked for by before, if it says the same."""
        if self._asked.get(name) != asked:
            self._asked[name] = asked
        return self._asked[name]

    def _chosen(self) -> np.ndarray | None:
        chosen = sorted(self.bench.selection.markers)
        return np.array(chosen) if self.bench.display.residual_selected and chosen else None

    def _candidate(self, chosen: np.ndarray | None) -> Curve | None:
        row, markers = self.bench.selection.candidate, self.shown.markers
        track = self.ghosts.candidate_track()
        if row is None or track is None or markers is None:
            return None
        statistic = self.bench.display.residual
        label = f"candidate {candidate_number(row)}{', out of date' if self.shown.stale('orient') else ''}"
        asked = self._same("candidate", (label, statistic, None if chosen is None else chosen.tolist()))
        made = self.shown.once(
            "residual of the candidate",
            (track, markers, asked),
            lambda: views.candidate_curve(track, markers, label, palette.categorical(12)[row % 12], statistic, chosen),
        )
        return cast(Curve, made)

    def _clicked(self, row: str, time: float, index: int) -> None:
        tracks = self.shown.tracks
        if tracks is None or index < 0:
            return
        if row == views.CLEANING:
            if len(mended := views.mended_at(tracks, time)):
                self.bench.selection.select_markers(mended)
            return
        presence = self.shown.once("presence", (tracks, self.shown.clusters), lambda: views.presence_row(tracks))
        if row == presence.name:
            from PySide6.QtGui import QGuiApplication

            self.bench.selection.select_markers([index], how(QGuiApplication.keyboardModifiers()))
