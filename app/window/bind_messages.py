"""What the models have to say, in the window."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QTimer

from markerscope.app.models.workbench import Said, Workbench
from markerscope.widgets.panels.message_bar import Level, Message, MessageBar

_NOTE_MS = 12_000
_LEVELS: dict[str, Level] = {"note": "info", "warning": "warning", "error": "error"}


class MessagesBinder:
    """Shows every message; a note goes by itself, the others with the session that they are about."""

    def __init__(self, widget: MessageBar, bench: Workbench) -> None:
        self.widget, self.bench = widget, bench
        self._about: dict[str, Path | None] = {}
        bench.opened.connect(self._forget)
        bench.said.connect(self._say)
        bench.runner.changed.connect(lambda: widget.clear("run") if bench.runner.running else None)

    def _say(self, said: Said) -> None:
        key = f"{said.level} {said.sentence}"
        where = str(said.where)
        self._about[key] = self._folder()
        self.widget.show_message(Message(_LEVELS[said.level], said.what, where, said.remedy, key=key))
        if said.level == "note":
            QTimer.singleShot(_NOTE_MS, self.widget, lambda: self.widget.clear(key))

    def _folder(self) -> Path | None:
        return self.bench.document.folder if self.bench.document.is_open else None

    def _forget(self) -> None:
        for key in [key for key, folder in self._about.items() if folder != self._folder()]:
            self.widget.clear(key)
            del self._about[key]
