"""Groups of markers edited from any view: the same menu, the same decisions, each of which can be undone."""

from __future__ import annotations

from functools import partial
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, Qt
from PySide6.QtGui import QContextMenuEvent, QMouseEvent
from PySide6.QtWidgets import QMenu

from markerscope.app.actions import Actions
from markerscope.app.actions.group_actions import EDIT_GROUPS, GroupEdit, Kind
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.colours import by_cluster
from markerscope.app.window.actions import native
from markerscope.app.window.shown import Shown
from markerscope.widgets.allow import allow
from markerscope.widgets.plots.affinity_menu import edit_menu
from markerscope.widgets.scene import Scene3D

_CLICK_PX = 4
_OFFERED = (
    "landmark.pin", "landmark.refuse", "landmark.release",
    "select.groups", "select.invert", "select.none", "camera.selected", "camera.fit", "tool.select",
)  # fmt: skip


class GroupEdits:
    """Carries out what such a menu asks for."""

    def __init__(self, table: Actions) -> None:
        self.table = table

    def ask(self, kind: str, markers: list[int], target: int) -> None:
        """Do one of "merge", "split", "leave_out", "take_in", or "move" to the group ``target``."""
        self.table.do(EDIT_GROUPS, GroupEdit(cast(Kind, kind), tuple(markers), target))

    def why_not(self, kind: str, markers: list[int], target: int) -> str:
        """Why that cannot be done, "" if it can."""
        return self.table.why_not_with(EDIT_GROUPS, GroupEdit(cast(Kind, kind), tuple(markers), target))


class SceneMenu(QObject):
    """The scene's menu: a right click that does not move, or the menu key, on the markers that are selected."""

    def __init__(self, scene: Scene3D, bench: Workbench, shown: Shown, table: Actions) -> None:
        super().__init__(scene)
        self.scene, self.bench, self.shown, self.table = scene, bench, shown, table
        self.asked = GroupEdits(table)
        self._pressed: QPoint | None = None
        scene.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Watch for what asks for a menu; the scene has all else."""
        if isinstance(event, QMouseEvent) and event.button() == Qt.MouseButton.RightButton:
            at = event.position().toPoint()
            if event.type() == QEvent.Type.MouseButtonPress:
                self._pressed = at
            elif event.type() == QEvent.Type.MouseButtonRelease and self._pressed is not None:
                still = (at - self._pressed).manhattanLength() < _CLICK_PX
                self._pressed = None
                if still:
                    self._open(at, at)
        elif isinstance(event, QContextMenuEvent):
            if event.reason() == QContextMenuEvent.Reason.Keyboard:
                self._open(None, self.scene.rect().center())
            return True  # a right drag pans: only its end tells whether it was one
        return False

    def menu_for(self, markers: list[int]) -> QMenu:
        """What can be done with these markers, and how to look at them."""
        clusters, tracks = self.shown.clusters, self.shown.markers
        if markers and clusters is not None and tracks is not None:
            inks = by_cluster(clusters).colours
            menu = edit_menu(self.scene, markers, clusters, tracks.labels, inks, self.asked.ask, self.asked.why_not)
            menu.addSeparator()
        else:
            menu = QMenu(self.scene)
        menu.setToolTipsVisible(True)
        for name in _OFFERED:
            action = self.table.table[name]
            made = menu.addAction(f"{action.title}\t{native(action)}", partial(self.table.trigger, name))
            reason, on = self.table.why_not(name), self.table.is_on(name)
            allow(made, reason, action.help)
            if on is not None:
                made.setCheckable(True)
                made.setChecked(on)
        return menu

    def _open(self, at: QPoint | None, place: QPoint) -> None:
        marker = -1 if at is None else self.scene.marker_at((at.x(), at.y()))
        selection = self.bench.selection
        if marker >= 0 and marker not in selection.markers:
            selection.select_markers([marker])
        menu = self.menu_for(sorted(selection.markers))
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(self.scene.mapToGlobal(place))
