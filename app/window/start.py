"""From the command line to the window."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Mapping
from pathlib import Path

from markerscope.solver.core.errors import InputError

_LIBRARIES = {
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-image.so.0": "libxcb-image0",
    "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxcb-xkb.so.1": "libxcb-xkb1",
    "libxcb-randr.so.0": "libxcb-randr0",
}
"""What Qt needs for a window under X11, and Debian's package of each."""


def display_problem(environment: Mapping[str, str] = os.environ) -> str:
    """Why no window can be opened here, empty if one can; asked first, since Qt ends the process."""
    chosen = environment.get("QT_QPA_PLATFORM", "").split(":")[0]
    if not sys.platform.startswith("linux") or chosen not in ("", "xcb"):
        return ""
    if environment.get("WAYLAND_DISPLAY") and chosen == "":
        return ""
    display = environment.get("DISPLAY", "")
    if not display:
        return "there is no display"
    try:
        xcb = ctypes.CDLL("libxcb.so.1")
    except OSError:
        return "the library libxcb is missing; on Debian and Ubuntu: apt-get install libxcb1"
    if not _answers(xcb, display):
        return f"the display {display} does not answer"
    missing = [package for library, package in _LIBRARIES.items() if not _loads(library)]
    if missing:
        return f"libraries are missing; on Debian and Ubuntu: apt-get install {' '.join(missing)}"
    return ""


def _answers(xcb: ctypes.CDLL, display: str) -> bool:
    xcb.xcb_connect.restype = ctypes.c_void_p
    xcb.xcb_connection_has_error.argtypes = [ctypes.c_void_p]
    xcb.xcb_disconnect.argtypes = [ctypes.c_void_p]
    connection = xcb.xcb_connect(display.encode(), None)
    works = not xcb.xcb_connection_has_error(connection)
    xcb.xcb_disconnect(connection)
    return works


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def open_window(path: Path | None = None, example: bool = False) -> int:
    """Open the window, on a session or marker file, or on the embedded session; returns when it is closed.

    Raises
    ------
    InputError : no window can be opened here
    """
    if problem := display_problem():
        raise InputError(
            problem, "the window", "the commands work without one, for instance: markerscope demo --headless"
        )
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from markerscope.app.actions.view_actions import TEXT_PERCENT
    from markerscope.app.models.home import Home
    from markerscope.app.models.workbench import Workbench
    from markerscope.app.window.main import MainWindow
    from markerscope.app.window.mistakes import Mistakes
    from markerscope.widgets import theme

    app = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(app, QApplication)
    app.setApplicationName("Markerscope")
    home = Home.of_user()
    prefers = home.preferences()
    wanted, percent = prefers.get("theme"), prefers.get("text")
    scale = percent / 100 if percent in TEXT_PERCENT else 1.0
    theme.apply(app, wanted if wanted in theme.NAMES else "system", scale)
    bench = Workbench(home)
    window = MainWindow(bench)
    Mistakes(bench).watch()
    window.show()

    def begin() -> None:
        if path is not None:
            window.open_path(path)
        elif example:
            window.table.trigger("session.example")
            window.table.trigger("run.all")

    QTimer.singleShot(0, window, begin)
    return app.exec()
