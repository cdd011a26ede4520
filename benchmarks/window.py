"""How quick the window is: started, stepped, its cut dragged, while a fit runs, with a long recording, for a long time.

    QT_QPA_PLATFORM=offscreen VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow python -m benchmarks.window [SESSION]

SESSION is a solved session's folder; the embedded recording is solved first where none is given. The clock is stepped
in a session made from it, with 50 markers and a video of 1280 x 720 px whose key frames lie far apart. Prints a
Markdown table of figures beside what they are to be. Each is one run on this machine as it is now; the last column,
how long the window's own thread was at work (p95, longest), says what is left of it where nothing else runs.
"""

from __future__ import annotations

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.table import head, say, say_spread, timed, where

_MOST_BEATS = 5_000_000
STEPS, WARM_UP, MEMORY_STEPS, DRAGS = 150, 200, 2000, 60
Spin = Callable[..., None]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("session", type=Path, nargs="?")
    parser.add_argument("--start", type=float, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.start is not None:
        show_and_leave(options.start)
        return
    head()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        starts()
        with window_on(place) as (window, spin):
            dragging(window, spin, place)
            long_recording(window, spin, place)
        with window_on(place) as (window, spin):
            solved = options.session or solve_demo(window, spin, place)
            open_full_size(window, spin, solved, place)
            steps(window, spin)
            memory(window, spin)
            stalls(window, spin)
        print(f"\n{where(window)}")


def show_and_leave(since: float) -> None:
    """In a process of its own: open the empty window, and say how long that took from before Python started."""
    from PySide6.QtWidgets import QApplication

    from markerscope.app.models.home import Home
    from markerscope.app.models.workbench import Workbench
    from markerscope.app.window.main import MainWindow
    from markerscope.widgets import theme

    app = QApplication([])
    theme.apply(app, "light")
    with tempfile.TemporaryDirectory() as folder:
        window = MainWindow(Workbench(Home(Path(folder) / "config", Path(folder) / "data")))
        window.show()
        for _ in range(5):
            app.processEvents()
        print(time.time() - since, flush=True)
        window.leave()


def starts() -> None:
    """Start the program several times."""
    took = []
    for _ in range(4):
        words = [sys.executable, "-m", "benchmarks.window", "--start", repr(time.time())]
        ran = subprocess.run(words, capture_output=True, text=True, check=True)
        took.append(float(ran.stdout.split()[-1]))
    say("window up from a warm start: median of 3", f"{np.median(took[1:]):.2f} s", "2.5 s")


@contextmanager
def window_on(place: Path) -> Iterator[tuple[Any, Spin]]:
    """A window, and a function that lets it live until something is so."""
    from PySide6.QtWidgets import QApplication

    from markerscope.app.models.home import Home
    from markerscope.app.models.workbench import Workbench
    from markerscope.app.window.main import MainWindow
    from markerscope.widgets import theme

    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
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


def live(until: Callable[[], bool]) -> None:
    """Let the event loop run as it does in the program."""
    from PySide6.QtCore import QEventLoop, QTimer

    loop, watch = QEventLoop(), QTimer(interval=20)
    watch.timeout.connect(lambda: loop.quit() if until() else None)
    watch.start()
    loop.exec()


def solve_demo(window: Any, spin: Spin, place: Path) -> Path:
    """The embedded recording, solved and saved."""
    window.table.trigger("session.example")
    spin(lambda: window.bench.clock.timing.frames > 0)
    window.table.trigger("run.all")
    spin(lambda: not window.bench.runner.running, 600)
    window.bench.document.save_as(place / "demo.markerscope")
    window.bench.close()
    spin()
    return place / "demo.markerscope"


def open_full_size(window: Any, spin: Spin, solved: Path, place: Path) -> None:
    """Open the session that is stepped, and wait until all of it is there."""
    from benchmarks.sessions import full_size

    window.open_path(full_size(solved, place / "full.markerscope"))
    spin(lambda: window.shown.get("angles") is not None and window.bench.frames is not None, 60)
    spin(lambda: window.bench.frames.done, 120)
    window.raise_dock("angles")
    window.angles.set_shown(window.angles.shown()[:3])
    spin(lambda: window.scene.settled)


def steps(window: Any, spin: Spin) -> None:
    """A step of the clock with everything that can be seen at once."""
    clock, scene = window.bench.clock, window.scene
    size = window.bench.frames.at(clock.video_time).size
    session = (
        f"{len(window.shown.markers.labels)} markers, video {size[0]} x {size[1]}, {len(window.angles.shown())} plots"
    )
    random = np.random.default_rng(0).permutation(clock.timing.frames)
    usual = scene.patience_ms
    for patience, body in ((float("inf"), "full body in every frame"), (usual, "body as it moves")):
        for frames, order in ((np.arange(STEPS) + 200, "on by one"), (random[:STEPS], "anywhere")):
            scene.patience_ms, fine, took = patience, 0, []
            for frame in frames:

                def step(frame: int = int(frame)) -> None:
                    clock.seek_marker_frame(frame)
                    spin()

                took.append(timed(step))
                fine += scene.fine
            full = "" if patience == float("inf") else f" (full in {100 * fine / STEPS:.0f} % of the frames)"
            say_spread(f"clock step {order}, {body}{full}, {session}", took, "60 ms")
    scene.patience_ms = usual


def memory(window: Any, spin: Spin) -> None:
    """What 2,000 steps leave behind."""
    clock = window.bench.clock

    def go(count: int) -> float:
        for step in range(count):
            clock.seek_marker_frame(7 * step % clock.timing.frames)
            spin()
        gc.collect()
        return resident()

    before, quarter = go(WARM_UP), MEMORY_STEPS // 4
    after = [go(quarter) - before for _ in range(4)]
    words = ", ".join(f"{grown:+.1f}" for grown in after[:3])
    say(
        f"memory over {MEMORY_STEPS} steps, after {WARM_UP} (after each quarter: {words})",
        f"{after[-1]:+.1f} MB of {before:.0f}",
        "no growth",
    )


def stalls(window: Any, spin: Spin) -> None:
    """The longest that the event loop was away while stages run, and what is drawn meanwhile."""
    from PySide6.QtCore import QTimer

    from markerscope.app.models import edits

    document = window.bench.document
    seed = document.session.run.seed + 1
    document.apply(edits.set_value(document.session, "localize", "keep", 15))
    document.apply(edits.set_seed(document.session, seed))
    window.raise_dock("candidates")
    spin()
    # Written into an array: objects that pile up would be work for Python's collector, which is watched here as well.
    beats, count = np.zeros((_MOST_BEATS, 2)), 0

    def beat() -> None:
        nonlocal count
        beats[count % _MOST_BEATS] = time.perf_counter(), time.thread_time()
        count += 1

    timer = QTimer(interval=0)
    timer.timeout.connect(beat)
    timer.start()
    window.table.trigger("run.all")
    live(lambda: not window.bench.runner.running)
    rest = time.monotonic() + 1.0
    live(lambda: time.monotonic() > rest)
    timer.stop()
    assert count <= _MOST_BEATS, "the run took too long to be watched"
    gaps, own = 1000 * np.diff(beats[:count], axis=0).T
    late = f"{gaps.max():.0f} ms; {int((gaps > 50).sum())} over 50 ms"
    seconds = beats[count - 1, 0] - beats[0, 0]
    say(f"longest stall of the event loop while a fit runs, {seconds:.0f} s", late, "50 ms", f"{own.max():.0f} ms")


def long_recording(window: Any, spin: Spin, place: Path) -> None:
    """Ten minutes at 100 Hz with 60 markers: opened until all is drawn, then stepped."""
    from benchmarks.sessions import long_markers
    from markerscope.app.models.imports import new_session

    path = long_markers(place / "long.c3d")

    def open_it() -> None:
        window.bench.document.new(**new_session(path))
        spin(lambda: window.bench.clock.timing.frames == 60_000 and window.shown.tracks is not None)

    say("10 min at 100 Hz, 60 markers: from the file to the picture", f"{timed(open_it)[0] / 1000:.1f} s", "5 s")
    took = []
    for frame in np.linspace(0, 59_999, STEPS).astype(int):

        def step(frame: int = int(frame)) -> None:
            window.bench.clock.seek_marker_frame(frame)
            spin()

        took.append(timed(step))
    say_spread("the same, clock step", took, "60 ms")
    window.bench.close()
    spin()


def dragging(window: Any, spin: Spin, place: Path) -> None:
    """The cut of a tree of 100 markers dragged in the window, until scene and matrix are drawn."""
    from benchmarks.sessions import many_markers
    from markerscope.app.models.demo import DEMO_VIDEO
    from markerscope.app.models.imports import new_session

    window.bench.document.new(**new_session(many_markers(place / "many.c3d"), video=DEMO_VIDEO))
    spin(lambda: window.bench.clock.timing.frames == 600 and window.shown.tracks is not None)
    window.bench.runner.run(["segment"])
    spin(lambda: not window.bench.runner.running and window.shown.segmentation is not None)
    window.raise_dock("affinity")
    spin()
    took = []
    for height in np.quantile(window.shown.segmentation.linkage[:, 2], np.linspace(0.05, 0.98, DRAGS)):

        def drag(height: float = float(height)) -> None:
            window.affinity.cut_dragged.emit(height)
            spin()

        took.append(timed(drag))
    say_spread("cut dragged, 100 markers", took, "50 ms")
    window.bench.close()
    spin()


def resident() -> float:
    """MB of memory in use by this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main()
