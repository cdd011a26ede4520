"""The table of actions as menus, keys, the search and the shortcut sheet."""

from __future__ import annotations

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMainWindow, QMenu

from markerscope.app.actions import Action, Actions
from markerscope.widgets.dialogs.command_palette import PaletteEntry

_SEPARATED = {
    "session.example", "input.markers", "session.save", "session.close", "select.all", "select.groups", "candidate.pin",
    "offset.found", "range.selected", "body.less", "text.100", "window.layout", "play.forward", "range.from",
    "go.worst", "clean.next", "tracks.delete", "run.stop", "method.bundle", "export.picture", "help.about",
    "window.history",
}  # fmt: skip
"""Actions that begin another part of their menu."""
_WITHIN = {
    "colour": "Colours",
    "layer": "Layers",
    "camera": "Camera",
    "theme": "Look",
    "text": "Look",
    "fill": "Fill the gap by",
}
"""Actions of one group that share a menu within their menu, by what stands before the dot."""


def keys_of(action: Action) -> list[QKeySequence]:
    """The shortcuts as Qt has them."""
    return [QKeySequence(key) for key in action.keys]


def native(action: Action) -> str:
    """The shortcuts in words."""
    return ", ".join(keys.toString(QKeySequence.SequenceFormat.NativeText) for keys in keys_of(action))


class Menus:
    """The menu bar, which holds every action, and so every key.

    Attributes
    ----------
    actions : the table
    qt : Qt's action of each, by id
    """

    def __init__(self, window: QMainWindow, actions: Actions) -> None:
        self.actions = actions
        self.qt: dict[str, QAction] = {}
        self.menus: dict[str, QMenu] = {}
        for menu, members in actions.menus().items():
            made = self.menus[menu] = window.menuBar().addMenu(f"&{menu}")
            made.setToolTipsVisible(True)
            made.aboutToShow.connect(lambda members=members: self.refresh([action.id for action in members]))
            within: dict[str, QMenu] = {}
            for action in members:
                title = _WITHIN.get(action.id.partition(".")[0])
                place = made
                if title is not None and title not in within:
                    within[title] = made.addMenu(title)
                    within[title].setToolTipsVisible(True)
                if title is not None:
                    place = within[title]
                if action.id in _SEPARATED:
                    place.addSeparator()
                place.addAction(self._action(window, action))
        window.addActions(list(self.qt.values()))

    def _action(self, window: QMainWindow, action: Action) -> QAction:
        made = self.qt[action.id] = QAction(action.title.replace("&", "&&"), window)
        made.setShortcuts(keys_of(action))
        made.setAutoRepeat(action.id.startswith("play.") and action.id != "play.toggle")
        made.setStatusTip(action.help)
        made.setToolTip(action.help)
        made.setCheckable(action.checked is not None)
        made.triggered.connect(lambda checked=False, name=action.id: self._trigger(name))
        return made

    def _trigger(self, name: str) -> None:
        self.actions.trigger(name)
        self.refresh([name])

    def refresh(self, names: list[str] | None = None) -> None:
        """Show what can be done now, and why the rest cannot.

        A key whose action cannot be done still answers, with the reason: only menus that are open are greyed.
        """
        for name in names if names is not None else list(self.qt):
            made, reason, on = self.qt[name], self.actions.why_not(name), self.actions.is_on(name)
            help = self.actions.table[name].help
            made.setToolTip(f"{help} Not now: {reason}." if reason else help)
            if on is not None:
                made.setChecked(on)

    def entries(self) -> list[PaletteEntry]:
        """All actions as they are now, for the search."""
        return [
            PaletteEntry(
                action.id, f"{action.menu}: {action.title.rstrip('.')}", native(action), action.help,
                not (reason := self.actions.why_not(action.id)), reason,
            )
            for action in self.actions.table.values()
        ]  # fmt: skip

    def sheet(self) -> dict[str, list[tuple[str, str]]]:
        """Keys and what they do, by menu."""
        return {
            menu: [(native(action), action.title.rstrip(".")) for action in members if action.keys]
            for menu, members in self.actions.menus().items()
            if any(action.keys for action in members)
        }
