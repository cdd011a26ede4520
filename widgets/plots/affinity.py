"""Which markers move rigidly together: the matrix of their pairs, and the tree to cut by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QFontMetricsF,
    QHelpEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPixmap,
)
from PySide6.QtWidgets import QMenu, QToolTip, QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots import affinity_paint as paint
from markerscope.widgets.plots.affinity_below import Below
from markerscope.widgets.plots.affinity_menu import edit_menu
from markerscope.widgets.plots.affinity_paint import MM, Places
from markerscope.widgets.plots.dendrogram import Dendrogram
from markerscope.widgets.plots.ink import colour, em, pen, runs
from markerscope.widgets.plots.scales import Scale, number
from markerscope.widgets.theme import colours


class AffinityView(QWidget):
    """Matrix and dendrogram on the same columns; a line through the tree that is dragged up and down.

    Up and Down move the cut, Left and Right go from marker to marker, the menu key (or a right click) offers the edits.

    Signals
    -------
    cut_dragged(height) : m, while the line is dragged; whoever knows the groups answers with :meth:`set_clusters`
    cut_committed(height) : m, as it is let go or moved by a key
    pair_clicked(i, j) : a cell of the matrix
    leaves_clicked(markers, modifiers) : a label, a group's strip, or all below a branch
    edit_requested(kind, markers, target) : "merge", "split", "leave_out", "take_in", or "move" to the group ``target``
        (else -1)

    Attributes
    ----------
    edit_why_not : called with what ``edit_requested`` would say: why that cannot be done now, "" if it can
    """

    cut_dragged = Signal(float)
    cut_committed = Signal(float)
    pair_clicked = Signal(int, int)
    leaves_clicked = Signal(list, object)
    edit_requested = Signal(str, list, int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.edit_why_not: Callable[[str, list[int], int], str] = lambda kind, markers, target: ""
        self.setAccessibleName("Affinity of the markers")
        self.setAccessibleDescription("Standard deviation of the distance of every two markers, and the tree of groups")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self._matrix = np.zeros((0, 0))
        self._tree = Dendrogram(np.zeros((0, 4)), np.zeros(0, np.intp))
        self._order = np.zeros(0, np.intp)
        self._labels: list[str] = []
        self._clusters = np.zeros(0, np.intp)
        self._colours = np.zeros((0, 3), np.uint8)
        self._cut = 0.0
        self._ends = (1.0, 100.0)
        self._image: QImage | None = None
        self._selected: frozenset[int] = frozenset()
        self._pair: tuple[int, int] | None = None
        self._dragging = False

    def set_data(
        self,
        matrix: np.ndarray,
        order: np.ndarray,
        linkage: np.ndarray,
        labels: Sequence[str],
        cut: float,
        clusters: np.ndarray,
        marker_colours: np.ndarray,
        leaves: np.ndarray | None = None,
    ) -> None:
        """Show another tree.

        Parameters
        ----------
        matrix : (M, M) m, standard deviation of each pair's distance; NaN where unknown
        order : (U,) the markers of the tree from left to right
        linkage : (U - 1, 4) as scipy writes it, heights in m
        labels : M names
        cut : m
        clusters : (M,) group of each marker, -1 for none
        marker_colours : (M, 3) uint8
        leaves : (U,) the marker that each leaf of the tree is, None if leaf k is marker k
        """
        order = np.asarray(order, np.intp)
        leaves = np.arange(len(order)) if leaves is None else np.asarray(leaves, np.intp)
        leaf_of = {int(marker): leaf for leaf, marker in enumerate(leaves)}
        self._matrix, self._labels = np.asarray(matrix, float), list(labels)
        self._tree = Dendrogram(np.asarray(linkage, float), np.array([leaf_of[int(m)] for m in order], np.intp))
        self._order = order
        scale = self.height_scale()
        self._ends = (scale.low, scale.high)
        self._image = paint.matrix_image(self._matrix * MM, order, *self._ends) if len(order) else None
        self.set_clusters(clusters, marker_colours, cut)

    def set_clusters(self, clusters: np.ndarray, marker_colours: np.ndarray, cut: float | None = None) -> None:
        """Show other groups, (M,) and (M, 3), and the cut that made them; the matrix stays as it is."""
        self._clusters, self._colours = np.asarray(clusters, np.intp), np.asarray(marker_colours, np.uint8)
        if cut is not None and not self._dragging:
            self._cut = float(cut)
        self.update()

    def set_selected(self, markers: Iterable[int], pair: tuple[int, int] | None = None) -> None:
        """Frame markers, and the cell of a pair."""
        self._selected, self._pair = frozenset(int(m) for m in markers), pair
        self.update()

    def cut(self) -> float:
        """Height of the line, m."""
        return self._cut

    def groups(self) -> int:
        """How many groups there are, edits included."""
        return len(set(self._clusters[self._clusters >= 0].tolist()))

    def image(self) -> QPixmap:
        """The whole view as a picture."""
        return self.grab()

    def places(self) -> Places:
        """Where everything is drawn."""
        longest = max(self._labels, key=len, default="")
        return Places.of(self.width(), self.height(), QFontMetricsF(self.font()), longest)

    def height_scale(self) -> Scale:
        """Heights of the tree, mm, to pixels."""
        return paint.height_scale(self._tree, self.places().tree)

    def cell(self, i: int, j: int) -> QRectF:
        """Where the pair of two markers is drawn (row ``i``, column ``j``)."""
        area, count = self.places().matrix, len(self._tree.order)
        row, column = (int(np.flatnonzero(self._order == m)[0]) for m in (i, j))
        wide, tall = area.width() / count, area.height() / count
        return QRectF(area.left() + column * wide, area.top() + row * tall, wide, tall)

    def sizeHint(self) -> QSize:
        """Room for some forty markers."""
        return QSize(560, 640)

    def minimumSizeHint(self) -> QSize:
        """Small enough for a dock."""
        line = em(self)
        return QSize(round(16 * line), round(14 * line))

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw everything; only the matrix was prepared."""
        painter, look, places = QPainter(self), colours(), self.places()
        line = QFontMetricsF(self.font()).height()
        if self._image is None:
            painter.setPen(colour(look.faint))
            text = "The markers are not grouped yet: run the stage Segmentation."
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(QRectF(self.rect()).adjusted(12, 12, -12, -12), int(flags), text)
            return
        clusters, inks = self._clusters[self._order], self._colours[self._order]
        painter.fillRect(places.tree, colour(look.base))
        painter.setPen(colour(look.faint))
        box = QRectF(places.tree.left(), 1, places.tree.width(), line)
        painter.drawText(box, int(Qt.AlignmentFlag.AlignVCenter), "Standard deviation of distance, mm")
        scale = paint.height_scale(self._tree, places.tree)
        paint.paint_tree(painter, places.tree, self._tree, scale, clusters, inks)
        paint.paint_strips(painter, places, inks, clusters)
        painter.drawImage(places.matrix, self._image)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setClipRect(places.matrix.adjusted(-2, -2, 2, 2))
        paint.paint_blocks(painter, places.matrix, clusters)
        self._paint_selection(painter, places)
        painter.setClipping(False)
        paint.paint_labels(painter, places.labels, self._labels, self._selected, self._order)
        paint.paint_bar(painter, places.bar, *self._ends)
        groups = self.groups()
        text = f"{number(self._cut * MM, 0.1)} mm, {groups} group{'s' if groups != 1 else ''}"
        paint.paint_cut(painter, places.tree, scale, self._cut, text)

    def _paint_selection(self, painter: QPainter, places: Places) -> None:
        area, count = places.matrix, len(self._order)
        wide, tall = area.width() / count, area.height() / count
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(pen(palette.SELECTED, 1.5))
        for first, last in runs(np.isin(self._order, list(self._selected))):
            painter.drawRect(QRectF(area.left(), area.top() + first * tall, area.width(), (last - first) * tall))
            painter.drawRect(QRectF(area.left() + first * wide, area.top(), (last - first) * wide, area.height()))
        if self._pair is not None and {*self._pair} <= {*self._order.tolist()}:
            painter.setPen(pen(palette.SELECTED, 3))
            painter.drawRect(self.cell(*self._pair).adjusted(-1, -1, 1, 1))

    def below(self) -> Below:
        """What finds what lies at a point."""
        return Below(self.places(), self.height_scale(), self._tree, self._order, self._clusters, self._cut)

    # what the user does

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the cut, or choose what lies there."""
        at = event.position()
        if event.button() != Qt.MouseButton.LeftButton or self._image is None:
            return
        below = self.below()
        if below.is_cut(at):
            self._dragging = True
        elif (pair := below.pair(at)) is not None and pair[0] != pair[1]:
            self.pair_clicked.emit(*pair)
        elif markers := below.markers(at):
            self.leaves_clicked.emit(markers, event.modifiers())
        elif below.places.tree.contains(at):
            self._dragging = True
            self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag the cut."""
        if self._dragging:
            scale, area = self.height_scale(), self.places().tree
            self._cut = scale.value(min(max(event.position().y(), area.top()), area.bottom())) / MM
            self.update()
            self.cut_dragged.emit(self._cut)
        else:
            over = self._image is not None and self.below().is_cut(event.position())
            self.setCursor(Qt.CursorShape.SizeVerCursor if over else Qt.CursorShape.ArrowCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of it."""
        if self._dragging:
            self._dragging = False
            self.cut_committed.emit(self._cut)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Move the cut by a fiftieth, or go to the next marker."""
        key = event.key()
        if self._image is not None and key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self._cut *= 1.02 if key == Qt.Key.Key_Up else 1 / 1.02
            self.update()
            self.cut_dragged.emit(self._cut)
            self.cut_committed.emit(self._cut)
        elif self._image is not None and key in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            chosen = np.flatnonzero(np.isin(self._order, list(self._selected)))
            step = 1 if key == Qt.Key.Key_Right else -1
            at = (int(chosen[0] if step < 0 else chosen[-1]) + step) % len(self._order) if len(chosen) else 0
            self.leaves_clicked.emit([int(self._order[at])], event.modifiers())
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer the edits, for what is selected if the pointer is on it (or the menu key was used)."""
        markers = sorted(self._selected)
        if event.reason() == QContextMenuEvent.Reason.Mouse:
            below = [] if self._image is None else self.below().markers(QPointF(event.pos()))
            markers = markers if set(below) <= self._selected else below
        if markers:
            menu = self.menu_for(markers)
            menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
            menu.popup(event.globalPos())

    def menu_for(self, markers: list[int]) -> QMenu:
        """What can be done with these markers."""
        ask, why_not = self.edit_requested.emit, self.edit_why_not
        return edit_menu(self, markers, self._clusters, self._labels, self._colours, ask, why_not)

    def event(self, event: QEvent) -> bool:
        """Say what lies below the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            text = "" if self._image is None else self.below().tip(QPointF(event.pos()), self._labels, self._matrix)
            QToolTip.showText(event.globalPos(), text, self)
            return True
        return super().event(event)
