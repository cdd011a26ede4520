"""What of the affinity view lies below a point: a cell, a marker's name, a group's strip, a branch, the cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF

from markerscope.widgets.plots.affinity_paint import MM, Places
from markerscope.widgets.plots.dendrogram import Dendrogram
from markerscope.widgets.plots.scales import Scale, number

_REACH = 7.0
"""px from the cut within which it is grabbed."""


@dataclass(frozen=True, eq=False)
class Below:
    """The view as it is laid out now.

    Attributes
    ----------
    places, scale : where everything is, and heights of the tree, mm, to pixels
    tree, order : the dendrogram, and its (U,) markers from left to right
    clusters : (M,) group of each marker, -1 for none
    cut : m
    """

    places: Places
    scale: Scale
    tree: Dendrogram
    order: np.ndarray
    clusters: np.ndarray
    cut: float

    def column(self, x: float) -> int:
        """Place in the order of what is drawn at x, px."""
        area = self.places.matrix
        return int(np.clip((x - area.left()) / area.width() * len(self.order), 0, len(self.order) - 1))

    def row(self, y: float) -> int:
        """The same at y."""
        area = self.places.matrix
        return int(np.clip((y - area.top()) / area.height() * len(self.order), 0, len(self.order) - 1))

    def pair(self, at: QPointF) -> tuple[int, int] | None:
        """The two markers of a cell, the same twice on the diagonal; None beside the matrix."""
        if not self.places.matrix.contains(at):
            return None
        return int(self.order[self.row(at.y())]), int(self.order[self.column(at.x())])

    def is_cut(self, at: QPointF) -> bool:
        """Whether the cut is grabbed there."""
        area = self.places.tree
        y = min(max(self.scale.at(max(self.cut * MM, 1e-9)), area.top()), area.bottom())
        return abs(at.y() - y) <= _REACH and area.left() - 2 <= at.x() <= area.right() + _REACH

    def branch(self, at: QPointF) -> np.ndarray:
        """Markers below the lowest bracket whose lines are near a point."""
        area, scale, brackets = self.places.tree, self.scale, self.tree.brackets
        x = area.left() + brackets[:, [0, 2]] * area.width() / len(self.order)
        y = scale.pixel(np.maximum(brackets[:, [1, 3, 4]] * MM, scale.low))
        flat = (x[:, 0] - 4 <= at.x()) & (at.x() <= x[:, 1] + 4) & (np.abs(y[:, 2] - at.y()) <= 4)
        left = (np.abs(x[:, 0] - at.x()) <= 4) & (y[:, 2] <= at.y()) & (at.y() <= y[:, 0])
        right = (np.abs(x[:, 1] - at.x()) <= 4) & (y[:, 2] <= at.y()) & (at.y() <= y[:, 1])
        found = np.flatnonzero(flat | left | right)
        if not len(found):
            return np.zeros(0, np.intp)
        join = int(found[np.argmin(brackets[found, 4])])
        first, last = self.tree.spans[len(self.order) + join]
        return self.order[first:last]

    def markers(self, at: QPointF) -> list[int]:
        """The markers that are meant by a point: of a group's strip, a name, a branch or a cell."""
        places = self.places
        for area, index in ((places.strip, self.column(at.x())), (places.side, self.row(at.y()))):
            if area.adjusted(-2, -2, 2, 2).contains(at):
                group = self.clusters[self.order[index]]
                return np.flatnonzero(self.clusters == group).tolist() if group >= 0 else [int(self.order[index])]
        if places.labels.contains(at):
            return [int(self.order[self.row(at.y())])]
        if places.tree.contains(at):
            return [int(m) for m in self.branch(at)]
        pair = self.pair(at)
        return [] if pair is None else sorted({*pair})

    def tip(self, at: QPointF, labels: Sequence[str], matrix: np.ndarray) -> str:
        """What lies there in words; ``matrix`` (M, M) in m."""
        pair = self.pair(at)
        if pair is not None:
            i, j = pair
            if i == j:
                return f"{labels[i]}, {_group(self.clusters[i])}"
            value = matrix[i, j] * MM
            known = f"{number(value)} mm" if np.isfinite(value) else "never seen together"
            return f"{labels[i]} and {labels[j]}: standard deviation of distance {known}"
        if self.is_cut(at):
            return "Drag up for fewer groups, down for more: branches that join below the line are one group."
        markers = self.markers(at)
        if not markers:
            return "The higher two branches join, the less rigidly their markers move together."
        names = ", ".join(labels[m] for m in markers[:12]) + (" …" if len(markers) > 12 else "")
        return f"{names} ({_group(self.clusters[markers[0]])})" if len(markers) == 1 else f"{len(markers)}: {names}"


def _group(cluster: int) -> str:
    return f"group {cluster + 1}" if cluster >= 0 else "left out"
