"""The empty window: what to begin with."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from markerscope.app.actions import Actions
from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.welcome import Recent, WelcomePage


class WelcomeBinder:
    """Fills the list of recent sessions."""

    def __init__(
        self,
        widget: WelcomePage,
        bench: Workbench,
        actions: Actions,
        open_path: Callable[[Path], object],
        drop: Callable[[list[Path]], object],
    ) -> None:
        self.widget, self.bench = widget, bench
        bench.document.saved.connect(self.fill)
        bench.opened.connect(self.fill)
        widget.example_wanted.connect(lambda: actions.trigger("session.example"))
        widget.markers_wanted.connect(lambda: actions.trigger("session.markers"))
        widget.session_wanted.connect(lambda: actions.trigger("session.open"))
        widget.recent_chosen.connect(lambda path: open_path(Path(path)))
        widget.files_dropped.connect(lambda paths: drop([Path(path) for path in paths]))
        self.fill()

    def fill(self) -> None:
        """Offer what was opened before, and what a crash left."""
        document = self.bench.document
        left = [Recent(str(path), path.stem, "not saved, left by a crash") for path in document.left_by_crash()]
        recent = [
            Recent(str(row.path), row.path.stem, f"{row.path.parent}, {_when(row.when)}", row.exists)
            for row in document.home.recent()
        ]
        self.widget.set_recent([*left, *recent])


def _when(seconds: float) -> str:
    days = (time.time() - seconds) / 86400
    if days < 1 and time.localtime(seconds).tm_yday == time.localtime().tm_yday:
        return "today"
    return "this week" if days < 7 else time.strftime("%Y-%m-%d", time.localtime(seconds))
