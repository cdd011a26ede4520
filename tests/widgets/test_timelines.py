"""The timelines: what is drawn is what the rows say, and what the user does is told in seconds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QToolButton, QWidget

from markerscope.widgets import palette, theme
from markerscope.widgets.plots.curve_paint import shortened
from markerscope.widgets.plots.decimate import Counts, envelope, shown_frames
from markerscope.widgets.plots.ink import legible
from markerscope.widgets.plots.rows import Curve, CurveRow, OffsetRow, PresenceRow, StateRow
from markerscope.widgets.plots.scales import Scale, clock, log_ticks, number, ticks, time_ticks
from markerscope.widgets.plots.timelines import Timelines
from tests.widgets.drawn import pixels

TIME = np.arange(1000) / 100.0
BLUE, ORANGE = np.array([0, 114, 178], np.uint8), np.array([230, 159, 0], np.uint8)


def rows() -> list:
    present = np.ones((1000, 4), bool)
    present[300:500, 1] = False
    present[700, 2] = False
    curve = Curve("fit", 5 + np.sin(TIME), BLUE)
    states = (TIME >= 5).astype(np.uint8)
    return [
        PresenceRow("Markers", TIME, present, colours=np.array([BLUE] * 4), labels=("a", "b", "c", "d")),
        StateRow("Video", TIME, states, np.array([palette.GOOD, palette.GAP]), ("tracked", "lost")),
        CurveRow("Residual", TIME, (curve,), "mm"),
        OffsetRow("Offset", 0.0, 4.0, 2.0, 2.5),
    ]


@pytest.fixture
def shown(qapp: QApplication) -> Iterator[Timelines]:
    theme.apply(qapp, "light")
    made = Timelines()
    made.resize(900, 420)
    made.set_span(0, 10)
    made.set_rows(rows())
    made.show()
    qapp.processEvents()
    yield made
    made.close()


def near(picture: np.ndarray, at: tuple[float, float], rgb: object) -> bool:
    return bool(np.abs(picture[round(at[1]), round(at[0])].astype(int) - np.asarray(rgb, int)).max() <= 4)


def place(shown: Timelines, row: str, time: float, down: float = 0.5) -> tuple[float, float]:
    area = shown.rows.area_of(row)
    return shown.rows.clock_scale().at(time), area.top() + down * area.height()


def point(shown: Timelines, row: str, time: float, down: float = 0.5) -> QPoint:
    return QPointF(*place(shown, row, time, down)).toPoint()


def test_gaps_are_where_the_marker_was_lost(shown: Timelines) -> None:
    picture, base = pixels(shown.rows), theme.colours().base
    assert near(picture, place(shown, "Markers", 4.0, 0.125), BLUE)
    assert near(picture, place(shown, "Markers", 4.0, 0.375), base)
    for time, ink in ((2.95, BLUE), (3.05, base), (4.95, base), (5.05, BLUE)):
        assert near(picture, place(shown, "Markers", time, 0.375), ink), time


def test_a_gap_of_one_frame_is_seen_where_a_pixel_holds_several(shown: Timelines) -> None:
    shown.set_span(0, 100)  # a pixel is 12 frames and more
    x, y = place(shown, "Markers", 7.0, 0.625)
    strip = pixels(shown.rows)[round(y), round(x) - 2 : round(x) + 3].astype(int)
    assert np.abs(strip - BLUE.astype(int)).max() > 40


def test_states_change_where_they_do(shown: Timelines) -> None:
    picture = pixels(shown.rows)
    assert near(picture, place(shown, "Video", 4.9, 0.2), palette.GOOD)
    assert near(picture, place(shown, "Video", 5.1, 0.2), palette.GAP)


def test_the_cursor_stands_at_its_time_and_leaves_no_trace(shown: Timelines) -> None:
    before = pixels(shown.rows)
    shown.set_time(6.0)
    now = pixels(shown.rows)
    x = round(place(shown, "Residual", 6.0)[0])
    assert (np.abs(now[200, x - 2 : x + 2].astype(int) - palette.SELECTED).max(axis=1) < 90).any()
    shown.set_time(0.0)
    assert np.array_equal(pixels(shown.rows), before)


def test_the_curve_passes_through_its_values(shown: Timelines) -> None:
    picture = pixels(shown.rows).astype(int)
    area = shown.rows.area_of("Residual")
    high = 6.0 + 0.05 * 6.0  # lowest is 0, and there is a twentieth of room above
    for time in (0.8, 4.7, 7.85):
        x = round(place(shown, "Residual", time)[0])
        column = np.abs(picture[int(area.top()) + 2 : int(area.bottom()) - 2, x] - BLUE).max(axis=1)
        y = area.top() + 2 + int(column.argmin())
        value = 5 + np.sin(TIME[round(time * 100)])
        expected = area.bottom() - 3 - value / high * (area.height() - 6)
        assert abs(y - expected) <= 2, (time, y, expected)


def test_dragging_seeks_within_the_recording(shown: Timelines) -> None:
    found: list[float] = []
    shown.seeked.connect(found.append)
    QTest.mousePress(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Markers", 2.0))
    QTest.mouseMove(shown.rows, point(shown, "Markers", 7.5))
    QTest.mouseMove(shown.rows, QPoint(shown.rows.width() + 50, 40))
    QTest.mouseRelease(shown.rows, Qt.MouseButton.LeftButton, pos=QPoint(shown.rows.width() + 50, 40))
    assert found[0] == pytest.approx(2.0, abs=0.02)
    assert found[1] == pytest.approx(7.5, abs=0.02)
    assert found[-1] == 10.0


def test_the_cursor_does_not_move_before_the_clock_says_so(shown: Timelines) -> None:
    shown.set_time(1.0)
    QTest.mouseClick(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Markers", 8.0))
    assert shown.window_of_time.time == 1.0


def test_a_click_names_row_moment_and_marker(shown: Timelines) -> None:
    found: list[tuple] = []
    shown.row_clicked.connect(lambda *what: found.append(what))
    QTest.mouseClick(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Markers", 4.0, 0.625))
    QTest.mouseClick(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Video", 6.0))
    assert [(name, round(time, 1), index) for name, time, index in found] == [("Markers", 4.0, 2), ("Video", 6.0, 1)]


def test_shift_drag_marks_a_range_and_escape_clears_it(shown: Timelines) -> None:
    found: list[object] = []
    shown.range_changed.connect(found.append)
    shift = Qt.KeyboardModifier.ShiftModifier
    QTest.mousePress(shown.rows, Qt.MouseButton.LeftButton, shift, point(shown, "Markers", 6.0))
    QTest.mouseMove(shown.rows, point(shown, "Markers", 3.0))
    QTest.mouseRelease(shown.rows, Qt.MouseButton.LeftButton, shift, point(shown, "Markers", 3.0))
    assert found[-1] == pytest.approx((3.0, 6.0), abs=0.02)
    QTest.keyClick(shown, Qt.Key.Key_Escape)
    assert found[-1] is None


def test_keys_set_the_ends_of_the_range_to_the_cursor(shown: Timelines) -> None:
    found: list[object] = []
    shown.range_changed.connect(found.append)
    shown.set_time(2.0)
    QTest.keyClicks(shown, "[")
    shown.set_time(5.0)
    QTest.keyClicks(shown, "]")
    assert found == [(2.0, 10.0), (2.0, 5.0)]


def test_setting_the_range_from_outside_tells_nobody(shown: Timelines) -> None:
    found: list[object] = []
    shown.range_changed.connect(found.append)
    shown.set_range((1, 2))
    assert found == []


def test_the_wheel_zooms_about_the_pointer(shown: Timelines) -> None:
    at = point(shown, "Markers", 4.0)
    wheel(shown.rows, at, 120 * 5)
    start, end = shown.view()
    assert end - start == pytest.approx(10 / 1.2**5)
    assert shown.rows.clock_scale().value(at.x()) == pytest.approx(4.0, abs=0.02)
    wheel(shown.rows, at, -120 * 20)
    assert shown.view() == (0.0, 10.0)


def wheel(widget: QWidget, at: QPoint, turn: int) -> None:
    none = Qt.KeyboardModifier.NoModifier
    place = QPointF(at)
    event = QWheelEvent(
        place, widget.mapToGlobal(place), QPoint(), QPoint(0, turn), Qt.MouseButton.NoButton, none,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(widget, event)


def test_a_cursor_that_leaves_a_zoomed_view_turns_the_page(shown: Timelines) -> None:
    shown.set_view(2, 4)
    shown.set_time(4.5)
    assert shown.view() == pytest.approx((4.3, 6.3))


def test_the_overview_pans(shown: Timelines) -> None:
    shown.set_view(2, 4)
    scale, y = shown.header.whole(), round(shown.header.strip().center().y())
    QTest.mousePress(shown.header, Qt.MouseButton.LeftButton, pos=QPoint(round(scale.at(3)), y))
    QTest.mouseMove(shown.header, QPoint(round(scale.at(6)), y))
    QTest.mouseRelease(shown.header, Qt.MouseButton.LeftButton, pos=QPoint(round(scale.at(6)), y))
    assert shown.view() == pytest.approx((5, 7), abs=0.05)


def test_the_videos_bar_is_dragged_and_the_automatic_offset_taken(shown: Timelines) -> None:
    dragged: list[float] = []
    committed: list[float] = []
    shown.offset_dragged.connect(dragged.append)
    shown.offset_committed.connect(committed.append)
    QTest.mousePress(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Offset", 3.0))
    QTest.mouseMove(shown.rows, point(shown, "Offset", 4.2))
    QTest.mouseRelease(shown.rows, Qt.MouseButton.LeftButton, pos=point(shown, "Offset", 4.2))
    assert dragged[-1] == committed[-1] == pytest.approx(3.2, abs=0.02)
    button = shown.findChild(QToolButton)
    assert button is not None
    assert button.isVisible()
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert committed[-1] == 2.5
    assert not button.isVisible()
    QTest.keyClick(shown, Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    assert committed[-1] == pytest.approx(2.51)


def test_what_is_selected_is_framed(shown: Timelines) -> None:
    before = pixels(shown.rows)
    shown.set_selected([3])
    changed = np.abs(pixels(shown.rows).astype(int) - before).max(axis=2) > 30
    rows_changed = np.flatnonzero(changed.any(axis=1))
    area = shown.rows.area_of("Markers")
    assert rows_changed.min() >= area.top() + 0.72 * area.height()
    assert rows_changed.max() <= area.bottom() + 1


def test_a_row_is_replaced_by_name(shown: Timelines) -> None:
    shown.add_row(StateRow("Video", TIME, np.zeros(1000, np.uint8), np.array([palette.BAD]), ("lost",)))
    assert [row.name for row in shown.rows.shown_rows()] == ["Markers", "Video", "Residual", "Offset"]
    assert near(pixels(shown.rows), place(shown, "Video", 4.9, 0.2), palette.BAD)


@given(st.integers(1, 400), st.integers(1, 60), st.integers(0, 2**32 - 1))
def test_shares_are_means_of_the_frames_behind_a_pixel(frames: int, width: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    flags = rng.random((frames, 3)) < 0.3
    first, last, _ = shown_frames(np.arange(frames) / 30.0, 0.0, frames / 30.0, width)
    share = Counts(flags).share(first, last)
    assert share.min() >= 0 and share.max() <= 1 + 1e-6
    if np.median(last - first) <= 8:
        assert np.allclose(share, [flags[a:b].mean(axis=0) for a, b in zip(first, last)])
    # nothing is lost from sight: a flag that is set anywhere shows in some pixel
    assert np.array_equal(share.max(axis=0) > 0, flags.any(axis=0))


@given(st.integers(10, 20_000), st.integers(20, 200), st.integers(0, 2**32 - 1))
def test_the_envelope_keeps_every_peak(frames: int, width: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal(frames)
    time, shown = envelope(np.arange(frames) * 0.01, values, 0.0, frames * 0.01, width)
    assert shown.max() == values.max()
    assert shown.min() == values.min()
    assert len(time) <= 3 * width


@pytest.mark.parametrize(
    ("seconds", "step", "text"),
    [
        (0, 1, "0 s"),
        (1.5, 0.5, "1.5 s"),
        (59.999, 0.01, "1:00.00"),
        (61, 1, "1:01"),
        (-2.5, 0.1, "−2.5 s"),
        (600, 60, "10:00"),
    ],
)
def test_clock(seconds: float, step: float, text: str) -> None:
    assert clock(seconds, step) == text


def test_ticks_are_round() -> None:
    assert ticks(0, 10, 5) == [0, 2, 4, 6, 8, 10]
    assert time_ticks(0, 600, 8)[0] == [0, 120, 240, 360, 480, 600]
    assert [number(v, 0.5) for v in (-0.0, -0.5, 1)] == ["0.0", "−0.5", "1.0"]
    log = Scale(1e-2, 1e3, 0, 100, log=True)
    assert log.at(10) == pytest.approx(60)
    assert log.value(60) == pytest.approx(10)


def test_strips_in_another_order_are_told_by_their_markers(qapp: QApplication) -> None:
    made, found = Timelines(), []
    made.resize(600, 200)
    made.set_span(0, 10)
    made.set_rows([PresenceRow("Markers", TIME, np.ones((1000, 3), bool), markers=np.array([2, 0, 1]))])
    made.show()
    made.row_clicked.connect(lambda name, time, index: found.append(index))
    QTest.mouseClick(made.rows, Qt.MouseButton.LeftButton, pos=point(made, "Markers", 5.0, 1 / 6))
    assert found == [2]
    before = pixels(made.rows)
    made.set_selected([2])
    changed = np.flatnonzero((np.abs(pixels(made.rows).astype(int) - before).max(axis=2) > 30).any(axis=1))
    assert changed.max() <= made.rows.area_of("Markers").top() + made.rows.area_of("Markers").height() / 3 + 2
    made.close()


@pytest.mark.parametrize(
    ("low", "high", "most"), [(126, 144, 4), (0.5, 250, 2), (0.5, 250, 6), (1e-3, 2e-3, 3), (1, 1e6, 3)]
)
def test_a_logarithmic_axis_has_two_numbers_at_least(low: float, high: float, most: int) -> None:
    found = log_ticks(low, high, most)
    assert 2 <= len(found) <= most + 1, found
    assert all(low * (1 - 1e-9) <= value <= high * (1 + 1e-9) for value in found)


@given(st.floats(0.01, 1e4), st.floats(20, 400), st.floats(10, 60))
def test_an_axis_has_two_numbers_however_low_it_is(high: float, tall: float, apart: float) -> None:
    assert len(Scale(0, high, tall, 0).ticks(apart)) >= 2


@given(st.lists(st.floats(1, 400), min_size=1, max_size=8), st.floats(50, 900))
def test_names_share_their_room_the_longest_giving_way_first(widths: list[float], room: float) -> None:
    longest = shortened(widths, room)
    shown = [min(width, longest) for width in widths]
    assert sum(shown) <= room + 1e-6 or longest == pytest.approx(room / len(widths))
    if sum(widths) <= room:
        assert shown == widths
    elif longest < max(widths):
        assert sum(shown) == pytest.approx(room), "no room is wasted while a name is cut"


def test_every_curves_name_is_shown_however_many_there_are(qapp: QApplication) -> None:
    inks = palette.categorical(5)
    curves = tuple(Curve(f"a fit with quite a long name {k}", np.full(1000, k + 1.0), inks[k]) for k in range(5))
    made = Timelines()
    made.resize(700, 220)
    made.set_span(0, 10)
    made.set_rows([CurveRow("Residual", TIME, curves, "mm")])
    made.show()
    qapp.processEvents()
    picture, area = pixels(made.rows), made.rows.area_of("Residual")
    head = picture[round(area.top()) + 1 : round(area.top()) + 20, round(area.left()) : round(area.right())]
    for k, ink in enumerate(inks):
        assert (np.abs(head.astype(int) - legible(ink)).max(axis=2) <= 12).sum() >= 8, f"the name of curve {k}"
    made.close()
