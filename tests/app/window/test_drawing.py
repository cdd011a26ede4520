"""What the window draws while things move and when they rest, and what it says of results that it cannot draw."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt

from markerscope.app.window.collecting import Collecting
from markerscope.app.window.main import MainWindow
from markerscope.solver.pipeline.run import keys_of
from markerscope.solver.pipeline.session import Session
from markerscope.widgets.images import to_rgb

Spin = Callable[..., None]


@pytest.fixture
def solved(open_window: Callable[[], MainWindow], spin: Spin, session: Session) -> MainWindow:
    """A window on a solved session."""
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: window.shown.track is not None and window.bench.clock.timing.frames > 0, "the fit")
    return window


def settle(window: MainWindow, spin: Spin) -> None:
    def settled() -> bool:
        if window.scene._rest.isActive():
            window.scene._rest.setInterval(0)
        return window.scene.settled

    spin(settled, "the scene to rest")


def test_the_body_is_coarse_while_the_clock_moves_and_full_when_it_rests(solved: MainWindow, spin: Spin) -> None:
    scene, clock = solved.scene, solved.bench.clock
    solved.raise_dock("stages")
    settle(solved, spin)
    full = to_rgb(scene.grab().toImage()).astype(int)
    scene.patience_ms, start = 0.0, clock.time
    for time in (start + 0.3, start):
        clock.seek(time)
        solved.draw_now()
    assert not scene.fine
    coarse = to_rgb(scene.grab().toImage()).astype(int)
    part = (np.abs(coarse - full).max(axis=2) > 30).mean()
    assert 0.0005 < part < 0.05, f"{part:.2%} of the picture is another: the same body, less finely"
    solved.bench.display.set(colour_by="bone")
    solved.bench.selection.select_markers([1])
    settle(solved, spin)
    assert scene.fine
    solved.bench.selection.select_markers([2])
    solved.draw_now()
    assert scene.fine, "what rests stays as it is while something else changes"
    scene.patience_ms = 1e9
    clock.seek(start + 0.3)
    solved.draw_now()
    scene.grab()
    assert scene.fine, "where it is quick, it is full while it moves too"


def test_a_click_draws_the_scene_once(solved: MainWindow, spin: Spin, monkeypatch: pytest.MonkeyPatch) -> None:
    window, bench = solved, solved.bench
    spin(lambda: window.shown.get("orient") is not None and bench.frames is not None and bench.frames.done, "all")
    settle(window, spin)
    drawn: list[str] = []
    for view, method in ((window.scene, "set_markers"), (window.video, "set_markers"), (window.scene, "set_trails")):
        real, name = getattr(view, method), f"{type(view).__name__}.{method}"
        monkeypatch.setattr(view, method, lambda *a, real=real, name=name: (drawn.append(name), real(*a)))
    marker = int(np.flatnonzero(np.isfinite(window.scene._stage.markers).all(axis=1))[0])
    clicks: dict[str, Callable[[], object]] = {
        "marker": lambda: window.scene.marker_clicked.emit(marker, Qt.KeyboardModifier.NoModifier),
        "candidate": lambda: window.candidates.row_selected.emit(0),
        "hypothesis": lambda: window.hypotheses.hypothesis_selected.emit(1),
        "stage": lambda: bench.selection.select(stage="fit"),
        "neutral stage": lambda: bench.selection.select(stage="neutral"),
        "iteration": lambda: window.convergence.iteration_chosen.emit(0, 1),
        "nothing": lambda: window.scene.background_clicked.emit(Qt.KeyboardModifier.NoModifier),
        "layer": lambda: window.table.trigger("layer.trails"),
        "worst": lambda: window.markers.worst_requested.emit(marker, bench.clock.time + 0.1),
    }
    for what, click in clicks.items():
        drawn.clear()
        click()
        spin()
        counts = {name: drawn.count(name) for name in set(drawn)}
        assert set(counts.values()) == {1} and len(counts) == 3, (what, counts)


def test_the_answers_have_pictures(solved: MainWindow, spin: Spin) -> None:
    binder = next(own for own in solved.binders if type(own).__name__ == "HypothesesBinder")
    solved.raise_dock("hypotheses")
    wanted = {card.candidate for card in binder._picture.cards}
    assert wanted
    before = to_rgb(solved.scene.image())
    spin(lambda: binder._images.keys() == wanted, "the pictures")
    for row, image in binder._images.items():
        drawn = to_rgb(image).astype(int)
        assert drawn.std() > 5 and drawn.shape[0] > 200, f"picture {row} shows nothing"
    assert np.array_equal(to_rgb(solved.scene.image()), before), "the scene is as it was"


def test_a_damaged_result_is_told_of_and_can_be_run_again(
    open_window: Callable[[], MainWindow], spin: Spin, session: Session
) -> None:
    path: Path = session.store.folder("angles", keys_of(session)["angles"]) / "arrays.npz"
    path.write_bytes(bytes(path.stat().st_size))
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: bool(window.messages.messages()), "a message")
    (message,) = window.messages.messages()
    assert (message.level, message.where) == ("error", "Joint angles")
    assert "damaged" in message.what and "run the stage again" in message.remedy
    assert window.bench.board.state("angles") == "not run"
    window.bench.runner.run(["angles"])
    spin(lambda: window.shown.get("angles") is not None, "the angles")


def test_a_view_that_cannot_be_drawn_is_told_of(
    solved: MainWindow, spin: Spin, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*anything: object) -> None:
        raise MemoryError("no memory for the picture")

    with monkeypatch.context() as broken:
        broken.setattr(solved.video, "_paint", fail)
        solved.bench.clock.seek(solved.bench.clock.time + 0.2)
        spin(lambda: bool(solved.messages.messages()), "a message")
    (message,) = solved.messages.messages()
    assert message.what == "The video cannot be drawn: no memory for the picture"


def test_garbage_is_collected_by_the_window_alone(
    open_window: Callable[[], MainWindow], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert gc.isenabled()
    window, other = open_window(), open_window()
    assert not gc.isenabled()
    other.leave()
    assert not gc.isenabled(), "one window is there still"
    asked: list[int] = []
    monkeypatch.setattr(gc, "collect", lambda generation=2: asked.append(generation) or 0)
    monkeypatch.setattr(gc, "get_count", lambda: (9999, 99, 99))
    busy = [True]
    own = Collecting(window, lambda: busy[0])
    for _ in range(6):
        own.collect()
    assert asked == [1] * 6, "nothing takes long while something moves"
    busy[0] = False
    asked.clear()
    for _ in range(5):
        own.collect()
    assert asked[:3] == [1] * 3 and 2 in asked[3:], "the old objects follow after some quiet"
    window.leave()
    assert gc.isenabled()
