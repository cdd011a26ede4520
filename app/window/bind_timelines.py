"""The timelines: every stream along the clock, its cursor, its range, and the offset of the video."""

from __future__ import annotations

from app.models import edits
from app.models.workbench import Workbench
from app.views import timelines as views
from app.views.colours import by_cluster
from app.window.keys import how
from app.window.shown import Shown
from solver.sync import Sync
from widgets.plots.rows import Row
from widgets.plots.timelines import Timelines


class TimelinesBinder:
    """Fills the rows, and takes what is dragged."""

    def __init__(self, widget: Timelines, bench: Workbench, shown: Shown) -> None:
        self.widget, self.bench, self.shown = widget, bench, shown
        self._span: tuple[float, float] | None = None
        bench.clock.moved.connect(widget.set_time)
        bench.clock.changed.connect(self._clock)
        bench.selection.changed.connect(lambda what: widget.set_selected(bench.selection.markers))
        bench.opened.connect(self._opened)
        shown.changed.connect(self._changed)
        widget.seeked.connect(bench.clock.seek)
        widget.range_changed.connect(bench.clock.set_loop)
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
        self.bench.apply(edits.set_offset(self.bench.document.session, offset))

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"markers", "clean", "landmarks", "prior", "sync", "segment", "fit", "compared"}:
            self.widget.set_rows(self.rows())
            self._clock()
            self.widget.set_time(self.bench.clock.time)
            self.widget.set_selected(self.bench.selection.markers)

    def rows(self) -> list[Row]:
        """All that is known along the clock."""
        shown, found = self.shown, list[Row]()
        tracks, sync, seen, prior = shown.tracks, shown.get("sync"), shown.get("landmarks"), shown.get("prior")
        watched = seen if seen is not None else prior
        if tracks is None:
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
        motion = shown.fit
        others = shown.compared("fit")
        if motion is not None:
            fits = {"fit in force" if not shown.stale("fit") else "fit (stale)": motion}
            board = self.bench.board
            for ref, other in others.items():
                entry = board.results.entry("fit", ref.key)
                earlier = (
                    next((row for row in board.card("fit").earlier if row.key == ref.key), None) if entry else None
                )
                said = earlier.settings if earlier is not None and earlier.settings else ref.key[:6]
                fits[f"compared: {said}"] = other
            found.append(
                shown.once(
                    "residual", (motion, *others.values()), lambda: views.residual_row(fits, tracks.markers.time)
                )
            )
        if sync is not None and watched is not None:
            own = (sync, tracks.markers, watched)
            found.append(shown.once("offset", own, lambda: views.offset_row(*own, self._found_offset())))
        return found

    def _found_offset(self) -> Sync | None:
        """An earlier result that looked for the offset by itself, None where there is none."""
        results = self.bench.board.results
        for entry in results.entries("sync"):
            value: Sync = results.get("sync", entry.key)
            if value.method != "given":
                return value
        return None

    def _clicked(self, row: str, time: float, index: int) -> None:
        tracks = self.shown.tracks
        if tracks is None or index < 0:
            return
        presence = self.shown.once("presence", (tracks, self.shown.clusters), lambda: views.presence_row(tracks))
        if row == presence.name:
            from PySide6.QtGui import QGuiApplication

            self.bench.selection.select_markers([index], how(QGuiApplication.keyboardModifiers()))
