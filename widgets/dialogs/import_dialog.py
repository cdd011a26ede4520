"""How a marker file is to be read: units, up-axis, rate, which points; with a picture that shows a wrong answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.dialogs.import_data import AXES, UNITS, ImportChoice, ImportShown
from markerscope.widgets.dialogs.points_preview import PointsPreview
from markerscope.widgets.icons import icon
from markerscope.widgets.panels.fields import SettingsForm
from markerscope.widgets.panels.stage_data import FieldSpec
from markerscope.widgets.plots.curves import BoxDelegate
from markerscope.widgets.plots.scales import number

_RARE = 0.05


class ImportDialog(QDialog):
    """Passive: every change is told, and whoever reads the file answers with :meth:`set_shown`.

    Signals
    -------
    changed(choice) : :class:`ImportChoice`
    video_wanted() : the user looks for a video
    Accepting is only possible without a problem; :meth:`choice` then holds what to do.
    """

    changed = Signal(object)
    video_wanted = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Open markers")
        self.setAccessibleName("Open markers")
        self._shown: ImportShown | None = None
        self._said, self._notes, self._problem = QLabel(), QLabel(), QLabel()
        for label in (self._said, self._notes, self._problem):
            label.setWordWrap(True)
        self._notes.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self._problem.setForegroundRole(QPalette.ColorRole.BrightText)
        self.preview, self.form, self.points = PointsPreview(), SettingsForm(), QTreeWidget()
        self.points.setHeaderLabels(["Point", "Seen"])
        self.points.setRootIsDecorated(False)
        self.points.setItemDelegate(BoxDelegate(self.points))
        self.points.setAccessibleName("Points to take")
        self.points.itemChanged.connect(self._changed)
        self.all, self.often = QPushButton("All"), QPushButton(f"Seen over {100 * _RARE:.0f} %")
        self.all.clicked.connect(lambda: self._tick(0.0))
        self.often.clicked.connect(lambda: self._tick(_RARE))
        self.video = QLineEdit()
        self.video.setPlaceholderText("Video of the same movement (recommended)")
        self.video.setAccessibleName("Video file")
        self.video.setClearButtonEnabled(True)
        self.video.editingFinished.connect(self._changed)
        browse = QPushButton(icon("open"), "Browse...")
        browse.clicked.connect(self.video_wanted)
        self.browse_button = browse
        self.buttons = QDialogButtonBox()
        self.open_button = self.buttons.addButton("Open", QDialogButtonBox.ButtonRole.AcceptRole)
        self.buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
        self.buttons.accepted.connect(self.accept)
        self.buttons.rejected.connect(self.reject)
        self.form.changed.connect(self._set)
        self._lay_out()

    def _lay_out(self) -> None:
        left, right, middle = QVBoxLayout(), QVBoxLayout(), QHBoxLayout()
        left.addWidget(self.preview, 1)
        left.addWidget(self.form)
        right.addWidget(self.points, 1)
        row = QHBoxLayout()
        row.addWidget(self.all)
        row.addWidget(self.often)
        row.addStretch(1)
        right.addLayout(row)
        middle.addLayout(left, 3)
        middle.addLayout(right, 2)
        film = QHBoxLayout()
        label = QLabel("Video")
        label.setBuddy(self.video)
        film.addWidget(label)
        film.addWidget(self.video, 1)
        film.addWidget(self.browse_button)
        layout = QVBoxLayout(self)
        layout.addWidget(self._said)
        layout.addLayout(middle, 1)
        layout.addLayout(film)
        layout.addWidget(self._notes)
        layout.addWidget(self._problem)
        layout.addWidget(self.buttons)

    def set_shown(self, shown: ImportShown) -> None:
        """Show the file as it would be read with the choices so far; nothing is emitted."""
        before, self._shown = self._shown, shown
        count = len(shown.labels)
        seconds = f", {number(shown.frames / shown.rate, 0.1)} s" if shown.rate else ""
        self._said.setText(f"{shown.name}: {count} points, {shown.frames} frames{seconds}")
        self.form.set_fields(self._fields(shown))
        if before is None or before.labels != shown.labels:
            self._fill(shown)
        self.preview.set_points(shown.points, self._unticked())
        self._notes.setText("\n".join(shown.notes))
        self._notes.setVisible(bool(shown.notes))
        self._problem.setText(shown.problem)
        self._problem.setVisible(bool(shown.problem))
        self._allow()

    def set_video(self, path: str) -> None:
        """Show which video was chosen, and tell it."""
        self.video.setText(path)
        self._changed()

    def choice(self) -> ImportChoice:
        """What is set now."""
        assert self._shown is not None
        shown = self._shown
        out = tuple(shown.labels[k] for k in self._unticked())
        return ImportChoice(shown.units, shown.up, shown.rate, shown.subject, out, self.video.text().strip())

    def sizeHint(self) -> QSize:
        """Picture and list beside each other."""
        line = self.fontMetrics().height()
        return QSize(46 * line, 40 * line)

    def _fields(self, shown: ImportShown) -> list[FieldSpec]:
        def said(declared: str | None) -> str:
            return f"the file says {declared}" if declared else "the file does not say: look at the picture"

        fields = [
            FieldSpec(
                "units", "Units", "choice", shown.units, shown.units_declared or shown.units,
                choices=tuple(dict.fromkeys([*UNITS, shown.units])),
                help=f"in which the file counts; {said(shown.units_declared)}",
            ),
            FieldSpec(
                "up", "Up axis", "choice", shown.up, shown.up_declared or shown.up,
                choices=tuple(dict.fromkeys([*AXES, shown.up])),
                help=f"the axis that points up; {said(shown.up_declared)}",
            ),
            FieldSpec(
                "rate", "Rate", "float", shown.rate, shown.rate, "Hz", 0.0, 10000.0,
                help="frames per second" if shown.rate_known else "frames per second; the file does not say",
            ),
        ]  # fmt: skip
        if len(shown.subjects) > 1:
            fields.insert(
                0, FieldSpec("subject", "Subject", "choice", shown.subject, shown.subject, choices=shown.subjects)
            )
        return fields

    def _fill(self, shown: ImportShown) -> None:
        with QSignalBlocker(self.points):
            self.points.clear()
            for label, measured in zip(shown.labels, shown.measured):
                item = QTreeWidgetItem(self.points, [label, f"{100 * measured:.1f} %"])
                item.setTextAlignment(1, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                item.setCheckState(0, Qt.CheckState.Checked)
        self.points.resizeColumnToContents(1)
        self.points.setColumnWidth(0, max(self.points.columnWidth(0), 9 * self.fontMetrics().height()))

    def _unticked(self) -> list[int]:
        items = [self.points.topLevelItem(k) for k in range(self.points.topLevelItemCount())]
        return [k for k, item in enumerate(items) if item is not None and item.checkState(0) != Qt.CheckState.Checked]

    def _tick(self, least: float) -> None:
        if self._shown is None:
            return
        with QSignalBlocker(self.points):
            for k, measured in enumerate(np.asarray(self._shown.measured)):
                if (item := self.points.topLevelItem(k)) is not None:
                    item.setCheckState(0, Qt.CheckState.Checked if measured >= least else Qt.CheckState.Unchecked)
        self._changed()

    def _set(self, name: str, value: Any) -> None:
        if self._shown is not None:
            self._shown = replace(self._shown, **{name: value})
            self._changed()

    def _changed(self, *_: object) -> None:
        if self._shown is not None:
            self.preview.set_points(self._shown.points, self._unticked())
            self._allow()
            self.changed.emit(self.choice())

    def _allow(self) -> None:
        none = self._shown is None or len(self._unticked()) == len(self._shown.labels)
        self.open_button.setEnabled(not none and not (self._shown is not None and self._shown.problem))
        self.open_button.setToolTip("Take at least one point" if none else "")
