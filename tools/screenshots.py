"""The pictures of the manual, from the embedded recording, without a display.

    python tools/screenshots.py [SESSION] [--out DIR]

SESSION is a solved session's folder; the embedded recording is solved first where none is given.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
if sys.platform.startswith("linux"):
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"

if TYPE_CHECKING:
    from app.window.main import MainWindow

Spin = Callable[..., None]


def main() -> int:
    """Take all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images")
    options = parser.parse_args()

    from PySide6.QtCore import QEvent
    from PySide6.QtWidgets import QApplication

    from app.models.home import Home
    from app.models.workbench import Workbench
    from app.window.main import MainWindow
    from widgets import theme

    app = QApplication([])
    theme.apply(app, "light")
    options.out.mkdir(parents=True, exist_ok=True)

    def spin(until: Callable[[], bool] | None = None, rest: float = 0.5) -> None:
        end = time.monotonic() + rest
        while time.monotonic() < end or (until is not None and not until()):
            app.processEvents()
            app.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)  # only a running event loop does it
            time.sleep(0.004)

    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        window = MainWindow(Workbench(Home(place / "config", place / "data")))
        window.show()
        take(window, spin, options.out, "welcome")
        session = options.session or solve(window, spin, place, options.out)
        copy = place / "example.markerscope"
        if session != copy:
            open_copy(session, copy)
        window.open_path(copy)
        spin(lambda: window.shown.get("angles") is not None and window.shown.track is not None, 1.5)
        spin(lambda: window.bench.frames is not None and window.bench.frames.done)
        window.table.trigger("run.all")
        spin(lambda: not window.bench.runner.running and not window.shown.stale("angles"), 1.0)
        window.messages.clear()
        pictures(window, spin, options.out)
        theme.apply(app, "dark")
        window.redraw()
        window.raise_dock("timelines")
        take(window, spin, options.out, "dark")
        window.leave()
    return 0


def open_copy(session: Path, copy: Path) -> None:
    """A copy that may be changed, as it looks when it is opened for the first time."""
    from solver.pipeline.session import load_session, save_session

    shutil.copytree(session, copy, ignore=shutil.ignore_patterns("view.json", "journal.json"))
    save_session(replace(load_session(session), folder=copy))


def solve(window: MainWindow, spin: Spin, place: Path, out: Path) -> Path:
    """Solve the embedded recording in the window."""
    window.table.trigger("session.example")
    spin(lambda: window.bench.clock.timing.frames > 0)
    window.table.trigger("run.all")
    spin(lambda: window.bench.runner.at is not None and window.bench.runner.at.whole > 0.2)
    take(window, spin, out, "running")
    spin(lambda: not window.bench.runner.running)
    window.bench.document.save_as(place / "solved.markerscope")
    window.bench.close()
    return place / "solved.markerscope"


def pictures(window: MainWindow, spin: Spin, out: Path) -> None:
    """The solved session, inspector by inspector."""
    bench = window.bench
    bench.clock.seek(3.2)
    window.scene.view_from("isometric")
    window.scene.orbit(-0.4, -0.15)
    bench.selection.clear()
    window.raise_dock("stages")
    window.raise_dock("timelines")
    window.raise_dock("affinity")
    take(window, spin, out, "window")
    bench.selection.select_markers([3, 9])
    spin()
    window.affinity.parentWidget().grab().save(str(out / "affinity.png"))
    bench.selection.clear()
    bench.display.set(colour_by="residual")
    bench.display.show("labels", True)
    bench.display.show("trails", True)
    spin()
    window.scene.grab().save(str(out / "scene.png"))
    bench.display.set(colour_by="cluster")
    for layer in ("labels", "trails"):
        bench.display.show(layer, False)
    window.raise_dock("candidates")
    bench.selection.select(candidate=1)
    spin()
    window.docks.docks["candidates"].grab().save(str(out / "candidates.png"))
    bench.selection.clear()
    window.raise_dock("angles")
    spin()
    window.docks.docks["angles"].grab().save(str(out / "angles.png"))
    window.raise_dock("timelines")
    spin()
    window.docks.docks["timelines"].grab().save(str(out / "timelines.png"))


def take(window: MainWindow, spin: Spin, out: Path, name: str) -> None:
    """A picture of the whole window, once it is at rest."""
    spin()
    window.grab().save(str(out / f"{name}.png"))


if __name__ == "__main__":
    sys.exit(main())
