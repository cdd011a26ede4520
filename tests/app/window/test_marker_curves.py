"""Marker curves in the real window: gaps walked through, previewed, filled; trajectories edited, proposals decided."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from markerscope.app.actions.track_actions import WAY_TITLES
from markerscope.app.models.working import Working
from markerscope.app.window.main import MainWindow
from markerscope.solver.cleaning.swaps import Proposal
from tests.app.window.test_linked import Solved

Spin = Callable[..., None]


@pytest.fixture
def window(solved_window: Solved, spin: Spin) -> MainWindow:
    made = solved_window()
    made.raise_dock("curves")
    spin()
    return made


def work(window: MainWindow) -> Working:
    found = window.bench.working.now()
    assert found is not None
    return found


def to_a_gap(window: MainWindow, spin: Spin) -> int:
    """Go to the longest gap of the session that is not at its ends, and return its marker."""
    gaps = [g for g in work(window).gaps if g.first > 5 and g.last < 95]
    gap = max(gaps, key=lambda g: g.length)
    window.bench.selection.select_markers([gap.marker])
    window.bench.clock.seek_marker_frame(gap.first)
    spin(lambda: window.bench.previews.gap == gap and not window.bench.previews.busy, "the previews")
    spin()
    return gap.marker


def clean(window: MainWindow, spin: Spin) -> None:
    assert window.table.trigger("clean.run")
    spin(lambda: not window.bench.runner.running, "the cleaning")
    spin(lambda: work(window).in_force, "its result")
    spin()


def place(window: MainWindow, time: float, plot: int = 0) -> QPoint:
    plots = window.curves.plots
    return QPoint(round(plots.scale().at(time)), round(plots.areas()[plot].center().y()))


def test_an_empty_panel_says_what_fills_it_and_a_selection_does(window: MainWindow, spin: Spin) -> None:
    window.bench.selection.clear()
    spin()
    assert "Select a marker" in window.curves.plots.shown().note
    window.bench.selection.select_markers([3, 4])
    spin()
    shown = window.curves.plots.shown()
    assert [plot.title for plot in shown.plots] == ["x", "y", "z"]
    assert {"measured", "body"} <= shown.kinds
    window.curves.options["acceleration"].click()
    window.curves.options["x"].click()
    window.curves.options["body"].click()
    spin()
    shown = window.curves.plots.shown()
    assert [plot.title for plot in shown.plots] == ["y", "z", "y, acceleration", "z, acceleration"]
    assert "body" not in shown.kinds


def test_n_goes_on_and_shift_n_back_and_selects_what_is_lost(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    bench.selection.clear()
    bench.clock.seek_marker_frame(0)
    window.scene.setFocus()
    seen = []
    for _ in range(3):
        QTest.keyClick(window, Qt.Key.Key_N)
        spin()
        seen.append((bench.clock.marker_frame, bench.selection.markers))
    for frame, markers in seen:
        assert markers and all(not work(window).measured.present[frame, m] for m in markers)
    assert len({frame for frame, _ in seen}) == 3, "a marker that was reached does not keep the walk to itself"
    QTest.keyClick(window, Qt.Key.Key_N, Qt.KeyboardModifier.ShiftModifier)
    assert (bench.clock.marker_frame, bench.selection.markers) == seen[1]
    marker = min(seen[0][1])
    bench.selection.select_markers([marker])
    own = {gap.first for gap in work(window).of_marker[marker]}
    for _ in range(3):
        QTest.keyClick(window, Qt.Key.Key_N)
        assert bench.clock.marker_frame in own and bench.selection.markers == {marker}


def test_a_gap_is_previewed_filled_cleaned_and_put_back(window: MainWindow, spin: Spin) -> None:
    bench, editor = window.bench, window.track_editor
    marker = to_a_gap(window, spin)
    gap = bench.previews.gap
    assert gap is not None
    assert {p.way for p in bench.previews.found} == set(WAY_TITLES)
    assert all(p.values is not None for p in bench.previews.found if p.way in ("body", "rigid", "spline"))
    shown = [editor.ways.topLevelItem(k).text(1) for k in range(editor.ways.topLevelItemCount())]
    errors = [float(text.removesuffix(" mm")) for text in shown if text.endswith(" mm")]
    assert len(errors) > 2 and errors == sorted(errors)
    assert editor.way() == min(bench.previews.found, key=lambda p: p.error).way, "the least error is chosen"
    QTest.mouseClick(editor.fill, Qt.MouseButton.LeftButton)
    spin()
    settings = bench.board.settings["clean"]
    assert len(settings.fills) + len(settings.placed) == 1
    assert bench.board.state("clean") == "stale" and "filled by" in (bench.document.history.undo_sentence or "")
    spin(lambda: "filled" in window.curves.plots.shown().kinds, "the fill, before it is run")
    assert "to be filled" in editor.heading.text()
    clean(window, spin)
    made = work(window)
    assert made.cleaned is not None and made.cleaned.filled[gap.first : gap.last + 1, marker].all()
    assert not made.measured.present[gap.first, marker], "what is filled counts as measured nowhere"
    assert "filled by" in editor.heading.text() and "to be" not in editor.heading.text()
    assert window.table.trigger("tracks.put_back")
    assert not bench.board.settings["clean"].fills and not bench.board.settings["clean"].placed
    for _ in range(2):
        assert window.table.trigger("edit.undo")
    spin()
    assert bench.board.state("clean") == "cached" == bench.board.state("fit"), "all is as it was"


def test_a_gap_is_filled_by_the_body_and_the_places_stay(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    marker = to_a_gap(window, spin)
    gap = bench.previews.gap
    assert gap is not None and window.table.trigger("fill.body")
    (given,) = bench.board.settings["clean"].placed
    assert (given.marker, given.first, given.last) == (marker, gap.first, gap.last)
    clean(window, spin)
    cleaned = work(window).cleaned
    assert cleaned is not None
    assert np.allclose(cleaned.markers.positions[gap.first : gap.last + 1, marker], given.places, atol=1e-6)
    assert [f.method for f in cleaned.fills] == ["body"]


def test_a_range_is_dragged_and_deleted_and_put_back(window: MainWindow, spin: Spin) -> None:
    bench, plots = window.bench, window.curves.plots
    bench.selection.select_markers([6])
    spin()
    assert "no range" in window.table.table["tracks.delete"].why_not(bench)
    QTest.mousePress(plots, Qt.MouseButton.LeftButton, pos=place(window, 2.3))
    QTest.mouseMove(plots, place(window, 2.4))
    QTest.mouseMove(plots, place(window, 2.5))
    QTest.mouseRelease(plots, Qt.MouseButton.LeftButton, pos=place(window, 2.5))
    spin()
    assert bench.clock.loop == pytest.approx((2.3, 2.5), abs=0.02)
    assert window.timelines.window_of_time.range == pytest.approx(bench.clock.loop)
    before = work(window).measured.present[:, 6].sum()
    QTest.mouseClick(window.track_editor.buttons["tracks.delete"], Qt.MouseButton.LeftButton)
    spin()
    lost = before - work(window).measured.present[:, 6].sum()
    assert lost == pytest.approx(21, abs=3) and bench.board.settings["clean"].deletes
    shown = window.curves.plots.shown()
    assert any(s.kind == "gap" and s.last - s.first > 15 for s in shown.shades), "before it is run"
    bench.clock.set_loop((2.35, 2.4))
    assert window.table.trigger("tracks.put_back")
    assert len(bench.board.settings["clean"].deletes) == 2, "what is outside of the range stays deleted"
    bench.clock.set_loop((2.0, 3.0))
    assert window.table.trigger("tracks.put_back")
    assert work(window).measured.present[:, 6].sum() == before


def test_a_trajectory_is_cut_in_two_solved_so_joined_again_and_undone(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    count = len(work(window).raw.labels)
    bench.selection.select_markers([2])
    bench.clock.seek_marker_frame(50)
    assert window.table.trigger("tracks.cut")
    clean(window, spin)
    markers = window.shown.markers
    assert markers is not None and len(markers.labels) == count + 1
    assert markers.labels[count] == f"{markers.labels[2]}_2"
    assert not markers.present[50:, 2].any() and not markers.present[:50, count].any()
    assert window.table.trigger("select.all") and len(bench.selection.markers) == count + 1
    assert window.table.trigger("layer.labels")
    for name in ("markers", "affinity", "timelines", "curves"):
        window.raise_dock(name)
        spin()
    bench.selection.select_markers([2, count])
    assert window.table.trigger("tracks.join")
    joined = work(window).edited
    assert np.array_equal(joined.positions[:, 2], work(window).raw.positions[:, 2], equal_nan=True)
    for _ in range(2):
        assert window.table.trigger("edit.undo")
    spin()
    assert window.shown.markers is not None and len(window.shown.markers.labels) == count
    assert bench.selection.markers == {2}, "what is no more is not selected any more"


def test_two_trajectories_seen_together_are_not_joined_but_exchanged(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    bench.selection.select_markers([2, 3])
    assert "both are seen in" in window.table.why_not("tracks.join")
    bench.clock.seek_marker_frame(40)
    assert window.table.trigger("tracks.exchange")
    raw, now = work(window).raw.positions, work(window).edited.positions
    assert np.array_equal(now[40:, 2], raw[40:, 3], equal_nan=True)
    assert np.array_equal(now[:40, 2], raw[:40, 2], equal_nan=True)
    assert window.table.trigger("tracks.exchange"), "twice is not at all"
    assert bench.board.settings["clean"].swaps == ()


def test_proposals_are_accepted_and_rejected_in_the_list_and_applied_in_one_run(window: MainWindow, spin: Spin) -> None:
    bench, editor = window.bench, window.track_editor
    key, value = bench.board.keys["clean"], bench.board.current["clean"]
    about = dict(bench.board.results.entry("clean", key).about)
    proposals = tuple(
        Proposal("swap", frame, 100, pair, 0.02, f"{pair} look exchanged from frame {frame} on.")
        for frame, pair in ((20, (1, 2)), (40, (3, 7)), (60, (5, 9)))
    )
    bench.board.results.store.discard("clean", key)
    bench.board.results.store.put("clean", key, replace(value, proposals=proposals), about)
    bench.board.results.forget("clean", key)
    bench.board.refresh()
    spin(lambda: editor.proposals.topLevelItemCount() == 3, "the proposals")
    editor.setCurrentIndex(1)
    assert editor.tabText(1) == "Proposals (3)"
    item = editor.proposals.topLevelItem(1)
    editor.proposals.itemActivated.emit(item, 0)
    assert (bench.clock.marker_frame, bench.selection.markers) == (40, {3, 7})
    editor.proposals.clearSelection()
    item.setSelected(True)
    QTest.mouseClick(editor.reject, Qt.MouseButton.LeftButton)
    spin()
    assert bench.board.settings["clean"].rejected == (("swap", 3, 7, 40),)
    assert bench.board.state("fit") == "cached", "what was rejected changes no result"
    for row in (0, 1):
        editor.proposals.topLevelItem(row).setSelected(True)
    QTest.mouseClick(editor.accept, Qt.MouseButton.LeftButton)
    spin()
    assert bench.board.settings["clean"].swaps == ((1, 2, 20), (5, 9, 60))
    states = [editor.proposals.topLevelItem(k).text(2) for k in range(3)]
    assert states == ["accepted", "accepted", "rejected"] and "next cleaning" in editor.none.text()
    clean(window, spin)
    raw, now = work(window).raw.positions, work(window).measured.positions
    assert np.array_equal(now[70, 1], raw[70, 2], equal_nan=True)
    assert np.array_equal(now[70, 5], raw[70, 9], equal_nan=True)
    assert np.array_equal(now[70, 3], raw[70, 3], equal_nan=True)


def wheel(widget: QWidget, at: QPoint, keys: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
    turned = QWheelEvent(
        QPointF(at), widget.mapToGlobal(QPointF(at)), QPoint(), QPoint(0, 240), Qt.MouseButton.NoButton, keys,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(widget, turned)


def test_time_is_zoomed_with_the_timelines_and_values_alone(window: MainWindow, spin: Spin) -> None:
    plots, timelines = window.curves.plots, window.timelines
    window.bench.selection.select_markers([4])
    spin()
    whole = window.curves.window_of_time.view
    wheel(plots, place(window, 2.5))
    spin()
    view = window.curves.window_of_time.view
    assert view[1] - view[0] == pytest.approx((whole[1] - whole[0]) / 1.44, rel=1e-3)
    assert timelines.view() == pytest.approx(view), "the timelines show the same"
    timelines.set_view(2.2, 2.6)
    assert window.curves.window_of_time.view == pytest.approx((2.2, 2.6))
    plots.grab()
    before = dict(plots._drawn)
    wheel(plots, place(window, 2.4), Qt.KeyboardModifier.ControlModifier)
    plots.grab()
    low, high = plots._drawn["x"]
    assert high - low == pytest.approx((before["x"][1] - before["x"][0]) / 1.44, rel=1e-3)
    assert plots._drawn["y"] == before["y"]
    QTest.keyClick(plots, Qt.Key.Key_0)
    assert window.curves.window_of_time.view == pytest.approx(whole)
    QTest.mouseClick(plots, Qt.MouseButton.LeftButton, pos=place(window, 2.6))
    assert window.bench.clock.time == pytest.approx(2.6, abs=0.02)


def test_what_is_shown_and_what_was_decided_comes_back_with_the_session(
    window: MainWindow, spin: Spin, open_window: Callable[[], MainWindow]
) -> None:
    marker = to_a_gap(window, spin)
    assert window.table.trigger("fill.rigid")
    window.curves.options["velocity"].click()
    folder, decided = window.bench.document.folder, window.bench.board.settings["clean"]
    window.remember()
    assert window.table.trigger("session.save")
    window.bench.close()
    again = open_window()
    again.open_path(folder)
    spin(lambda: again.bench.working.now() is not None, "the markers")
    assert again.bench.board.settings["clean"] == decided and decided.fills[0][0] == marker
    again.raise_dock("curves")
    spin()
    assert again.curves.on("velocity")


def test_the_menu_offers_what_can_be_done_and_says_why_not(window: MainWindow, spin: Spin) -> None:
    to_a_gap(window, spin)
    menu = window.curves_binder.menu()
    texts = {a.text().split("\t")[0]: a for a in menu.actions() if a.text()}
    assert texts["Cut the trajectory in two here"].isEnabled()
    assert not texts["Join the two trajectories"].isEnabled()
    assert "two markers have to be selected" in texts["Join the two trajectories"].toolTip()
    fills = list(texts["Fill the gap"].menu().actions())
    assert len(fills) == len(WAY_TITLES) + 1 and all(a.isEnabled() for a in fills)
