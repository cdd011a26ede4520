"""The real window, drawn into memory, with somebody who answers its questions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from markerscope.app.models.demo import DEMO_VIDEO
from markerscope.app.models.home import Home
from markerscope.app.models.imports import new_session
from markerscope.app.models.workbench import Said, Workbench
from markerscope.app.window.main import MainWindow
from markerscope.app.window.showing import Showing
from markerscope.solver.pipeline.session import Session

SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "landmarks": {"rate": 10.0},
    "localize": {"few": 6, "many": 10, "keep": 8},
    "orient": {"refine": 4},
}
"""Those of the other tests of the window: enough for an answer, and quick."""
EDITS = {"markers": {"start": 2.0, "stop": 4.0}, "sync": {"offset": 0.37}}


class Answers:
    """Answers the questions of the window as a test says."""

    def __init__(self, window: MainWindow, folder: Path) -> None:
        self.folder = folder
        self.asked: list[str] = []
        self.save: bool | None = False
        self.stop = True
        self.showing = Showing(window)
        self._window = window

    def file_to_open(self, what: str) -> Path | None:
        self.asked.append(what)
        return None

    def folder_to_save(self, name: str) -> Path | None:
        self.asked.append("folder")
        return self.folder / f"{name}.markerscope"

    def file_to_save(self, name: str) -> Path | None:
        return self.folder / name

    def how_to_import(self, path: Path) -> Mapping[str, Any] | None:
        made = new_session(path, video=DEMO_VIDEO)
        return {**made, "settings": {**made["settings"], **SETTINGS}, "edits": EDITS}

    def what_to_export(self) -> tuple[Path, Sequence[str]] | None:
        return self.folder / "export", ["angles", "report"]

    def save_first(self) -> bool | None:
        self.asked.append("save")
        return self.save

    def stop_running(self) -> bool:
        self.asked.append("stop")
        return self.stop

    def number(self, question: str, value: float, unit: str) -> float | None:
        return None

    def choice(self, question: str, options: Sequence[str]) -> int | None:
        self.asked.append(question)
        return 0

    def pictures(self) -> Sequence[Any]:
        from markerscope.app.window.exporting import report_pictures

        return report_pictures(self._window)

    def show(self, what: str) -> None:
        self.showing.show(what)

    def quit(self) -> None:
        self._window.leave()


@pytest.fixture
def spin(qapp: QApplication) -> Callable[..., None]:
    """``spin(until)`` lets the window live until something is so; ``spin()`` until what is pending has been done."""

    def wait(until: Callable[[], bool] | None = None, what: str = "it", seconds: float = 120) -> None:
        end = time.monotonic() + seconds
        for _ in range(5):
            qapp.processEvents()
        while until is not None and not until():
            assert time.monotonic() < end, f"waited for {what} for {seconds} s"
            qapp.processEvents()
            time.sleep(0.003)
        qapp.processEvents()

    return wait


@pytest.fixture
def answer(qapp: QApplication) -> Iterator[Callable[[Callable[[Any], None]], None]]:
    """``answer(act)``: act on the next dialog that asks, in turn; each has to have been asked in the end."""
    waiting: list[Callable[[Any], None]] = []
    failed: list[BaseException] = []
    timer = QTimer(interval=20)

    patience = [250]

    def look() -> None:
        dialog = QApplication.activeModalWidget()
        if dialog is None or not dialog.isVisible():
            patience[0] = 500
        elif waiting:
            act = waiting.pop(0)
            QTimer.singleShot(0, dialog, lambda: take(act, dialog))  # not here: the next dialog needs this timer
        else:
            patience[0] -= 1
            if patience[0] <= 0:
                patience[0] = 500
                failed.append(AssertionError(f"nobody answers {dialog.windowTitle()!r}"))
                dialog.close()

    def take(act: Callable[[Any], None], dialog: Any) -> None:
        try:
            act(dialog)
        except BaseException as error:
            failed.append(error)
            dialog.close()

    timer.timeout.connect(look)
    timer.start()
    yield waiting.append
    timer.stop()
    if failed:
        raise failed[0]
    assert not waiting, f"{len(waiting)} dialogs did not ask"


@pytest.fixture
def open_window(qapp: QApplication, tmp_path: Path) -> Iterator[Callable[..., MainWindow]]:
    """Opens a window of the same user, which asks by its own dialogs if it is ``real``; all are closed in the end."""
    windows: list[MainWindow] = []

    def make(real: bool = False) -> MainWindow:
        home = Home(tmp_path / "home" / "config", tmp_path / "home" / "data")
        window = MainWindow(Workbench(home), None if real else lambda own: Answers(own, tmp_path))
        window.said: list[Said] = []  # type: ignore[attr-defined,misc]
        window.bench.said.connect(window.said.append)  # type: ignore[attr-defined]
        window.show()
        qapp.processEvents()
        windows.append(window)
        return window

    yield make
    for window in windows:
        window.leave()
        window.deleteLater()
    qapp.processEvents()


@pytest.fixture
def solved_window(
    open_window: Callable[[], MainWindow], spin: Callable[..., None], session: Session
) -> Callable[..., MainWindow]:
    """Opens the window on a second of the embedded session, with every result in force."""

    def make(folder: Path | None = None) -> MainWindow:
        window = open_window()
        window.resize(1280, 800)
        window.open_path(folder or session.folder)
        shown, bench = window.shown, window.bench
        spin(lambda: shown.track is not None and shown.get("angles") is not None, "the results")
        spin(lambda: shown.get("orient") is not None and shown.clusters is not None, "the results")
        spin(lambda: bench.frames is not None and bench.frames.done, "the video")
        bench.clock.seek(2.5)
        spin()
        return window

    return make
