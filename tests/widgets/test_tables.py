"""The tables: rows keep their numbers however they are sorted, filtered and added to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from markerscope.widgets import theme
from markerscope.widgets.gallery.tables import candidate_rows, marker_rows
from markerscope.widgets.tables.array_table import ArrayTable
from markerscope.widgets.tables.candidate_data import SearchStep
from markerscope.widgets.tables.candidates import CandidateTable
from markerscope.widgets.tables.columns import Column, natural
from markerscope.widgets.tables.markers import MarkerTable
from tests.widgets.drawn import distance, pixels

NAMES = ["M10", "M2", "M1", "M3"]
SIZES = np.array([0.5, np.nan, 12.25, -3.0])


def columns(rows: int = 4) -> list[Column]:
    return [
        Column("Name", NAMES[:rows], colours=np.array([[255, 0, 0]] * rows, np.uint8)),
        Column("Size", SIZES[:rows], "mm", ".1f", "How large", bar=(0, 12.25)),
    ]


@pytest.fixture
def table(qapp: QApplication) -> Iterator[ArrayTable]:
    theme.apply(qapp, "light")
    made = ArrayTable("Things", can_pin=True)
    made.resize(320, 260)
    made.set_columns(columns())
    made.show()
    qapp.processEvents()
    yield made
    made.close()


def place(table: ArrayTable, shown: int, column: int = 0) -> QPoint:
    return table.view.visualRect(table.view.model().index(shown, column)).center()


def click(table: ArrayTable, shown: int, keys: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
    QTest.mouseClick(table.view.viewport(), Qt.MouseButton.LeftButton, keys, place(table, shown))


def test_rows_are_as_given_until_they_are_sorted(table: ArrayTable) -> None:
    assert table.shown_rows() == [0, 1, 2, 3]
    table.view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
    assert [NAMES[row] for row in table.shown_rows()] == ["M1", "M2", "M3", "M10"]


def test_numbers_are_sorted_as_numbers_and_absent_ones_come_last(table: ArrayTable) -> None:
    table.view.sortByColumn(1, Qt.SortOrder.AscendingOrder)
    assert table.shown_rows() == [3, 0, 2, 1]
    table.view.sortByColumn(1, Qt.SortOrder.DescendingOrder)
    assert table.shown_rows() == [2, 0, 3, 1]


def test_a_click_names_the_row_by_its_number(table: ArrayTable) -> None:
    found: list[int] = []
    table.row_selected.connect(found.append)
    table.view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
    click(table, 3)
    assert found == [0]


def test_several_rows_are_selected_and_copied_with_units(table: ArrayTable) -> None:
    click(table, 0)
    click(table, 2, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(table.view, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert QGuiApplication.clipboard().text() == "Name\tSize (mm)\nM10\t0.5\nM1\t12.2"
    assert table.as_text().splitlines()[2] == "M2\t–"


def test_the_filter_keeps_rows_with_all_words(table: ArrayTable) -> None:
    QTest.keyClicks(table.filter, "m1 0.5")
    assert table.shown_rows() == [0]
    table.filter.clear()
    assert table.shown_rows() == [0, 1, 2, 3]


def test_rows_that_come_while_it_runs_leave_the_selection(qapp: QApplication) -> None:
    made = ArrayTable("Things")
    made.set_columns(columns(2))
    made.view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
    made.set_selected([0])
    told: list[list[int]] = []
    made.rows_selected.connect(told.append)
    made.set_columns(columns(4))
    assert [NAMES[row] for row in made.shown_rows()] == ["M1", "M2", "M3", "M10"]
    assert made.selected_rows() == [0]
    assert made.current_row() == 0
    assert told == []


def test_fewer_rows_do_not_break_it(table: ArrayTable) -> None:
    table.set_selected([3])
    table.set_columns(columns(1))
    assert table.selected_rows() == []
    table.set_columns([])
    assert table.as_text() == ""


def test_selecting_from_outside_tells_nobody(table: ArrayTable) -> None:
    told: list[object] = []
    table.row_selected.connect(told.append)
    table.set_selected([2, 1])
    assert told == []
    assert sorted(table.selected_rows()) == [1, 2]
    assert table.current_row() == 2


def test_keys_pin_and_activate(table: ArrayTable) -> None:
    pinned: list[int] = []
    activated: list[int] = []
    table.pin_requested.connect(pinned.append)
    table.row_activated.connect(activated.append)
    table.set_selected([2])
    QTest.keyClick(table.view, Qt.Key.Key_P)
    QTest.keyClick(table.view, Qt.Key.Key_Return)
    assert (pinned, activated) == ([2], [2])
    click(table, 1)
    QTest.mouseDClick(table.view.viewport(), Qt.MouseButton.LeftButton, pos=place(table, 1))
    assert activated == [2, 1]
    assert next(action.text() for action in table.menu().actions()) == "Pin, and go on from it"


def test_bars_are_as_long_as_their_values(table: ArrayTable) -> None:
    picture, look = pixels(table.view.viewport()), theme.colours()
    lengths = []
    for shown in (0, 2):
        rect = table.view.visualRect(table.view.model().index(shown, 1))
        line = picture[rect.bottom() - 3, rect.left() : rect.right()]
        lengths.append(int((distance(line, look.accent) <= 4).sum()) / (rect.width() - 8))
    assert lengths == pytest.approx([0.5 / 12.25, 1.0], abs=0.02)


def test_swatches_have_their_colour(table: ArrayTable) -> None:
    rect = table.view.visualRect(table.view.model().index(0, 0))
    assert distance(pixels(table.view.viewport())[rect.center().y(), rect.left() + 3], (255, 0, 0)) <= 4


def test_columns_of_different_lengths_are_refused(table: ArrayTable) -> None:
    with pytest.raises(ValueError, match="one length"):
        table.set_columns([Column("a", [1]), Column("b", [1, 2])])


def test_candidates_are_stepped_through_and_pinned(qapp: QApplication) -> None:
    made = CandidateTable()
    made.resize(800, 400)
    made.set_rows(candidate_rows(), pinned=1)
    steps = [SearchStep("pool", "all", tuple(range(14))), SearchStep("refined", "few", (0, 1, 2, 3))]
    made.set_steps(steps, "pool")
    made.show()
    steps_chosen: list[str] = []
    pinned: list[int] = []
    made.step_chosen.connect(steps_chosen.append)
    made.pin_requested.connect(pinned.append)
    assert not made.pin_button.isEnabled()
    QTest.mouseClick(made.step_buttons()[1], Qt.MouseButton.LeftButton)
    assert steps_chosen == ["refined"]
    assert made.table.shown_rows() == [0, 1, 2, 3]
    click(made.table, 2)
    QTest.mouseClick(made.pin_button, Qt.MouseButton.LeftButton)
    assert pinned == [2]
    assert "same as 1" in made.table.as_text(selected=True)
    made.close()


def test_enter_goes_to_a_markers_worst_frame(qapp: QApplication) -> None:
    made, rows = MarkerTable(), marker_rows()
    made.set_rows(rows)
    told: list[tuple[int, float]] = []
    made.worst_requested.connect(lambda marker, time: told.append((marker, time)))
    made.set_selected([7])
    QTest.keyClick(made.table.view, Qt.Key.Key_Return)
    made.set_selected([40])  # never seen
    QTest.keyClick(made.table.view, Qt.Key.Key_Return)
    assert told == [(7, rows.worst_time[7])]


def test_names_are_ordered_as_people_count() -> None:
    assert sorted(["a10", "A2", "b", "a"], key=natural) == ["a", "A2", "a10", "b"]
    assert sorted(["1x", "x1", "10x"], key=natural) == ["1x", "10x", "x1"]
