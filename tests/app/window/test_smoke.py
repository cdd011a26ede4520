"""The program as a user starts it, on a display of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from markerscope.app.window.start import display_problem
from markerscope.solver.pipeline.session import Session

ROOT = Path(__file__).parents[3]
SCRIPT = """
import os, sys
from pathlib import Path
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
import markerscope.app.window.main as main
from markerscope.app.cli.main import main as command

made = main.MainWindow.__init__

def watched(self, *given):
    made(self, *given)
    def look():
        if not self.bench.clock.timing.frames or self.bench.frames is None or not self.bench.frames.done:
            return
        timer.stop()
        shot = QApplication.primaryScreen().grabWindow(self.winId())
        shot.save(sys.argv[1])
        print(QApplication.platformName(), shot.width(), shot.height(), self.bench.clock.timing.frames)
        self.leave()
    timer = QTimer(self, interval=300)
    timer.timeout.connect(look)
    timer.start()

main.MainWindow.__init__ = watched
sys.exit(command([sys.argv[2]]))
"""


def _server(number: int | None, tcp: bool) -> tuple[subprocess.Popen[bytes], str] | None:
    """Start a display, of this number or of one that the server finds free; None where it does not start."""
    read, write = os.pipe()
    command = ["Xvfb", *([] if number is None else [f":{number}"]), "-displayfd", str(write)]
    command += ["-screen", "0", "1600x1000x24"]
    command += ["-listen", "tcp"] if tcp else ["-ac", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read, "rb") as told:
        chosen = told.readline().decode().strip()  # the end of the file where the server ends instead
    if not chosen:
        server.wait(20)
        return None
    return server, f"127.0.0.1:{chosen}" if tcp else f":{chosen}"


def _answers(display: str, seconds: float = 5.0) -> bool:
    """Whether a display takes a connection within some seconds."""
    end = time.monotonic() + seconds
    while "does not answer" in display_problem({"DISPLAY": display}):
        if time.monotonic() > end:
            return False
        time.sleep(0.1)
    return True


@pytest.fixture
def display() -> Iterator[str]:
    """The name of a display that was started for this test.

    The number that the server finds free may be taken all the same: by a server in another container that shares the
    network but not the files, whose socket a client then meets. So one that does not answer is given up for a number of
    our own, and at last, where no socket can be made among the files, for one on this computer's network.
    """
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    own = 200 + os.getpid() % 5000
    tried = []
    for number, tcp in ((None, False), (own, False), (own + 7, False), (own + 13, True)):
        started = _server(number, tcp)
        if started is None:
            tried.append(f"no server on {'a free number' if number is None else number}")
            continue
        server, name = started
        try:
            if _answers(name):
                yield name
                return
        finally:
            server.terminate()
            server.wait(20)
        tried.append(f"{name} does not answer")
    pytest.fail(f"Xvfb is installed, but there is no display: {'; '.join(tried)}")


def test_the_program_opens_its_window_and_shows_a_session(display: str, session: Session, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    from markerscope.widgets.images import to_rgb

    unset = ("QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {
        "DISPLAY": display,
        "MARKERSCOPE_HOME": str(tmp_path / "home"),
        "PYTHONPATH": os.environ["PYTHONPATH"],
    }
    if problem := display_problem(environment):
        pytest.skip(problem)
    shot = tmp_path / "shot.png"
    words = [sys.executable, "-c", SCRIPT, str(shot), str(session.folder)]
    started = subprocess.run(words, env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=180)
    assert started.returncode == 0, started.stderr
    platform, width, height, frames = started.stdout.split()
    assert platform == "xcb" and int(frames) == 101
    seen = to_rgb(QImage(str(shot))).astype(int)
    assert seen.shape[:2] == (int(height), int(width))
    middle = seen[int(0.1 * len(seen)) : int(0.5 * len(seen)), int(0.3 * len(seen[0])) : int(0.6 * len(seen[0]))]
    assert middle.std() > 8, "the scene is to be seen"
    colours = {tuple(pixel) for pixel in middle.reshape(-1, 3)[::7].tolist()}
    assert len(colours) > 200, "a body in light and shade has many colours"


def test_without_a_display_the_program_says_so_and_how_to_go_on(tmp_path: Path) -> None:
    if not sys.platform.startswith("linux"):
        pytest.skip("only on Linux can there be no display")
    unset = ("QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "DISPLAY")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {"PYTHONPATH": os.environ["PYTHONPATH"], "MARKERSCOPE_HOME": str(tmp_path / "home")}
    for display, says in (("", "there is no display"), (":9876", "does not answer")):
        words = [sys.executable, "-m", "markerscope.app"]
        run = subprocess.run(
            words, env=environment | {"DISPLAY": display}, cwd=ROOT, capture_output=True, text=True, timeout=60
        )
        assert run.returncode == 2 and run.stderr.count("\n") == 1 and says in run.stderr, run.stderr
        assert "demo --headless" in run.stderr
