"""What goes wrong in the program itself is told in the window, and the window lives on."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest
from PySide6.QtCore import QTimer
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.app.models.workbench import Said
from markerscope.app.window.main import MainWindow
from markerscope.app.window.mistakes import Mistakes
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.session import Session
from markerscope.widgets import guard
from tests.widgets.drawn import pixels


@pytest.fixture
def watched(open_window: Callable[[], MainWindow], monkeypatch: pytest.MonkeyPatch) -> tuple[MainWindow, Mistakes]:
    """A window whose mistakes are watched, until the test ends."""
    monkeypatch.setattr(sys, "excepthook", sys.__excepthook__)
    monkeypatch.setattr("markerscope.app.window.mistakes.guard_paints", lambda tell: None)
    window = open_window()
    mistakes = Mistakes(window.bench)
    mistakes.watch()
    return window, mistakes


def test_a_mistake_in_a_slot_is_told_once(
    watched: tuple[MainWindow, Mistakes], spin: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    window, _ = watched

    def stumble() -> None:
        raise KeyError("no such marker")

    for _ in range(2):
        QTimer.singleShot(0, window, stumble)
        spin()
    (message,) = window.messages.messages()
    assert message.level == "error" and "no such marker" in message.what and message.where == "stumble"
    assert "save the session" in message.remedy
    assert capsys.readouterr().err.count("in stumble") == 1, "all detail is in the terminal"


def test_what_was_expected_is_told_as_it_is(watched: tuple[MainWindow, Mistakes]) -> None:
    window, mistakes = watched
    mistakes.tell(InputError("jumps", "marker 3", "leave it out"))
    (message,) = window.messages.messages()
    assert (message.what, message.where, message.remedy) == ("jumps", "marker 3", "leave it out")


def test_a_widget_that_fails_to_paint_says_so_and_leaves_no_painter(spin: Callable[..., None]) -> None:
    kept: list[QPainter] = []

    class Fails(QWidget):
        def paintEvent(self, event: QPaintEvent) -> None:
            painter = QPainter(self)
            kept.append(painter)
            raise ValueError("nothing to draw")

    heard: list[Exception] = []
    for _ in range(2):  # twice changes nothing
        guard.guard_paints(heard.append, __name__)
    widget = Fails()
    widget.resize(300, 120)
    widget.show()
    drawn = pixels(widget)
    spin()
    assert [str(error) for error in heard][:1] == ["nothing to draw"]
    assert drawn.std() > 3, "the sentence is to be read"
    assert not any(painter.isActive() for painter in kept)
    widget.close()
    widget.deleteLater()


def test_a_message_goes_with_the_session_it_is_about(
    open_window: Callable[[], MainWindow], session: Session, spin: Callable[..., None]
) -> None:
    window = open_window()
    bench = window.bench
    window.open_path(session.folder)
    spin(lambda: bench.clock.timing.frames > 0, "the markers")
    bench.say(Said("error", "the person moves", "the neutral pose", "choose another span"))
    assert [message.what for message in window.messages.messages()] == ["the person moves"]
    bench.close()
    spin()
    assert window.messages.messages() == [], "nothing of it is said over the next session"
    window.open_path(session.folder / "absent.c3d")
    assert [message.level for message in window.messages.messages()] == ["error"], "what fails now is still said"
