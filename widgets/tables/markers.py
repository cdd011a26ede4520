"""Every marker with how it was seen and how well it is explained."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from markerscope.widgets.plots.scales import clock
from markerscope.widgets.tables.array_table import ArrayTable
from markerscope.widgets.tables.columns import Column
from markerscope.widgets.tables.marker_data import MarkerRows


def marker_columns(rows: MarkerRows, colours: np.ndarray | None = None) -> list[Column]:
    """The table of markers; ``colours`` (M, 3) uint8 are those of the scene."""
    p95 = np.asarray(rows.p95, float)
    most = float(np.nanmax(p95)) if np.isfinite(p95).any() else 1.0
    group = np.asarray(rows.group)
    return [
        Column("Marker", rows.labels, tooltip="Name in the file", colours=colours),
        Column("Seen", np.asarray(rows.measured, float), "%", ".1f", "Share of the frames that show it", bar=(0, 100)),
        Column("Gaps", rows.gaps, tooltip="How often it was lost"),
        Column("Longest", np.asarray(rows.longest_gap, float), "s", ".2f", "The longest gap"),
        Column("Group", np.where(group > 0, group, np.nan), "", ".0f", "Markers that move together"),
        Column("Bone", [name or None for name in rows.bone], tooltip="Bone that it moves with"),
        Column("Residual", rows.mean, "mm, mean", ".1f", "Distance from where the body says it is", bar=(0, most)),
        Column("95 %", p95, "mm", ".1f", "Residual that 95 % of its frames stay below", bar=(0, most)),
        Column("Worst", rows.worst, "mm", ".1f", "Largest residual"),
        Column("Worst at", rows.worst_time, "time", lambda t: clock(float(t)), "Enter or a double click goes there"),
        Column("Landmark", [name or None for name in rows.landmark], tooltip="Bony landmark that it was drawn to"),
        Column("Sits there", rows.probability, "%", ".0f", "How probably it sits on that landmark", bar=(0, 100)),
        Column("Beside", rows.beside, "mm", ".0f", "Distance from that landmark on the resting body"),
    ]


class MarkerTable(QWidget):
    """The table; Enter or a double click goes to the worst frame.

    Signals
    -------
    markers_selected(markers)
    worst_requested(marker, time) : s
    """

    markers_selected = Signal(list)
    worst_requested = Signal(int, float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Markers")
        self.table = ArrayTable("Markers")
        self._worst = np.zeros(0)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.table)
        self.table.rows_selected.connect(self.markers_selected)
        self.table.row_activated.connect(self._jump)

    def set_rows(self, rows: MarkerRows, colours: np.ndarray | None = None) -> None:
        """Show markers, see :class:`MarkerRows` and :func:`marker_columns`."""
        self._worst = np.asarray(rows.worst_time, float)
        self.table.set_columns(marker_columns(rows, colours))

    def set_selected(self, markers: Iterable[int]) -> None:
        """Select markers; nothing is emitted."""
        self.table.set_selected(sorted(markers))

    def _jump(self, row: int) -> None:
        if np.isfinite(self._worst[row]):
            self.worst_requested.emit(row, float(self._worst[row]))
