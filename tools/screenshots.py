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
    from PySide6.QtWidgets import QWidget

    from markerscope.app.window.main import MainWindow

Spin = Callable[..., None]


def main() -> int:
    """Take all pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path, nargs="?")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "images")
    options = parser.parse_args()

    from PySide6.QtCore import QEvent
    from PySide6.QtWidgets import QApplication

    from markerscope.app.models.home import Home
    from markerscope.app.models.workbench import Workbench
    from markerscope.app.window.main import MainWindow
    from markerscope.widgets import theme

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
        session = options.session or solve(window, spin, place)
        copy = place / "example.markerscope"
        if session != copy:
            open_copy(session, copy)
        window.open_path(copy)
        spin(lambda: window.bench.clock.timing.frames > 0, 1.5)
        spin(lambda: window.bench.frames is not None and window.bench.frames.done)
        window.table.trigger("run.all")
        spin(lambda: window.bench.runner.at is not None and window.bench.runner.at.stage == "localize", 0.0)
        take(window, spin, options.out, "running")
        spin(lambda: not window.bench.runner.running and not window.shown.stale("angles"), 1.0)
        window.messages.clear()
        pictures(window, spin, options.out)
        dialogs(window, spin, options.out)
        theme.apply(app, "dark")
        window.redraw()
        window.raise_dock("timelines")
        take(window, spin, options.out, "dark")
        window.leave()
    return 0


def open_copy(session: Path, copy: Path) -> None:
    """A copy that may be changed, as it looks when it is opened for the first time; the search is still to be run."""
    from markerscope.solver.pipeline.session import load_session, save_session

    later = ("localize", "orient", "fit", "angles", "surface")
    shutil.copytree(session, copy, ignore=shutil.ignore_patterns("view.json", "journal.json", "outputs.json"))
    for stage in later:
        shutil.rmtree(copy / "results" / stage, ignore_errors=True)
    save_session(replace(load_session(session), folder=copy))


def solve(window: MainWindow, spin: Spin, place: Path) -> Path:
    """Solve the embedded recording in the window."""
    window.table.trigger("session.example")
    spin(lambda: window.bench.clock.timing.frames > 0)
    window.table.trigger("run.all")
    spin(lambda: not window.bench.runner.running)
    window.bench.document.save_as(place / "solved.markerscope")
    window.bench.close()
    return place / "solved.markerscope"


def pictures(window: MainWindow, spin: Spin, out: Path) -> None:
    """The solved session, task by task."""
    from PySide6.QtWidgets import QAbstractButton

    bench, docks = window.bench, window.docks.docks

    def dock(name: str, file: str, rest: float = 0.8) -> None:
        window.raise_dock(name)
        spin(rest=rest)
        keep(docks[name], out / f"{file}.png")

    bench.clock.seek(3.2)
    window.table.trigger("camera.isometric")
    window.table.trigger("camera.fit")
    window.scene.orbit(-0.4, -0.15)
    bench.selection.clear()
    for name in ("stages", "timelines", "affinity"):
        window.raise_dock(name)
    take(window, spin, out, "window")

    found = bench.board.current["segment"].clusters
    chosen = [int(marker) for marker in (found == 0).nonzero()[0]]
    bench.selection.select_markers(chosen[:2])
    dock("affinity", "affinity")
    bench.display.show("labels", True)
    bench.selection.select_markers(chosen)
    spin()
    keep(window.scene, out / "groups.png")
    bench.selection.clear()
    bench.display.show("labels", False)
    bench.display.set(colour_by="residual")
    bench.display.show("trails", True)
    spin()
    keep(window.scene, out / "scene.png")
    bench.display.set(colour_by="cluster")
    bench.display.show("trails", False)

    window.raise_dock("candidates")
    for button in window.candidates.findChildren(QAbstractButton):
        if button.text().startswith("Scored"):
            button.click()
    bench.selection.select(candidate=1)
    dock("candidates", "candidates")
    keep(window.scene, out / "ghost.png")
    bench.selection.clear()
    dock("hypotheses", "hypotheses", 2.5)
    dock("markers", "markers")
    dock("timelines", "timelines")
    curves(window, spin, dock)
    window.stages.set_open_cards(["clean"])
    window.raise_dock("stages")
    spin()
    keep(window.stages.card("clean"), out / "cleaning.png")
    window.stages.set_open_cards([])
    compared(window, spin, out, dock)


def curves(window: MainWindow, spin: Spin, dock: Callable[[str, str], None]) -> None:
    """A gap of some length, previewed by every way of filling."""
    bench = window.bench
    work = bench.working.now()
    assert work is not None
    gap = max((g for g in work.gaps if g.first > 50), key=lambda g: g.length)
    window.raise_dock("curves")
    bench.selection.select_markers([gap.marker])
    bench.clock.seek_marker_frame(gap.first)
    spin(lambda: bench.previews.gap == gap and not bench.previews.busy, 0.5)
    window.curves.plots.show_gap(bench.clock.time)
    dock("curves", "marker-curves")
    window.curves.plots.reset()
    bench.selection.clear()
    bench.clock.seek(3.2)


def compared(window: MainWindow, spin: Spin, out: Path, dock: Callable[[str, str], None]) -> None:
    """The fit of the first answer beside one that trusts the video more."""
    from markerscope.app.models import edits

    bench = window.bench
    first = {stage: bench.board.keys[stage] for stage in ("fit", "angles")}
    bench.apply(edits.set_value(bench.document.session, "fit", "video_share", 4.0))
    window.table.trigger("run.all")
    spin(lambda: not bench.runner.running and not window.shown.stale("angles"), 1.0)
    for stage, key in first.items():
        bench.board.compare(stage, key, True)
    spin(lambda: bool(window.shown.compared("fit")), 1.0)
    dock("angles", "angles")
    dock("timelines", "compare")
    window.stages.set_open_cards(["fit"])
    window.raise_dock("stages")
    spin()
    keep(window.stages.card("fit"), out / "results.png")
    window.stages.set_open_cards([])
    window.raise_dock("stages")


def dialogs(window: MainWindow, spin: Spin, out: Path) -> None:
    """What asks, and the search."""
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
    from markerscope.app.window.importing import ask_how_to_import
    from markerscope.widgets.dialogs.export_dialog import ExportDialog

    def grab(name: str) -> None:
        def look() -> None:
            dialog = QApplication.activeModalWidget()
            if dialog is not None:
                timer.stop()
                if isinstance(dialog, ExportDialog):
                    dialog.set_folder("exported/trial 3")
                dialog.resize(dialog.sizeHint())
                spin()
                keep(dialog, out / f"{name}.png")
                dialog.close()

        timer = QTimer(window, interval=200)
        timer.timeout.connect(look)
        timer.start()

    grab("import")
    ask_how_to_import(window, DEMO_MARKERS, lambda: None, Path(DEMO_VIDEO.name))
    grab("export")
    window.asks.what_to_export()
    window.table.trigger("help.search")
    palette = window.asks.showing.palette  # type: ignore[attr-defined]
    palette.line.setText("pin")
    spin()
    keep(palette, out / "search.png")
    palette.hide()


def take(window: MainWindow, spin: Spin, out: Path, name: str) -> None:
    """A picture of the whole window, once it is at rest."""
    spin()
    keep(window, out / f"{name}.png")


def keep(widget: QWidget, path: Path) -> None:
    """Write what a widget shows, packed as well as PNG can."""
    from PySide6.QtGui import QImage, QImageWriter

    writer = QImageWriter(str(path), b"png")
    writer.setCompression(100)
    if not writer.write(widget.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)):
        raise SystemExit(f"{path} cannot be written: {writer.errorString()}")


if __name__ == "__main__":
    sys.exit(main())
