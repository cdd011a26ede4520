"""What the residual row compares: which fits, over which markers, and by which value."""

from __future__ import annotations

from functools import partial

from PySide6.QtGui import QAction, QActionGroup
from PySide6.QtWidgets import QMenu

from markerscope.app.actions import Actions
from markerscope.app.actions.view_actions import RESIDUAL_SELECTED, RESIDUAL_VALUE, SHOW_FIT, ShownFit
from markerscope.app.models.display import STATISTICS
from markerscope.app.models.fits import CachedFits
from markerscope.app.models.workbench import Workbench

_LONGEST = 60


class ResidualMenu:
    """A menu that is made anew whenever it is opened."""

    def __init__(self, bench: Workbench, fits: CachedFits, table: Actions) -> None:
        self.bench, self.fits, self.table = bench, fits, table
        self.menu = QMenu()
        self.menu.setToolTipsVisible(True)
        self.menu.aboutToShow.connect(self.fill)

    def fill(self) -> None:
        """Offer the fits that there are now."""
        menu, display = self.menu, self.bench.display
        menu.clear()
        menu.addSection("Fits in the store")
        for key in self.fits.known:
            said = self.fits.said(key) or "in force"
            action = self._checked(
                said if len(said) <= _LONGEST else f"{said[:_LONGEST]}…", key not in display.hidden_fits
            )
            action.setToolTip(said)
            action.toggled.connect(partial(self._show, key))
        menu.addSection("Over the markers of each frame")
        group = QActionGroup(menu)
        for statistic, title in STATISTICS.items():
            action = self._checked(title, display.residual == statistic)
            group.addAction(action)
            action.triggered.connect(lambda on=True, statistic=statistic: self.table.do(RESIDUAL_VALUE, statistic))
        menu.addSeparator()
        only = self._checked("Selected markers only", display.residual_selected)
        only.toggled.connect(lambda on: self.table.do(RESIDUAL_SELECTED, on))

    def _checked(self, text: str, on: bool) -> QAction:
        action = self.menu.addAction(text)
        action.setCheckable(True)
        action.setChecked(on)
        return action

    def _show(self, key: str, on: bool) -> None:
        self.table.do(SHOW_FIT, ShownFit(key, on))
