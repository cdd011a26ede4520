"""The whole way through the real window on two seconds of the embedded session, with a look at what is drawn."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication, QWidget

from markerscope.app.models.demo import DEMO_MARKERS
from markerscope.app.window.main import MainWindow
from markerscope.widgets import theme
from markerscope.widgets.images import to_rgb

Spin = Callable[..., None]


def mouse(widget: QWidget, kind: QEvent.Type, x: float, y: float, held: Qt.KeyboardModifier | None = None) -> None:
    at = QPointF(x, y)
    none, left = Qt.MouseButton.NoButton, Qt.MouseButton.LeftButton
    down = none if kind == QEvent.Type.MouseButtonRelease else left
    held = Qt.KeyboardModifier.NoModifier if held is None else held
    event = QMouseEvent(kind, at, widget.mapToGlobal(at), none if kind == QEvent.Type.MouseMove else left, down, held)
    QApplication.sendEvent(widget, event)


def drag(widget: QWidget, *points: tuple[float, float]) -> None:
    mouse(widget, QEvent.Type.MouseButtonPress, *points[0])
    for point in points[1:]:
        mouse(widget, QEvent.Type.MouseMove, *point)


def picture(widget: QWidget) -> np.ndarray:
    return to_rgb(widget.grab().toImage()).astype(int)


def near(seen: np.ndarray, colour: tuple[int, ...] | np.ndarray, within: int = 30) -> int:
    """How many pixels have nearly a colour."""
    return int((np.abs(seen - np.asarray(colour)).max(axis=-1) <= within).sum())


def changed(before: np.ndarray, after: np.ndarray) -> float:
    """Share of the pixels that are others."""
    return float((np.abs(before - after).max(axis=-1) > 12).mean())


def states(window: MainWindow) -> dict[str, str]:
    return {name: window.bench.board.state(name) for name in window.bench.board.names}


def run(window: MainWindow, spin: Spin) -> None:
    assert window.table.trigger("run.all"), window.said
    spin(lambda: not window.bench.runner.running, "the run", 600)
    assert set(states(window).values()) == {"cached"}, [said.sentence for said in window.said]
    spin(lambda: not window.shown.stale("fit") and not window.shown.stale("angles"), "what is shown of the run")


def in_front(window: MainWindow) -> dict[str, tuple[int, ...]]:
    """Where the panels are that can be seen."""
    return {
        name: dock.geometry().getRect()  # type: ignore[misc]
        for name, dock in window.docks.docks.items()
        if not dock.visibleRegion().isEmpty()
    }


def test_the_whole_journey(open_window: Callable[[], MainWindow], spin: Spin, tmp_path: Path) -> None:
    window = open_window()
    bench = window.bench
    assert window.pages.currentWidget() is window.welcome

    window.open_path(DEMO_MARKERS)
    spin(lambda: bench.clock.timing.frames == 201, "the markers")
    spin(lambda: bench.frames is not None and bench.frames.done, "the video")
    assert near(picture(window.scene), (0, 158, 115), 40) > 50, "measured markers are to be seen before anything is run"
    bare = picture(window.scene)

    run(window, spin)
    bench.clock.seek(3.0)
    spin()
    solved = picture(window.scene)
    assert changed(bare, solved) > 0.02, "the body is to be seen"
    film = picture(window.video)
    assert film.std() > 25, "the video is to be seen"
    bench.display.show("projected", False)
    spin()
    assert changed(film, picture(window.video)) > 0.005, "markers and body are to be seen over the video"
    bench.display.show("projected", True)
    fits = {entry.key for entry in bench.board.results.entries("fit")}
    assert len(fits) == 1

    # The cut: groups and colours follow while it is dragged, the stages that stand on it are stale when it is let go.
    before, groups = window.affinity.cut(), window.affinity.groups()
    scale, places = window.affinity.height_scale(), window.affinity.places()
    x, y = float(places.tree.center().x()), float(scale.pixel(before * 1000))
    lower = float(scale.pixel(2.5))
    drag(window.affinity, (x, y), (x, (y + lower) / 2), (x, lower))
    spin()
    assert window.affinity.groups() > groups, "a lower cut makes more groups"
    assert bench.document.history.undo_sentence is None, "nothing is decided before the mouse is let go"
    assert changed(solved, picture(window.scene)) > 0.0005, "the colours in the scene follow"
    mouse(window.affinity, QEvent.Type.MouseButtonRelease, x, lower)
    spin()
    assert states(window)["segment"] == "cached" and states(window)["fit"] == "stale"
    many = bench.board.current["segment"].count
    assert many == window.affinity.groups()

    found = bench.board.current["segment"].clusters
    pair = [int(np.flatnonzero(found == group)[0]) for group in (0, 1)]
    bench.selection.select_markers(pair)
    assert window.table.trigger("groups.merge")
    assert bench.board.current["segment"].count == many - 1
    assert window.table.trigger("edit.undo")
    assert bench.board.current["segment"].count == many
    assert window.table.trigger("edit.undo")
    assert states(window)["fit"] == "cached", "what was computed for the first cut is there again"
    assert window.history.count() == 3

    # The second candidate: its ghost, then the fit that goes on from it, beside the first.
    window.raise_dock("candidates")
    spin()
    ranked = bench.board.current["orient"].candidates
    assert len(ranked) >= 2, [(own.refined, own.energy) for own in ranked]
    plain = picture(window.scene)
    bench.selection.select(candidate=1)
    spin()
    assert changed(plain, picture(window.scene)) > 0.002, "the candidate's ghost is to be seen"
    assert window.table.trigger("candidate.pin")
    assert bench.board.settings["fit"].candidate == 1 and states(window)["fit"] == "stale"
    run(window, spin)
    entries = bench.board.results.entries("fit")
    assert len(entries) == 2
    window.stages.compare_toggled.emit("fit", next(iter(fits)), True)
    spin(lambda: len(window.shown.compared("fit")) == 1, "the first fit")
    spin()
    residual = next(row for row in window.timelines.rows.shown_rows() if row.name.startswith("Residual"))
    fitted = [curve for curve in residual.curves if curve.framed]
    assert len(fitted) == 2, "both fits are compared along the session"
    assert len(residual.curves) == 3, "the candidate that is selected has its own, at its keyframes"

    # Scrubbing: everything follows the one clock.
    first, film = picture(window.scene), picture(window.video)
    area = window.timelines.rows.area_of(residual.name)
    drag(window.timelines.rows, (area.left() + 0.2 * area.width(), area.center().y()))
    drag(window.timelines.rows, (area.left() + 0.75 * area.width(), area.center().y()))
    mouse(window.timelines.rows, QEvent.Type.MouseButtonRelease, area.left() + 0.75 * area.width(), area.center().y())
    spin()
    assert abs(bench.clock.time - 3.5) < 0.06
    spin(lambda: changed(film, picture(window.video)) > 0.005, "the video's frame")
    assert changed(first, picture(window.scene)) > 0.005
    assert window.table.trigger("play.toggle") and bench.clock.playing
    at = bench.clock.time
    spin(lambda: bench.clock.time > at + 0.1, "the clock")
    window.table.trigger("play.toggle")

    assert window.table.trigger("export.angles"), window.said
    with (tmp_path / "angles.csv").open(newline="") as file:
        table = list(csv.reader(line for line in file if not line.startswith("#")))
    assert len(table) == 202 and "knee_angle_l" in table[0]
    assert window.table.trigger("export.files")
    report = (tmp_path / "export" / "report.html").read_text()
    assert report.count("data:image/png;base64") >= 2

    # Left, and reopened as it was.
    bench.selection.select_markers([4, 7])
    bench.clock.seek(2.5)
    window.scene.orbit(0.4, 0.1)
    window.raise_dock("markers")
    assert window.table.trigger("session.save")
    spin()
    camera, layout = window.scene.camera_state(), in_front(window)
    saved = bench.document.folder
    window.close()
    assert not bench.document.is_open

    again = open_window()
    again.open_path(saved)
    spin(lambda: again.shown.track is not None and again.bench.clock.timing.frames == 201, "the session")
    spin()
    assert again.bench.clock.time == 2.5
    assert again.bench.selection.markers == {4, 7}
    assert {k: v for k, v in again.scene.camera_state().items() if k != "facing"} == {
        k: v for k, v in camera.items() if k != "facing"
    }
    assert in_front(again) == layout and {"video", "timelines"} <= layout.keys()
    assert set(states(again).values()) == {"cached"}
    assert len(again.shown.compared("fit")) == 1
    assert changed(picture(again.scene), np.full_like(picture(again.scene), theme.colours().window)) > 0.1


def test_closing_while_stages_run_asks(open_window: Callable[[], MainWindow], spin: Spin) -> None:
    window = open_window()
    window.open_path(DEMO_MARKERS)
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    window.table.trigger("run.all")
    window.asks.stop = False  # type: ignore[attr-defined]
    window.close()
    assert window.bench.runner.running and window.isVisible()
    window.asks.stop, window.asks.save = True, None  # type: ignore[attr-defined]
    window.close()
    assert window.isVisible() and not window.bench.runner.running, "the question about saving can still be refused"
    window.asks.save = False  # type: ignore[attr-defined]
    window.close()
    assert not window.isVisible()
    assert window.asks.asked == ["stop", "stop", "save", "save"]  # type: ignore[attr-defined]


def test_a_file_that_cannot_be_read_is_said_in_the_window(
    open_window: Callable[[], MainWindow], spin: Spin, tmp_path: Path
) -> None:
    window = open_window()
    window.open_path(tmp_path / "absent.trc")
    assert [said.level for said in window.said] == ["error"]  # type: ignore[attr-defined]
    shown = window.messages.messages()
    assert len(shown) == 1 and "absent.trc" in shown[0].where and shown[0].remedy


def test_what_a_crash_left_is_offered(open_window: Callable[[], MainWindow], spin: Spin) -> None:
    window = open_window()
    window.open_path(DEMO_MARKERS)
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    window.bench.document.close(keep_untitled=True)
    journal = next(iter(window.bench.document.home.unsaved.glob("*.markerscope")))
    text = (journal / "journal.json").read_text()
    (journal / "journal.json").write_text(text.replace('"process": ', '"process": 99999'))
    other = open_window()
    assert [button for button in other.welcome.recent_buttons() if "crash" in button.text()]
    other.welcome.recent_chosen.emit(str(journal))
    spin(lambda: other.bench.clock.timing.frames == 201, "the session that was left")
    assert any("is back" in said.what for said in other.said)  # type: ignore[attr-defined]


def test_a_marker_file_and_its_video_can_be_dropped_together(
    open_window: Callable[[], MainWindow], spin: Spin, tmp_path: Path
) -> None:
    window = open_window()
    window.drop([tmp_path / "alone.mp4"])
    assert window.said[-1].level == "note" and not window.bench.document.is_open  # type: ignore[attr-defined]
    proposed: list[Path | None] = []
    answer = window.asks.how_to_import

    def watched(path: Path) -> object:
        proposed.append(window.dropped_video)
        return answer(path)

    window.asks.how_to_import = watched  # type: ignore[method-assign,assignment]
    window.drop([tmp_path / "squat.mp4", DEMO_MARKERS])
    assert window.bench.document.is_open and proposed == [tmp_path / "squat.mp4"] and window.dropped_video is None
