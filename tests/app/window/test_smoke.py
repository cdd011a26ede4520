"""The program as a user starts it, on a display of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.window.start import display_problem
from solver.pipeline.session import Session

ROOT = Path(__file__).parents[3]
SCRIPT = """
import os, sys
from pathlib import Path
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
import app.window.main as main
from app.cli import main as command

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


@pytest.fixture
def display() -> Iterator[str]:
    """The number of a display that was started for this test."""
    if shutil.which("Xvfb") is None:
        pytest.skip("Xvfb is not installed")
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", "1600x1000x24", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    number = os.read(read, 20).decode().strip()
    os.close(read)
    if not number:
        server.wait(10)
        pytest.skip("Xvfb does not start here")
    yield f":{number}"
    server.terminate()
    server.wait(20)


def test_the_program_opens_its_window_and_shows_a_session(display: str, session: Session, tmp_path: Path) -> None:
    from PySide6.QtGui import QImage

    from widgets.images import to_rgb

    unset = ("QT_QPA_PLATFORM", "WAYLAND_DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW")
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {"DISPLAY": display, "MARKERSCOPE_HOME": str(tmp_path / "home"), "PYTHONPATH": str(ROOT)}
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
    environment |= {"PYTHONPATH": str(ROOT), "MARKERSCOPE_HOME": str(tmp_path / "home")}
    for display, says in (("", "there is no display"), (":9876", "does not answer")):
        words = [sys.executable, "-m", "app"]
        run = subprocess.run(
            words, env=environment | {"DISPLAY": display}, cwd=ROOT, capture_output=True, text=True, timeout=60
        )
        assert run.returncode == 2 and run.stderr.count("\n") == 1 and says in run.stderr, run.stderr
        assert "demo --headless" in run.stderr
