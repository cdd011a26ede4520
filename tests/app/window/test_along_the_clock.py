"""Timelines in the real window: the offset dragged, ranges played round, every fit compared, what was cleaned."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolButton

from markerscope.app.models import edits
from markerscope.app.window.main import MainWindow
from markerscope.widgets import palette
from markerscope.widgets.plots.rows import CurveRow, StateRow
from tests.app.window.test_journey import changed, near, picture
from tests.app.window.test_linked import Solved

Spin = Callable[..., None]


@pytest.fixture
def window(solved_window: Solved) -> MainWindow:
    return solved_window()


def place(window: MainWindow, row: str, time: float, part: float = 0.5) -> QPoint:
    rows = window.timelines.rows
    area = rows.area_of(row)
    return QPoint(round(rows.clock_scale().at(time)), round(area.top() + part * area.height()))


def run(window: MainWindow, spin: Spin, action: str = "run.all") -> None:
    assert window.table.trigger(action)
    spin(lambda: not window.bench.runner.running, "the run")
    spin()


def test_the_videos_bar_is_dragged_committed_and_given_back(window: MainWindow, spin: Spin) -> None:
    bench, rows = window.bench, window.timelines.rows
    before = bench.clock.timing.offset
    film, frame = picture(window.video), bench.clock.video_frame
    QTest.mousePress(rows, Qt.MouseButton.LeftButton, pos=place(window, "Sync offset", 2.4))
    QTest.mouseMove(rows, place(window, "Sync offset", 2.5))
    QTest.mouseMove(rows, place(window, "Sync offset", 2.7))
    spin(lambda: changed(film, picture(window.video)) > 0.002, "another frame of the video")
    dragged = bench.clock.timing.offset
    assert dragged == pytest.approx(before + 0.3, abs=0.01)
    assert frame is not None and bench.clock.video_frame == pytest.approx(frame - 0.3 * 30, abs=1)
    assert bench.document.history.undo_sentence is None, "nothing is decided while it is dragged"
    assert f"{dragged:+.3f}" in rows._offset_painter().tip(2.5, 0, rows.area_of("Sync offset"))
    QTest.mouseRelease(rows, Qt.MouseButton.LeftButton, pos=place(window, "Sync offset", 2.7))
    spin()
    assert bench.board.settings["sync"].offset == pytest.approx(dragged)
    assert "Offset of the video" in (bench.document.history.undo_sentence or "")
    assert bench.board.state("sync") == "stale" and bench.clock.timing.offset == pytest.approx(dragged)
    assert window.table.trigger("offset.found")
    assert bench.board.settings["sync"].offset is None
    for _ in range(2):
        assert window.table.trigger("edit.undo")
    spin()
    assert bench.clock.timing.offset == pytest.approx(before)
    assert bench.board.state("sync") == "cached", "what was computed with it is there again"
    QTest.keyClick(window.timelines, Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    assert bench.board.settings["sync"].offset == pytest.approx(before + 0.01)


def test_the_offset_that_was_found_is_a_button_away(window: MainWindow, spin: Spin) -> None:
    """What a second is too short to tell is put into the store as if it had been found."""
    bench, found = window.bench, 0.4
    given = bench.board.current["sync"]
    about = dict(bench.board.results.entry("sync", bench.board.keys["sync"]).about)
    bench.apply(edits.find_offset(bench.document.session))
    made = replace(given, offset=found, method="canonical correlation of velocities")
    bench.board.results.store.put("sync", bench.board.keys["sync"], made, about)
    bench.board.refresh()
    spin(lambda: window.shown.get("sync") is not None and window.shown.get("sync").method != "given", "the offset")
    bench.apply(edits.set_offset(bench.document.session, found + 0.25))
    spin()
    accept = next(b for b in window.timelines.findChildren(QToolButton) if "automatic offset" in b.accessibleName())
    assert accept.isVisible() and f"{found:+.3f} s".replace("-", "−") in accept.text()
    QTest.mouseClick(accept, Qt.MouseButton.LeftButton)
    spin()
    assert bench.clock.timing.offset == pytest.approx(found, abs=1e-6) and not accept.isVisible()
    assert bench.board.settings["sync"].offset is None and bench.board.state("sync") == "cached", "no number is given"
    assert window.table.trigger("edit.undo")
    assert bench.clock.timing.offset == pytest.approx(found + 0.25)


def test_a_range_is_marked_and_played_round(window: MainWindow, spin: Spin) -> None:
    bench, rows = window.bench, window.timelines.rows
    shift = Qt.KeyboardModifier.ShiftModifier
    QTest.mousePress(rows, Qt.MouseButton.LeftButton, shift, place(window, "Markers", 2.3))
    QTest.mouseMove(rows, place(window, "Markers", 2.45))
    QTest.mouseMove(rows, place(window, "Markers", 2.6))
    QTest.mouseRelease(rows, Qt.MouseButton.LeftButton, shift, place(window, "Markers", 2.6))
    spin()
    assert bench.clock.loop == pytest.approx((2.3, 2.6), abs=0.01)
    assert window.transport.loop.isChecked()
    assert near(picture(rows), palette.SELECTED) > 2 * rows.height() * 0.5, "its ends are drawn"
    times: list[float] = []
    bench.clock.moved.connect(times.append)
    window.table.trigger("play.toggle")
    spin(lambda: sum(b < a for a, b in pairwise(times)) >= 2, "two times round")
    window.table.trigger("play.toggle")
    assert bench.clock.loop[0] - 1e-6 <= min(times) and max(times) <= bench.clock.loop[1] + 0.011
    assert window.table.trigger("range.selected")
    assert (bench.board.settings["markers"].start, bench.board.settings["markers"].stop) == pytest.approx(
        bench.clock.loop
    )
    assert window.table.trigger("edit.undo") and window.table.trigger("play.no_range")
    assert bench.clock.loop is None and not window.transport.loop.isChecked()


def residual_of(window: MainWindow) -> CurveRow:
    found = next(row for row in window.timelines.rows.shown_rows() if row.name == "Residual")
    assert isinstance(found, CurveRow)
    return found


def test_every_fit_in_the_store_is_compared_and_can_be_hidden(window: MainWindow, spin: Spin) -> None:
    bench, first = window.bench, window.bench.board.keys["fit"]
    before = residual_of(window).curves[0]
    assert len(residual_of(window).curves) == 1 and residual_of(window).unit == "mm"
    bench.apply(edits.pin_candidate(bench.document.session, 1))
    run(window, spin)
    spin(lambda: len(residual_of(window).curves) == 2 and not window.shown.stale("fit"), "both fits")
    now, other = residual_of(window).curves
    assert now.label == "fit in force" and other.dashed and not np.array_equal(now.colour, other.colour)
    assert np.allclose(other.values, before.values, equal_nan=True, atol=1e-3), "the fit of before is the other one"
    motion = bench.board.current["fit"]
    known = np.isfinite(motion.residual).any(axis=1)
    assert np.allclose(now.values[known], 1000 * np.nanmean(motion.residual[known], axis=1))

    menu = next(own for own in window.binders if hasattr(own, "menu")).menu
    menu.fill()
    titles = [action.text() for action in menu.menu.actions()]
    assert "in force" in titles and "95th percentile" in titles and "Selected markers only" in titles
    hide = next(a for a in menu.menu.actions() if a.isCheckable() and a.text() not in ("in force", *_STATISTICS))
    hide.trigger()
    assert bench.display.hidden_fits == (first,) and len(residual_of(window).curves) == 1
    next(a for a in menu.menu.actions() if a.text() == "Worst").trigger()
    assert np.allclose(residual_of(window).curves[0].values[known], 1000 * np.nanmax(motion.residual[known], axis=1))
    bench.display.set(residual_selected=True)
    bench.selection.select_markers([4])
    only = residual_of(window).curves[0].values
    assert np.allclose(only, 1000 * motion.residual[:, 4], equal_nan=True)
    button = next(b for b in window.timelines.findChildren(QToolButton) if b.text().startswith("Compare"))
    assert button.isVisible() and button.toolTip() and "mm" in button.toolTip()
    window.remember()
    assert bench.document.view["display"]["hidden_fits"] in ((first,), [first])


_STATISTICS = ("Mean", "Median", "95th percentile", "Worst", "Selected markers only")


def test_what_was_cut_and_filled_shows_along_the_clock(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    assert not any(row.name == "Cleaning" for row in window.timelines.rows.shown_rows()), "nothing was cleaned yet"
    bench.apply(edits.set_value(bench.document.session, "clean", "fill", "spline"))
    bench.selection.select(stage="clean")
    run(window, spin, "run.stage")
    spin(lambda: not window.shown.stale("clean"), "the cleaned markers")
    cleaned = bench.board.current["clean"]
    assert cleaned.fills, "the session has gaps to fill"
    card = next(card for card in bench.board.cards if card.name == "clean")
    assert card.fields and "filled" in card.headline and card.headline in window.stages.card("clean")._headline.text()
    row = next(row for row in window.timelines.rows.shown_rows() if row.name == "Cleaning")
    assert isinstance(row, StateRow)
    marker, first = cleaned.fills[0].marker, cleaned.fills[0].first
    assert row.states[first] in (1, 2)
    time = float(cleaned.markers.time[first])
    seen = picture(window.timelines.rows)
    at = place(window, "Cleaning", time)
    assert near(seen[:, at.x() - 1 : at.x() + 2], palette.DOUBTFUL) + near(
        seen[:, at.x() - 1 : at.x() + 2], palette.OUTLIER
    ), "it is to be seen"
    QTest.mouseClick(window.timelines.rows, Qt.MouseButton.LeftButton, pos=at)
    assert marker in bench.selection.markers
    presence = next(row for row in window.timelines.rows.shown_rows() if row.name == "Markers")
    assert presence.filled is not None and presence.filled.any()
    assert window.table.trigger("edit.undo")
