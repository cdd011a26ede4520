"""The panels of the window and where they stand at first."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtWidgets import QDockWidget, QMainWindow, QMenu, QSizePolicy, QTabBar, QTabWidget, QWidget

_GROUPS = (
    ("stages", "history"),
    ("video",),
    ("affinity", "candidates", "hypotheses", "convergence", "markers"),
    ("timelines", "curves", "angles"),
)
"""Panels that share a place, from the top of each side."""


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
        window.setDockOptions(
            QMainWindow.DockOption.AnimatedDocks
            | QMainWindow.DockOption.AllowNestedDocks
            | QMainWindow.DockOption.AllowTabbedDocks
            | QMainWindow.DockOption.GroupedDragging  # a tab can be dragged away
        )
        self._pending = QTimer(window, interval=0, singleShot=True)
        self._pending.timeout.connect(self._head)
        window.setTabPosition(Qt.DockWidgetArea.AllDockWidgetAreas, QTabWidget.TabPosition.North)
        window.setCorner(Qt.Corner.BottomLeftCorner, Qt.DockWidgetArea.LeftDockWidgetArea)
        for panel in panels:
            dock = self.docks[panel.name] = QDockWidget(panel.title, window)
            dock.setObjectName(panel.name)
            dock.setWidget(panel.widget)
            dock.setToolTip(panel.help)
            dock.toggleViewAction().setToolTip(panel.help)
            panel.widget.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
            for moved in (dock.dockLocationChanged, dock.topLevelChanged, dock.visibilityChanged):
                moved.connect(lambda *_: self._pending.start())
        self.arrange()

    def arrange(self) -> None:
        """Put every panel in its first place."""
        size = self.window.size()
        for dock in self.docks.values():
            dock.setFloating(False)
            self.window.removeDockWidget(dock)
        for group in _GROUPS:
            first = self.docks[group[0]]
            self.window.addDockWidget(self._area(group[0]), first)
            for name in group[1:]:  # at once, so that they never stand below each other, which would stretch the window
                self.window.tabifyDockWidget(first, self.docks[name])
        for dock in self.docks.values():
            dock.show()
        self.window.resize(size)
        for name in ("stages", "affinity", "timelines"):
            self.docks[name].raise_()
        width, height = self.window.width(), self.window.height()
        sides = [self.docks["stages"], self.docks["video"]]
        self.window.resizeDocks(sides, [int(0.23 * width), int(0.35 * width)], Qt.Orientation.Horizontal)
        self.window.resizeDocks([self.docks["timelines"]], [int(0.34 * height)], Qt.Orientation.Vertical)
        stack = [self.docks["video"], self.docks["affinity"]]
        self.window.resizeDocks(stack, [int(0.28 * height), int(0.36 * height)], Qt.Orientation.Vertical)
        self._head()

    def _area(self, name: str) -> Qt.DockWidgetArea:
        return next(panel.area for panel in self.panels if panel.name == name)

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

    def _head(self) -> None:
        """Give a title of its own only to a panel that has no tab to say it."""
        for dock in self.docks.values():
            beside = self.window.tabifiedDockWidgets(dock)
            in_tabs = not dock.isFloating() and any(not other.isHidden() for other in beside)
            bare: QWidget | None = dock.titleBarWidget()
            if in_tabs and bare is None:
                dock.setTitleBarWidget(QWidget(dock))
            elif not in_tabs and bare is not None:
                dock.setTitleBarWidget(None)  # type: ignore[arg-type]  # Qt's own again
                bare.deleteLater()
        for bar in self.window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
            bar.setElideMode(Qt.TextElideMode.ElideNone)  # arrows lead to tabs that have no room
            if bar.contextMenuPolicy() != Qt.ContextMenuPolicy.CustomContextMenu:
                bar.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
                bar.customContextMenuRequested.connect(lambda at, bar=bar: self._menu(bar, at))

    def _menu(self, bar: QTabBar, at: QPoint) -> None:
        """What a title's buttons do, for a panel that has a tab instead."""
        title = bar.tabText(bar.tabAt(at))
        dock = next((dock for dock in self.docks.values() if dock.windowTitle() == title), None)
        if dock is None:
            return
        menu = QMenu(bar)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.addAction("Float", lambda: dock.setFloating(True))
        menu.addAction("Close", dock.close)
        menu.popup(bar.mapToGlobal(at))
