"""How the window looks, as plain values for the session's view.json, and back."""

from __future__ import annotations

import base64
import binascii
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QByteArray

if TYPE_CHECKING:
    from markerscope.app.window.main import MainWindow

LAYOUT_VERSION = 1


def parts_of(window: MainWindow) -> dict[str, Any]:
    """What only the widgets know."""
    return {
        "layout": base64.b64encode(window.saveState(LAYOUT_VERSION).data()).decode("ascii"),
        "size": [window.width(), window.height()],
        "camera": window.scene.camera_state(),
        "video": window.video.state(),
        "timelines": list(window.timelines.view()),
        "angles": window.angles.shown(),
        "curves": window.curves.state(),
        "open_stages": window.stages.open_cards(),
    }  # fmt: skip


def restore(window: MainWindow, view: dict[str, Any]) -> None:
    """Have the panels as they were; what cannot be understood is left as it is. Camera and views come with the data."""
    layout, size, opened = view.get("layout"), view.get("size"), view.get("open_stages")
    sound = isinstance(size, list) and len(size) == 2 and all(isinstance(n, int) and 400 <= n <= 10000 for n in size)
    if isinstance(size, list) and sound and not window.isMaximized() and not window.isFullScreen():
        window.resize(*size)
    if isinstance(layout, str):
        with suppress(binascii.Error, ValueError):
            window.restoreState(QByteArray(base64.b64decode(layout, validate=True)), LAYOUT_VERSION)
    window.curves.restore(view.get("curves"))
    if isinstance(opened, list):
        window.stages.set_open_cards(name for name in opened if isinstance(name, str))
