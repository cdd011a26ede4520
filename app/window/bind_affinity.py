"""The rigidity of the markers: the tree cut anew while it is dragged, groups edited, a pair's distance."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt

from markerscope.app.actions import Actions
from markerscope.app.actions.group_actions import CUT_GROUPS
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.affinity import affinity_picture, pair_distance, recut
from markerscope.app.window.bind_scene import SceneBinder
from markerscope.app.window.group_menu import GroupEdits
from markerscope.app.window.keys import how
from markerscope.app.window.shown import Shown
from markerscope.widgets.plots.affinity import AffinityView
from markerscope.widgets.plots.pair import PairPlot


class AffinityBinder:
    """Joins the matrix, the pair and the scene."""

    def __init__(
        self,
        widget: AffinityView,
        pair: PairPlot,
        bench: Workbench,
        shown: Shown,
        scene: SceneBinder,
        table: Actions,
    ) -> None:
        self.widget, self.pair, self.bench, self.shown, self.scene = widget, pair, bench, shown, scene
        self._pair: tuple[int, int] | None = None
        self.table, self.asked = table, GroupEdits(table)
        widget.edit_why_not = self.asked.why_not
        bench.selection.changed.connect(lambda what: self._select())
        bench.clock.moved.connect(pair.set_time)
        shown.changed.connect(self._changed)
        widget.cut_dragged.connect(self._drag)
        widget.cut_committed.connect(self._commit)
        widget.pair_clicked.connect(lambda i, j: bench.selection.select_markers([i, j]))
        widget.leaves_clicked.connect(self._leaves)
        widget.edit_requested.connect(self.asked.ask)
        pair.seeked.connect(bench.clock.seek)

    def _changed(self, stages: frozenset[str]) -> None:
        if not stages & {"segment", "markers", "clean"}:
            return
        found, markers = self.shown.segmentation, self.shown.markers
        if found is None or markers is None:
            nothing = np.zeros((0, 0)), np.zeros(0, int), np.zeros((0, 4))
            self.widget.set_data(*nothing, (), 0.0, np.zeros(0, int), np.zeros((0, 3), np.uint8))
            self._pair = None
            return
        p = self.shown.once("affinity", (found,), lambda: affinity_picture(found, markers.labels))
        self.widget.set_data(p.matrix, p.order, p.linkage, p.labels, p.cut, p.clusters, p.marker_colours, p.leaves)
        self._pair = None
        self._select()

    def _settings(self) -> object:
        return self.bench.board.settings["segment"]

    def _drag(self, height: float) -> None:
        found = self.shown.segmentation
        if found is None:
            return
        cut = recut(found, self._settings(), height)  # type: ignore[arg-type]
        self.widget.set_clusters(cut.clusters, cut.coloured.colours, height)
        self.scene.drag(cut.clusters)

    def _commit(self, height: float) -> None:
        self._drag(height)
        if not self.table.do(CUT_GROUPS, height):
            self.scene.drag(None)
            self._changed(frozenset({"segment"}))

    def _leaves(self, markers: list[int], held: Qt.KeyboardModifier) -> None:
        self.bench.selection.select_markers(markers, how(held))

    def _select(self) -> None:
        pair, found, markers = self.bench.selection.pair, self.shown.segmentation, self.shown.markers
        self.widget.set_selected(self.bench.selection.markers, pair)
        if pair == self._pair or found is None or markers is None:
            return
        self._pair = pair
        if pair is None or max(pair) >= len(markers.labels):
            self.pair.setVisible(False)
            return
        measured = pair_distance(found, markers, *pair)
        self.pair.set_pair(*measured.labels, measured.time, measured.distance)
        self.pair.set_time(self.bench.clock.time)
        self.pair.setVisible(True)
