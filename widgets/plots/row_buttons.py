"""The buttons below the names of the rows: menus, and the automatic offset to be taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from PySide6.QtCore import QRectF
from PySide6.QtWidgets import QMenu, QToolButton, QWidget

from markerscope.widgets.menu_button import menu_button
from markerscope.widgets.plots.row_painters import OffsetPainter, RowPainter, offset_text

_SAME_S = 5e-4


class RowButtons:
    """Made on the rows' widget; placed whenever the rows are laid out anew.

    Parameters
    ----------
    owner : the rows' widget
    take : called with the automatic offset, s, as it is taken
    """

    def __init__(self, owner: QWidget, take: Callable[[float], None]) -> None:
        self._owner, self._take = owner, take
        self._menus: dict[str, QToolButton] = {}
        self._automatic: float | None = None
        self._accept = QToolButton(owner)
        self._accept.setAccessibleName("Take the automatic offset")
        self._accept.setToolTip("Take the offset that was found from the motion of both recordings")
        self._accept.clicked.connect(lambda: None if self._automatic is None else self._take(self._automatic))
        self._accept.hide()

    def add_menu(self, name: str, text: str, tip: str, menu: QMenu) -> None:
        """Offer a menu below the name of a row."""
        button = self._menus[name] = menu_button(text, tip, menu, self._owner)
        button.setAccessibleName(f"{name}: {text}")
        button.hide()

    def place(self, rows: Sequence[RowPainter], areas: Sequence[QRectF], margin: float) -> None:
        """Put every button at the foot of its row, and hide those that have none."""
        shown = {row.row.name: area for row, area in zip(rows, areas)}
        for name, button in self._menus.items():
            self._put(button, shown.get(name), margin)
        offset = next((row for row in rows if isinstance(row, OffsetPainter)), None)
        self._automatic = None if offset is None else offset.row.automatic
        if offset is None or self._automatic is None or abs(self._automatic - offset.offset) <= _SAME_S:
            self._put(self._accept, None, margin)
            return
        self._accept.setText(f"Use {offset_text(self._automatic)}")
        self._put(self._accept, shown[offset.row.name], margin)

    def _put(self, button: QToolButton, area: QRectF | None, margin: float) -> None:
        if area is not None:
            size = button.sizeHint()
            width = min(size.width(), round(margin) - 12)
            button.setGeometry(6, round(area.bottom()) - size.height(), width, size.height())
        button.setVisible(area is not None)
