"""Joint angles: which to show, and their curves of the left and the right side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QPainter, QPalette
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QSplitter,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QToolButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.boxes import ChoiceBox
from markerscope.widgets.icons import icon
from markerscope.widgets.plots.angle_plots import AnglePlots
from markerscope.widgets.plots.ink import pen
from markerscope.widgets.theme import colours

Index = QModelIndex | QPersistentModelIndex
FIRST = ("hip", "knee", "ankle")
"""Joints that are shown before the user chooses."""


class BoxDelegate(QStyledItemDelegate):
    """Frames the boxes, which the style leaves as dark as a dark ground."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Draw the item, then a frame about its box."""
        super().paint(painter, option, index)
        shown = QStyleOptionViewItem(option)
        self.initStyleOption(shown, index)
        style = shown.widget.style()
        box = style.subElementRect(QStyle.SubElement.SE_ItemViewItemCheckIndicator, shown, shown.widget)
        painter.setPen(pen(colours().faint))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(box).adjusted(0.5, 0.5, -0.5, -0.5))


class CurvesView(QWidget):
    """A list of joints with a box each, and the plots of those that are ticked.

    Signals
    -------
    seeked(time) : s
    shown_changed(titles) : the user ticked others
    joint_chosen(joint) : the name of a joint was clicked
    convention_chosen(name) : angles are to be told by another convention
    export_wanted()
    """

    seeked = Signal(float)
    shown_changed = Signal(list)
    joint_chosen = Signal(str)
    convention_chosen = Signal(str)
    export_wanted = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Joint angles")
        self._time = np.zeros(0)
        self._all: tuple[Any, ...] = ()
        self._view: tuple[float, float] | None = None
        self._old = False
        self.tree = QTreeWidget()
        self.tree.setHeaderHidden(True)
        self.tree.setItemDelegate(BoxDelegate(self.tree))
        self.tree.setAccessibleName("Angles to show")
        self.tree.itemChanged.connect(self._ticked)
        self.tree.itemClicked.connect(self._clicked)
        self.tree.itemActivated.connect(self._clicked)
        self.convention = ChoiceBox()
        self.convention.setAccessibleName("Convention of the angles")
        self.convention.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.convention.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.convention.setMinimumContentsLength(26)
        self.convention.activated.connect(lambda k: self.convention_chosen.emit(self.convention.itemData(k)))
        self.export = QToolButton()
        self.export.setIcon(icon("export"))
        self.export.setAutoRaise(True)
        self.export.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.export.setAccessibleName("Export angles")
        self.set_reasons("", "")
        self.export.clicked.connect(lambda: self.export_wanted.emit())
        self.set_conventions((), "")
        self.plots = AnglePlots()
        self.plots.seeked.connect(self.seeked)
        self._title = QLabel()
        self._title.setWordWrap(True)
        self._title.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        scroll = QScrollArea()
        scroll.setAccessibleName("Curves of the joint angles")
        scroll.setWidget(self.plots)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        right = QWidget()
        column = QVBoxLayout(right)
        column.setContentsMargins(0, 0, 0, 0)
        head = QHBoxLayout()
        head.setContentsMargins(4, 2, 4, 0)
        head.addWidget(self.convention)
        head.addWidget(self.export)
        head.addWidget(self._title, 1)
        column.addLayout(head)
        column.addWidget(scroll, 1)
        split = QSplitter(Qt.Orientation.Horizontal)
        split.addWidget(self.tree)
        split.addWidget(right)
        split.setStretchFactor(1, 1)
        split.setSizes([round(13 * self.fontMetrics().height()), 1000])
        split.setChildrenCollapsible(True)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(split)

    def set_curves(
        self,
        time: np.ndarray,
        plots: Sequence[Any],
        convention: str = "",
        zero_pose: str = "",
        reference: str = "",
        missing: str = "",
        old: bool = False,
    ) -> None:
        """Show a result.

        Parameters
        ----------
        time : (T,) s
        plots : see :class:`markerscope.widgets.plots.angle_data.AnglePlot`; references are drawn dashed
        convention, zero_pose : what the angles are, in words
        reference : what the dashed curves are of, in words
        missing : why something that is compared has no curves here, a sentence
        old : whether the result is out of date
        """
        again = [plot.title for plot in plots] == [plot.title for plot in self._all]
        self._time, self._all = np.asarray(time, float), tuple(plots)
        zero = f" Counted from {zero_pose[:1].lower()}{zero_pose[1:].rstrip('.')}." if zero_pose else ""
        dashed = any(curve.reference is not None for plot in plots for curve in plot.curves)
        against = f" Dashed: {reference or 'compared with'}." if dashed else ""
        every = [curve for plot in plots for curve in plot.curves]
        bands = " Bands: within two standard errors." if any(curve.error is not None for curve in every) else ""
        if any(curve.unmeasured for curve in every):
            bands += " Pale and dashed: no marker on either segment, the video's guess."
        told = "Degrees." if self.convention.count() else f"{convention}, degrees."
        told = f"Out of date. {told}" if old else told
        self._old = old
        self._title.setText(f"{told}{against}{bands} {missing}".rstrip() if plots else "")
        self._title.setToolTip(f"{convention}, degrees.{zero}" if plots else "")
        if not again:
            self._fill()
        self._show()

    def set_reasons(self, convention: str, export: str) -> None:
        """Say why another convention cannot be chosen and why nothing can be exported now, "" where it can."""
        allow(self.convention, convention, "By which convention the angles are told: their names, sequences and signs")
        allow(self.export, export, "Write the angles as CSV, in degrees")

    def set_conventions(self, choices: Sequence[tuple[str, str]], current: str) -> None:
        """Offer conventions, each a name and a title, one of them in force; nothing is emitted."""
        with QSignalBlocker(self.convention):
            self.convention.clear()
            for name, title in choices:
                self.convention.addItem(title, name)
                self.convention.setItemData(self.convention.count() - 1, title, Qt.ItemDataRole.ToolTipRole)
            self.convention.setCurrentIndex(self.convention.findData(current))
        for part in (self.convention, self.export):
            part.setVisible(bool(choices))

    def set_joint(self, joint: str | None) -> None:
        """Point at the joint of what is selected elsewhere, None for none; nothing is emitted."""
        self.plots.set_joint(joint)
        with QSignalBlocker(self.tree):
            groups = [self.tree.topLevelItem(k) for k in range(self.tree.topLevelItemCount())]
            found = next((g for g in groups if g is not None and g.data(0, Qt.ItemDataRole.UserRole) == joint), None)
            if found is not None:
                self.tree.setCurrentItem(found)
                found.setExpanded(True)
                self.tree.scrollToItem(found)
            else:
                self.tree.setCurrentIndex(QModelIndex())

    def set_shown(self, titles: Iterable[str]) -> None:
        """Tick these and no others; nothing is emitted."""
        wanted = set(titles)
        with QSignalBlocker(self.tree):
            for item in self._leaves():
                on = item.text(0) in wanted or item.data(0, Qt.ItemDataRole.UserRole) in wanted
                item.setCheckState(0, Qt.CheckState.Checked if on else Qt.CheckState.Unchecked)
        self._show()

    def shown(self) -> list[str]:
        """Titles of the plots that are ticked."""
        ticked = [item for item in self._leaves() if item.checkState(0) == Qt.CheckState.Checked]
        return [item.data(0, Qt.ItemDataRole.UserRole) for item in ticked]

    def set_time(self, time: float) -> None:
        """Move the cursor, s."""
        self.plots.set_time(time)

    def set_view(self, start: float, end: float) -> None:
        """Show this part of the clock, s."""
        self._view = (start, end)
        self._show()

    def sizeHint(self) -> QSize:
        """A dock across the window."""
        return QSize(900, round(24 * self.fontMetrics().height()))

    def _fill(self) -> None:
        with QSignalBlocker(self.tree):
            self.tree.clear()
            joints = list(dict.fromkeys(plot.joint for plot in self._all))
            first = [joint for joint in joints if joint in FIRST] or joints[:3]
            for joint in joints:
                group = QTreeWidgetItem(self.tree, [joint.replace("_", " ").capitalize()])
                group.setData(0, Qt.ItemDataRole.UserRole, joint)
                group.setToolTip(0, "A click selects the markers on the bones that turn about it")
                group.setFlags(group.flags() | Qt.ItemFlag.ItemIsAutoTristate | Qt.ItemFlag.ItemIsUserCheckable)
                for k, plot in enumerate(plot for plot in self._all if plot.joint == joint):
                    item = QTreeWidgetItem(group, [plot.title])
                    item.setData(0, Qt.ItemDataRole.UserRole, plot.title)
                    item.setToolTip(
                        0, "\n".join(f"{c.name}: positive is {c.positive}" for c in plot.curves if c.positive)
                    )
                    on = joint in first and k == 0
                    item.setCheckState(0, Qt.CheckState.Checked if on else Qt.CheckState.Unchecked)
                group.setExpanded(joint in first)

    def _leaves(self) -> list[QTreeWidgetItem]:
        groups = [self.tree.topLevelItem(k) for k in range(self.tree.topLevelItemCount())]
        found = [group.child(k) for group in groups if group is not None for k in range(group.childCount())]
        return [item for item in found if item is not None]

    def _clicked(self, item: QTreeWidgetItem) -> None:
        group = item.parent() or item
        self.joint_chosen.emit(group.data(0, Qt.ItemDataRole.UserRole))

    def _ticked(self, item: QTreeWidgetItem) -> None:
        if item.childCount() == 0:
            self._show()
            self.shown_changed.emit(self.shown())

    def _show(self) -> None:
        wanted = set(self.shown())
        whole = (float(self._time[0]), float(self._time[-1])) if len(self._time) > 1 else (0.0, 1.0)
        self.plots.set_plots(self._time, [p for p in self._all if p.title in wanted], self._view or whole, self._old)
