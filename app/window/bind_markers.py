"""The table of markers."""

from __future__ import annotations

from PySide6.QtCore import QTimer

from markerscope.app.models.workbench import Workbench
from markerscope.app.views.colours import by_cluster
from markerscope.app.views.markers import marker_table
from markerscope.app.window.shown import Shown
from markerscope.widgets.tables.markers import MarkerTable


class MarkersBinder:
    """Fills the table, and takes the rows that are selected."""

    def __init__(self, widget: MarkerTable, bench: Workbench, shown: Shown) -> None:
        self.widget, self.bench, self.shown = widget, bench, shown
        self._telling = False
        self._filling = QTimer(widget, singleShot=True, interval=0)  # after the scene: a picture waits for no table
        self._filling.timeout.connect(self._fill)
        shown.changed.connect(self._changed)
        bench.selection.changed.connect(lambda what: self._select())
        widget.markers_selected.connect(self._selected)
        widget.worst_requested.connect(self._worst)

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"markers", "clean", "segment", "fit", "check"}:
            self._filling.start()

    def _fill(self) -> None:
        tracks = self.shown.tracks
        if tracks is None:
            return
        segmentation, motion = self.shown.segmentation, self.shown.fit
        verdict = None if self.shown.stale("check") else self.shown.get("check")
        rows = self.shown.once(
            "marker rows",
            (tracks, segmentation, motion, verdict),
            lambda: marker_table(tracks, segmentation, motion, verdict),
        )
        clusters = self.shown.clusters
        self.widget.set_rows(rows, None if clusters is None else by_cluster(clusters).colours)
        self._select()

    def _select(self) -> None:
        if not self._telling:
            self.widget.set_selected(sorted(self.bench.selection.markers))

    def _selected(self, markers: list[int]) -> None:
        self._telling = True
        try:
            self.bench.selection.select_markers(markers)
        finally:
            self._telling = False

    def _worst(self, marker: int, time: float) -> None:
        self.bench.selection.select_markers([marker])
        self.bench.clock.seek(time)
