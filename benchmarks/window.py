"""How quick the window is: started, stepped, its cut dragged, while a fit runs, with a long recording.

    QT_QPA_PLATFORM=offscreen VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow python -m benchmarks.window [SESSION]

SESSION is a solved session's folder; the embedded recording is solved first where none is given. Prints a Markdown
table of figures beside what they are to be. Each is one run on this machine as it is now.
"""

from __future__ import annotations

import argparse
import gc
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from app.cli_commands import DEMO_VIDEO

STEPS, MEMORY_STEPS, DRAGS = 150, 2000, 60


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path, nargs="?")
    parser.add_argument("--start", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.start is not None:
        show_and_leave(options.start)
        return
    print("| | measured | wanted |\n|---|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        starts(place)
        dragging(place)
        with window_on(place) as (window, spin):
            long_recording(window, spin, place)
        with window_on(place) as (window, spin):
            session = options.session or solve_demo(window, spin, place)
            copy = place / "measured.markerscope"
            take(session, copy)
            window.open_path(copy)
            spin(lambda: window.shown.get("angles") is not None and window.bench.frames is not None, 60)
            spin(lambda: window.bench.frames.done, 120)  # type: ignore[union-attr]
            steps(window, spin)
            stall(window, spin)
            memory(window, spin)


def say(*cells: str) -> None:
    """A row of the table, as soon as it is known."""
    print("| " + " | ".join(cells) + " |", flush=True)


def take(session: Path, copy: Path) -> None:
    """A copy of a session that may be changed; the paths in its file are relative."""
    from dataclasses import replace

    from solver.pipeline.session import load_session, save_session

    shutil.copytree(session, copy)
    save_session(replace(load_session(session), folder=copy))


def show_and_leave(since: float) -> None:
    """In a process of its own: open the empty window, and say how long that took from before Python started."""
    from PySide6.QtWidgets import QApplication

    from app.models.home import Home
    from app.models.workbench import Workbench
    from app.window.main import MainWindow
    from widgets import theme

    app = QApplication([])
    theme.apply(app, "light")
    with tempfile.TemporaryDirectory() as folder:
        window = MainWindow(Workbench(Home(Path(folder) / "config", Path(folder) / "data")))
        window.show()
        for _ in range(5):
            app.processEvents()
        print(time.time() - since, flush=True)
        window.leave()


def starts(place: Path) -> None:
    """Start the program several times."""
    took = []
    for _ in range(4):
        words = [sys.executable, "-m", "benchmarks.window", "--start", repr(time.time())]
        ran = subprocess.run(words, capture_output=True, text=True, check=True)
        took.append(float(ran.stdout.split()[-1]))
    say("window up, warm start (median of 3, first one left out)", f"{np.median(took[1:]):.2f} s", "2.5 s")


@contextmanager
def window_on(place: Path) -> Iterator[tuple[object, Callable[..., None]]]:
    """A window, and a function that lets it live until something is so."""
    from PySide6.QtWidgets import QApplication

    from app.models.home import Home
    from app.models.workbench import Workbench
    from app.window.main import MainWindow
    from widgets import theme

    app = QApplication.instance() or QApplication([])
    theme.apply(app, "light")
    window = MainWindow(Workbench(Home(place / "config", place / "data")))
    window.bench.said.connect(lambda said: said.level == "error" and print(said.sentence, file=sys.stderr))
    window.show()

    def spin(until: Callable[[], bool] | None = None, seconds: float = 120.0) -> None:
        end = time.monotonic() + seconds
        for _ in range(10):
            app.processEvents()
        while until is not None and not until():
            if time.monotonic() > end:
                raise SystemExit(f"waited for {seconds} s in vain")
            app.processEvents()
            time.sleep(0.002)

    yield window, spin
    window.leave()
    for _ in range(10):
        app.processEvents()


def solve_demo(window, spin, place: Path) -> Path:  # type: ignore[no-untyped-def]
    """The embedded recording, solved and saved."""
    window.table.trigger("session.example")
    spin(lambda: window.bench.clock.timing.frames > 0)
    window.table.trigger("run.all")
    spin(lambda: not window.bench.runner.running, 600)
    window.bench.document.save_as(place / "demo.markerscope")
    window.bench.close()
    spin()
    return place / "demo.markerscope"


def steps(window, spin) -> None:  # type: ignore[no-untyped-def]
    """A step of the clock with everything that can be seen at once."""
    window.raise_dock("angles")
    spin()
    clock = window.bench.clock
    frames = np.linspace(0, clock.timing.frames - 1, STEPS).astype(int)
    for detail, words in ((False, "full body"), (True, "coarse body, as while playing")):
        clock.playing = detail
        took = []
        for frame in frames:
            began = time.perf_counter()
            clock.seek_marker_frame(int(frame))
            spin()
            took.append(1000 * (time.perf_counter() - began))
        clock.playing = False
        median, late = statistics.median(took), float(np.percentile(took, 95))
        markers = len(window.shown.markers.labels)
        size = window.bench.frames.at(clock.video_time).size
        what = f"clock step, {words}, {markers} markers, video {size[0]}x{size[1]}, three plots of angles: median; p95"
        say(what, f"{median:.0f}; {late:.0f} ms", "60 ms")


def memory(window, spin) -> None:  # type: ignore[no-untyped-def]
    """What 2,000 steps leave behind."""
    clock = window.bench.clock

    def go(count: int) -> None:
        for step in range(count):
            clock.seek_marker_frame(7 * step % clock.timing.frames)
            spin()

    go(MEMORY_STEPS // 4)
    gc.collect()
    before = resident()
    go(MEMORY_STEPS)
    gc.collect()
    say(f"memory over {MEMORY_STEPS} steps", f"{resident() - before:+.1f} MB", "0 MB")


def stall(window, spin) -> None:  # type: ignore[no-untyped-def]
    """The longest that the event loop was away while stages run, and what is drawn meanwhile."""
    from PySide6.QtCore import QTimer

    from app.models import edits

    document = window.bench.document
    seed = document.session.run.seed + 1
    document.apply(edits.set_value(document.session, "localize", "keep", 15))
    document.apply(edits.set_seed(document.session, seed))
    spin()
    beats: list[float] = []
    timer = QTimer(interval=0)
    timer.timeout.connect(lambda: beats.append(time.perf_counter()))
    timer.start()
    window.table.trigger("run.all")
    spin_without_rest(lambda: not window.bench.runner.running)
    timer.stop()
    gaps = 1000 * np.diff(beats)
    late = f"{gaps.max():.0f} ms; {int((gaps > 50).sum())} over 50 ms of {len(gaps)}"
    say("worst stall of the event loop while stages run", late, "50 ms")


def spin_without_rest(until: Callable[[], bool]) -> None:
    """Let the event loop run as it does in the program."""
    from PySide6.QtCore import QEventLoop, QTimer

    loop, watch = QEventLoop(), QTimer(interval=20)
    watch.timeout.connect(lambda: loop.quit() if until() else None)
    watch.start()
    loop.exec()


def long_recording(window, spin, place: Path) -> None:  # type: ignore[no-untyped-def]
    """Ten minutes at 100 Hz with 60 markers: opened until all is drawn, then stepped."""
    from app.models.imports import new_session
    from benchmarks.views import made_up
    from solver.body.bones import with_bone_lengths
    from solver.body.model import Body
    from solver.io.export_c3d import write_c3d
    from solver.markers import Markers

    positions = made_up(with_bone_lengths(Body.load()), frames=60_000, markers=60)["markers"].positions
    path = place / "long.c3d"
    write_c3d(path, Markers(positions, 100.0, tuple(f"M{k}" for k in range(60))), up="z")
    began = time.perf_counter()
    window.bench.document.new(**new_session(path))
    spin(lambda: window.bench.clock.timing.frames == 60_000 and window.shown.tracks is not None)
    opened = time.perf_counter() - began
    say("10 min at 100 Hz, 60 markers: from the file to the picture", f"{opened:.1f} s", "5 s")
    took = []
    for frame in np.linspace(0, 59_999, STEPS).astype(int):
        began = time.perf_counter()
        window.bench.clock.seek_marker_frame(int(frame))
        spin()
        took.append(1000 * (time.perf_counter() - began))
    late = float(np.percentile(took, 95))
    say("the same, clock step: median; p95", f"{statistics.median(took):.0f}; {late:.0f} ms", "60 ms")


def dragging(place: Path) -> None:
    """The cut of a tree of 100 markers dragged in the window, until scene and matrix are drawn."""
    from app.models.imports import new_session
    from solver.io.export_c3d import write_c3d
    from solver.markers import Markers

    rng = np.random.default_rng(0)
    centres = rng.normal(0, 0.5, (1, 12, 3)) + 0.05 * rng.normal(0, 1, (600, 12, 3)).cumsum(axis=0) / 10
    places = (
        centres[:, np.arange(100) % 12] + rng.normal(0, 0.05, (1, 100, 3)) + 0.002 * rng.normal(0, 1, (600, 100, 3))
    )
    path = place / "many.c3d"
    write_c3d(path, Markers(places, 100.0, tuple(f"M{k}" for k in range(100))), up="z")
    with window_on(place) as (window, spin):
        given = new_session(path, video=DEMO_VIDEO)
        window.bench.document.new(**given)
        spin(lambda: window.bench.clock.timing.frames == 600 and window.shown.tracks is not None)
        window.bench.runner.run(["segment"])
        spin(lambda: not window.bench.runner.running and window.shown.segmentation is not None)
        spin()
        heights = np.quantile(window.shown.segmentation.linkage[:, 2], np.linspace(0.05, 0.98, DRAGS))
        took = []
        for height in heights:
            began = time.perf_counter()
            window.affinity.cut_dragged.emit(float(height))
            spin()
            took.append(1000 * (time.perf_counter() - began))
        late = float(np.percentile(took, 95))
        say("cut dragged, 100 markers: median; p95", f"{statistics.median(took):.0f}; {late:.0f} ms", "50 ms")


def resident() -> float:
    """MB of memory in use by this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main()
