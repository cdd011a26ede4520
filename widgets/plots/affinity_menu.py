"""What can be done with markers of the affinity view."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import QMenu, QWidget

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.plots.ink import colour


def edit_menu(
    parent: QWidget,
    markers: list[int],
    clusters: np.ndarray,
    labels: Sequence[str],
    colours: np.ndarray,
    ask: Callable[[str, list[int], int], None],
    why_not: Callable[[str, list[int], int], str] = lambda kind, markers, target: "",
) -> QMenu:
    """A menu of edits.

    Parameters
    ----------
    markers : those to edit
    clusters : (M,) group of each marker, -1 for none
    labels, colours : of all markers; (M, 3) uint8
    ask : called with kind, markers and target group (-1 where there is none)
    why_not : called with the same, why it cannot be done; "" if it can
    """
    menu = QMenu(parent)
    groups = sorted({int(g) for g in clusters[markers] if g >= 0})
    menu.addSection(", ".join(labels[m] for m in markers[:4]) + (" …" if len(markers) > 4 else ""))

    menu.setToolTipsVisible(True)

    def add(kind: str, text: str) -> None:
        action = menu.addAction(icon(kind), text, lambda: ask(kind, markers, -1))
        allow(action, why_not(kind, markers, -1), text)

    add("merge", "Merge their groups")
    add("split", "Split off as a group of their own")
    moves = menu.addMenu(icon("move"), "Move to group")
    for group in sorted({int(g) for g in clusters if g >= 0} - (set(groups) if len(groups) == 1 else set())):
        members = np.flatnonzero(clusters == group)
        text = f"{group + 1}: {', '.join(labels[m] for m in members[:3])}{' …' if len(members) > 3 else ''}"
        swatch = QPixmap(16, 16)
        swatch.fill(colour(colours[members[0]]))
        action = moves.addAction(QIcon(swatch), text, lambda g=group: ask("move", markers, g))
        allow(action, why_not("move", markers, group), text)
    moves.setToolTipsVisible(True)
    add("leave_out", "Leave out")
    add("take_in", "Put back in")
    return menu
