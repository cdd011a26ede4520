"""Icons by what they mean here. They take the theme's colours as they are painted, so they follow a change of theme."""

from __future__ import annotations

from PySide6.QtCore import QPoint, QRect, QSize, Qt
from PySide6.QtGui import QIcon, QIconEngine, QPainter, QPixmap

from markerscope.widgets import theme

GLYPHS = {
    "play": "play", "pause": "pause", "stop": "stop", "step_back": "step-backward", "step_forward": "step-forward",
    "to_start": "skip-previous", "to_end": "skip-next", "loop": "repeat", "slower": "minus", "faster": "plus",
    "undo": "undo", "redo": "redo", "history": "history", "open": "folder-open", "save": "content-save",
    "save_as": "content-save-all", "export": "export", "import": "import", "copy": "content-copy", "delete": "delete",
    "camera": "camera", "video": "video", "movie": "movie-open", "search": "magnify", "help": "help-circle",
    "keyboard": "keyboard", "settings": "cog", "filter": "filter", "sort": "sort", "report": "file-document-outline",
    "info": "information", "warning": "alert", "error": "alert-circle", "good": "check-circle", "close": "close",
    "not_run": "circle-outline", "cached": "check-circle", "stale": "refresh", "running": "timer-sand",
    "failed": "alert-circle", "cancelled": "cancel", "run": "play", "run_to": "run-fast", "reset": "restart",
    "pin": "pin", "unpin": "pin-off", "merge": "call-merge", "split": "call-split", "move": "swap-horizontal",
    "leave_out": "eye-off", "take_in": "eye", "show": "eye", "hide": "eye-off", "compare": "compare",
    "target": "target", "body": "human", "skeleton": "bone", "markers": "grid", "labels": "label-outline",
    "trails": "vector-line",
    "ghost": "human-handsdown", "axes": "axis-arrow", "fit": "image-filter-center-focus", "box": "select-drag",
    "orbit": "rotate-orbit", "turntable": "rotate-3d-variant", "isometric": "cube-outline", "curves": "chart-line",
    "table": "table", "dark": "weather-night", "light": "weather-sunny", "theme": "theme-light-dark",
    "palette": "palette", "idea": "lightbulb-outline", "link": "link", "lock": "lock", "check": "check",
    "more": "dots-vertical", "up": "chevron-up", "down": "chevron-down", "left": "chevron-left",
    "right": "chevron-right",
}  # fmt: skip
"""Our names, and the Material Design glyph of each."""


def icon(name: str, colour: str = "text") -> QIcon:
    """The icon called ``name`` in :data:`GLYPHS`, in one of the colours of
    :class:`markerscope.widgets.theme.Colours`.
    """
    if name not in GLYPHS:
        raise KeyError(f"no icon is called {name}")
    return QIcon(_Engine(name, colour))


class _Engine(QIconEngine):
    def __init__(self, name: str, colour: str) -> None:
        super().__init__()
        self._name, self._colour = name, colour

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        """Draw the glyph as large as ``rect`` allows."""
        import qtawesome

        rgb = theme.colours().faint if mode == QIcon.Mode.Disabled else getattr(theme.colours(), self._colour)
        colour = theme.qcolour(rgb, 120 if mode == QIcon.Mode.Disabled else 255)
        font = qtawesome.font("mdi6", 1)
        font.setPixelSize(max(1, min(rect.width(), rect.height())))
        painter.save()
        painter.setFont(font)
        painter.setPen(colour)
        painter.drawText(rect, Qt.AlignmentFlag.AlignCenter, qtawesome.charmap(f"mdi6.{GLYPHS[self._name]}"))
        painter.restore()

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        """The icon on a transparent ground."""
        picture = QPixmap(size)
        if size.isEmpty():
            return picture  # asked for on screens with fine pixels while a button is being made
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        self.paint(painter, QRect(QPoint(0, 0), size), mode, state)
        painter.end()
        return picture

    def clone(self) -> QIconEngine:
        """Another engine for the same icon, as Qt asks for when it copies one."""
        return _Engine(self._name, self._colour)
