"""The panels of the window and where they stand at first."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDockWidget, QMainWindow, QSizePolicy, QTabWidget, QWidget


@dataclass(frozen=True)
class Panel:
    """A panel: its name in the program, its title, its widget, and where it stands at first."""

    name: str
    title: str
    widget: QWidget
    area: Qt.DockWidgetArea
    help: str = ""


class Docks:
    """All panels as docks.

    Attributes
    ----------
    docks : by name
    """

    def __init__(self, window: QMainWindow, panels: list[Panel]) -> None:
        self.window, self.panels = window, panels
        self.docks: dict[str, QDockWidget] = {}
        window.setDockNestingEnabled(True)
        window.setTabPosition(Qt.DockWidgetArea.AllDockWidgetAreas, QTabWidget.TabPosition.North)
        window.setCorner(Qt.Corner.BottomLeftCorner, Qt.DockWidgetArea.LeftDockWidgetArea)
        for panel in panels:
            dock = self.docks[panel.name] = QDockWidget(panel.title, window)
            dock.setObjectName(panel.name)
            dock.setWidget(panel.widget)
            dock.setToolTip(panel.help)
            dock.toggleViewAction().setToolTip(panel.help)
            panel.widget.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.arrange()

    def arrange(self) -> None:
        """Put every panel in its first place."""
        for panel in self.panels:
            dock = self.docks[panel.name]
            dock.setFloating(False)
            self.window.addDockWidget(panel.area, dock)
            dock.show()
        self.window.splitDockWidget(self.docks["video"], self.docks["affinity"], Qt.Orientation.Vertical)
        for before, after in pairwise(("affinity", "candidates", "hypotheses", "convergence", "markers")):
            self.window.tabifyDockWidget(self.docks[before], self.docks[after])
        self.window.tabifyDockWidget(self.docks["stages"], self.docks["history"])
        self.window.tabifyDockWidget(self.docks["timelines"], self.docks["angles"])
        for name in ("stages", "affinity", "timelines"):
            self.docks[name].raise_()
        width, height = self.window.width(), self.window.height()
        sides = [self.docks["stages"], self.docks["video"]]
        self.window.resizeDocks(sides, [int(0.24 * width), int(0.31 * width)], Qt.Orientation.Horizontal)
        self.window.resizeDocks([self.docks["timelines"]], [int(0.3 * height)], Qt.Orientation.Vertical)
        stack = [self.docks["video"], self.docks["affinity"]]
        self.window.resizeDocks(stack, [int(0.4 * height), int(0.55 * height)], Qt.Orientation.Vertical)

    def show(self, on: bool) -> None:
        """Show all panels, or none."""
        for dock in self.docks.values():
            dock.setVisible(on)

    def bring(self, name: str) -> None:
        """Bring a panel to the front."""
        dock = self.docks[name]
        dock.show()
        dock.raise_()
        dock.widget().setFocus()
