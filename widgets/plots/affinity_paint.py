"""Where the parts of the affinity view lie, and how each is painted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QImage, QPainter, QPolygonF

from markerscope.widgets import palette
from markerscope.widgets.plots.dendrogram import Dendrogram, blocks
from markerscope.widgets.plots.ink import colour, elided, image_of, legible, pen, y_axis
from markerscope.widgets.plots.scales import Scale, number
from markerscope.widgets.theme import colours

SCALE = "viridis"
MM = 1e3


@dataclass(frozen=True)
class Places:
    """Rectangles of the view, px.

    Attributes
    ----------
    tree, matrix : above each other, on the same columns
    strip : the groups' colours, between the two
    side : the same, left of the matrix
    labels : left of that
    bar : the colour scale
    """

    tree: QRectF
    matrix: QRectF
    strip: QRectF
    side: QRectF
    labels: QRectF
    bar: QRectF

    @staticmethod
    def of(width: float, height: float, metrics: QFontMetricsF, longest: str) -> Places:
        """Share out a widget, whose longest marker name is given."""
        line = metrics.height()
        left = max(
            min(metrics.horizontalAdvance(longest) + 12, 0.25 * width) + 10, metrics.horizontalAdvance("000 mm") + 12
        )
        right = metrics.horizontalAdvance("000 mm") + 32
        wide = max(width - left - right, 10.0)
        tall = max(height - 2 * line - 20, 20.0)
        top, strip = line + 4.0, 9.0
        tree = QRectF(left, top, wide, round(0.36 * tall))
        matrix = QRectF(left, tree.bottom() + strip + 3, wide, max(height - tree.bottom() - strip - 9, 10.0))
        return Places(
            tree,
            matrix,
            QRectF(left, tree.bottom() + 1, wide, strip),
            QRectF(left - strip - 2, matrix.top(), strip, matrix.height()),
            QRectF(4, matrix.top(), left - strip - 10, matrix.height()),
            QRectF(matrix.right() + 12, matrix.top() + 0.7 * line, 12, max(matrix.height() - 1.4 * line, 4)),
        )


def height_scale(tree: Dendrogram, area: QRectF) -> Scale:
    """Heights of joins to pixels, logarithmic: the cut is sought among the low ones."""
    heights = tree.linkage[:, 2] * MM if len(tree.linkage) else np.array([1.0])
    tallest = max(float(heights.max()), 1e-3)
    positive = heights[heights > tallest * 1e-3]
    lowest = 0.6 * float(positive.min()) if len(positive) else 0.1 * tallest
    return Scale(lowest, tallest * 1.25, area.bottom(), area.top(), log=True)


def matrix_image(matrix: np.ndarray, order: np.ndarray, low: float, high: float) -> QImage:
    """The matrix (M, M) in mm, in the order of the tree, one pixel a cell: bright pairs are rigid, logarithmic."""
    shown = np.log(np.clip(np.asarray(matrix)[np.ix_(order, order)], low, high))
    found = palette.sequential(-shown.ravel(), -np.log(high), -np.log(low), SCALE)
    return image_of(found.reshape(*shown.shape, 3))


def paint_tree(
    painter: QPainter, area: QRectF, tree: Dendrogram, scale: Scale, clusters: np.ndarray, inks: np.ndarray
) -> None:
    """The brackets; those within one group in its colour."""
    look, count = colours(), len(tree.order)
    y_axis(painter, area, scale, "mm", 2.2 * QFontMetricsF(painter.font()).height())
    if not len(tree.linkage):
        return
    painter.setClipRect(area.adjusted(-2, -2, 2, 2))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
    unit = area.width() / count
    found = tree.brackets
    x = area.left() + found[:, [0, 2]] * unit
    y = np.clip(scale.pixel(np.maximum(found[:, [1, 3, 4]] * MM, scale.low)), area.top(), area.bottom())
    changes = np.concatenate([[0], np.cumsum(np.diff(clusters) != 0)])
    spans = tree.spans[count:]
    within = (changes[spans[:, 0]] == changes[spans[:, 1] - 1]) & (clusters[spans[:, 0]] >= 0)
    plain, width = pen(look.faint, 1.2), 1.8 if unit > 6 else 1.2
    for k in range(len(found)):
        painter.setPen(pen(legible(inks[spans[k, 0]]), width) if within[k] else plain)
        (x0, x1), (y0, y1, top) = x[k], y[k]
        painter.drawPolyline(QPolygonF([QPointF(x0, y0), QPointF(x0, top), QPointF(x1, top), QPointF(x1, y1)]))
    painter.setClipping(False)


def paint_strips(painter: QPainter, places: Places, inks: np.ndarray, clusters: np.ndarray) -> None:
    """The groups' colours along both sides of the matrix; what is in no group stays empty."""
    look = colours()
    shown = np.where(clusters[:, None] >= 0, inks, np.array(look.window)).astype(np.uint8)
    painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
    painter.drawImage(places.strip, image_of(shown[None]))
    painter.drawImage(places.side, image_of(shown[:, None]))


def paint_blocks(painter: QPainter, area: QRectF, clusters: np.ndarray) -> None:
    """A frame about each run of a group on the diagonal, light within dark, to be seen on every colour."""
    unit_x, unit_y = area.width() / max(len(clusters), 1), area.height() / max(len(clusters), 1)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for _, first, last in blocks(clusters):
        box = QRectF(
            area.left() + first * unit_x, area.top() + first * unit_y, (last - first) * unit_x, (last - first) * unit_y
        )
        painter.setPen(pen((0, 0, 0), 2.5))
        painter.drawRect(box)
        painter.setPen(pen((255, 255, 255), 1))
        painter.drawRect(box)


def paint_labels(painter: QPainter, area: QRectF, labels: list[str], chosen: frozenset[int], order: np.ndarray) -> None:
    """Names of the markers where their rows are high enough, else of every so many."""
    look, line = colours(), QFontMetricsF(painter.font()).height()
    unit = area.height() / max(len(order), 1)
    stride = max(1, int(np.ceil(0.85 * line / max(unit, 1e-6))))
    for row in range(0, len(order), stride):
        marker = int(order[row])
        painter.setPen(colour(palette.SELECTED if marker in chosen else look.faint))
        box = QRectF(area.left(), area.top() + (row + 0.5) * unit - line / 2, area.width(), line)
        elided(painter, box, labels[marker], Qt.AlignmentFlag.AlignRight)


def paint_bar(painter: QPainter, area: QRectF, low: float, high: float) -> None:
    """The colour scale, in mm."""
    look, line = colours(), QFontMetricsF(painter.font()).height()
    painter.drawImage(area, image_of(palette.scale_table(SCALE)[:, None]))
    painter.setPen(pen(look.border))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(area)
    scale = Scale(low, high, area.bottom(), area.top(), log=True)
    painter.setPen(colour(look.faint))
    values = [v for v in scale.ticks(2.2 * line) if scale.at(v) > area.top() + 0.3 * line]
    for value in values:
        box = QRectF(area.right() + 4, scale.at(value) - line / 2, 200, line)
        text = f"{number(value)} mm" if value == values[-1] else number(value)
        painter.drawText(box, int(Qt.AlignmentFlag.AlignVCenter), text)


def paint_cut(painter: QPainter, area: QRectF, scale: Scale, cut: float, text: str) -> None:
    """The line that cuts the tree, a knob to grab it by, and what it makes."""
    look, metrics = colours(), QFontMetricsF(painter.font())
    y = min(max(scale.at(max(cut * MM, 1e-9)), area.top()), area.bottom())
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(pen(palette.SELECTED, 2))
    painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
    painter.setBrush(colour(palette.SELECTED))
    painter.drawEllipse(QPointF(area.right(), y), 5, 5)
    width = metrics.horizontalAdvance(text) + 12
    box = QRectF(area.right() - width - 8, y - metrics.height() - 4, width, metrics.height() + 2)
    if box.top() < area.top() - 2:
        box.moveTop(y + 4)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(colour(look.base, 225))
    painter.drawRoundedRect(box, 3, 3)
    painter.setPen(colour(look.text))
    painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), text)
