"""Dialogs, messages and pages: what they say, and what they ask for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from markerscope.widgets import theme
from markerscope.widgets.boxes import ChoiceBox
from markerscope.widgets.dialogs.command_palette import CommandPalette
from markerscope.widgets.dialogs.export_dialog import ExportDialog
from markerscope.widgets.dialogs.fuzzy import score
from markerscope.widgets.dialogs.import_data import ImportChoice, ImportShown
from markerscope.widgets.dialogs.import_dialog import ImportDialog
from markerscope.widgets.dialogs.points_preview import PointsPreview
from markerscope.widgets.dialogs.shortcut_sheet import ShortcutSheet
from markerscope.widgets.gallery.dialogs import ENTRIES, FORMATS
from markerscope.widgets.panels.history import HistoryList
from markerscope.widgets.panels.message_bar import Message, MessageBar
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_data import StageProgress
from markerscope.widgets.panels.welcome import Recent, WelcomePage
from tests.widgets.drawn import distance, pixels

POINTS = np.array([[0, 0, 0], [0.2, 0, 1.7], [-0.2, 0.1, 0.9], [np.nan] * 3])
SHOWN = ImportShown(
    "walk.c3d", ("a", "b", "c", "d"), np.array([1.0, 0.9, 0.5, 0.01]), POINTS, 600, "mm", None, "y", "y", 100.0
)


def press(button: QWidget) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)


def said(widget: QWidget) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel) if label.isVisibleTo(widget))


@pytest.fixture
def opening(qapp: QApplication) -> Iterator[tuple[ImportDialog, list[ImportChoice]]]:
    theme.apply(qapp, "light")
    made, told = ImportDialog(), []
    made.set_shown(SHOWN)
    made.changed.connect(told.append)
    made.show()
    qapp.processEvents()
    yield made, told
    made.close()


@pytest.fixture
def commands(qapp: QApplication) -> Iterator[tuple[CommandPalette, list[str]]]:
    parent, told = QWidget(), []
    parent.resize(700, 500)
    parent.show()
    made = CommandPalette(parent)
    made.chosen.connect(told.append)
    made.open_with(ENTRIES)
    yield made, told
    parent.close()


def test_the_import_dialog_says_what_the_file_holds(opening: tuple) -> None:
    made, told = opening
    assert "walk.c3d: 4 points, 600 frames, 6.0 s" in said(made)
    assert told == []
    assert made.choice() == ImportChoice("mm", "y", 100.0, "", (), "")
    assert "does not say" in made.form.editor("units").findChild(ChoiceBox).toolTip()


def test_every_change_of_how_to_read_is_told(opening: tuple) -> None:
    made, told = opening
    QTest.keyClick(made.form.editor("units").findChild(ChoiceBox), Qt.Key.Key_Down)
    QTest.keyClick(made.form.editor("up").findChild(ChoiceBox), Qt.Key.Key_Up)
    made.points.topLevelItem(0).setCheckState(0, Qt.CheckState.Unchecked)
    assert (told[0].units, told[1].up, told[2].left_out) == ("cm", "z", ("a",))
    press(made.often)
    assert told[-1].left_out == ("d",)
    press(made.all)
    assert told[-1].left_out == ()
    made.set_video("/films/walk.mp4")
    assert told[-1].video == "/films/walk.mp4"


def test_ticks_stay_when_the_file_is_read_otherwise(opening: tuple) -> None:
    made, told = opening
    press(made.often)
    made.set_shown(replace(SHOWN, units="m", points=POINTS * 1000))
    assert made.choice().left_out == ("d",)
    assert len(told) == 1


def test_a_problem_or_no_points_forbid_to_open(opening: tuple) -> None:
    made, _ = opening
    assert made.open_button.isEnabled()
    made.set_shown(replace(SHOWN, problem="The file does not say its rate: give it."))
    assert not made.open_button.isEnabled()
    assert "give it" in said(made)
    made.set_shown(SHOWN)
    for k in range(4):
        made.points.topLevelItem(k).setCheckState(0, Qt.CheckState.Unchecked)
    assert not made.open_button.isEnabled()


def test_the_preview_draws_points_upright_and_to_one_scale(qapp: QApplication) -> None:
    theme.apply(qapp, "light")
    made = PointsPreview()
    made.resize(400, 400)
    made.set_points(POINTS, left_out=[1])
    picture, ink = pixels(made), theme.colours().accent
    found = np.argwhere(distance(picture, ink) < 30)
    scale = made.scale()
    height = found[:, 0].max() - found[:, 0].min()
    assert height == pytest.approx(0.9 * scale, abs=7)  # the point at 1.7 m is left out, so hollow and grey
    assert distance(picture, theme.colours().faint).min() < 40


def test_the_export_dialog_says_what_it_will_write(qapp: QApplication) -> None:
    made, told = ExportDialog(FORMATS, "/out"), []
    made.export_wanted.connect(lambda ids, folder: told.append((ids, folder)))
    assert made.chosen() == ["angles", "c3d"]
    assert "Will write angles.csv, angles.json, markers_labelled.c3d." in said(made)
    made.set_existing(["angles.csv", "other.txt"])
    assert "There already, and replaced: angles.csv." in said(made)
    assert not made.boxes["video"].isEnabled()
    assert "The fit has not been run." in said(made)
    made.show()
    QTest.keyClick(made.boxes["mot"], Qt.Key.Key_Space)
    press(made.export_button)
    assert told == [(["angles", "mot", "c3d"], "/out")]


def test_nothing_is_exported_without_a_folder_or_a_choice(qapp: QApplication) -> None:
    made = ExportDialog(FORMATS, "")
    assert not made.export_button.isEnabled()
    made.set_folder("/out")
    assert made.export_button.isEnabled()
    for box in made.boxes.values():
        box.setChecked(False)
    assert not made.export_button.isEnabled()


def test_actions_are_found_by_a_few_letters(commands: tuple) -> None:
    made, told = commands
    QTest.keyClicks(made.line, "exp csv")
    assert made.shown() == ["csv"]
    made.line.clear()
    QTest.keyClicks(made.line, "cff")
    assert made.shown()[0] == "front"
    made.line.clear()
    QTest.keyClicks(made.line, "ru")
    QTest.keyClick(made.line, Qt.Key.Key_Return)
    assert told == ["run"]
    assert not made.isVisible()


def test_what_cannot_be_done_now_is_not_chosen(commands: tuple) -> None:
    made, told = commands
    QTest.keyClicks(made.line, "merge")
    assert made.shown() == ["merge"]
    QTest.keyClick(made.line, Qt.Key.Key_Return)
    assert told == []
    assert made.isVisible()
    QTest.keyClick(made.line, Qt.Key.Key_Escape)
    assert not made.isVisible()


def test_arrows_move_in_the_list_while_typing(commands: tuple) -> None:
    made, told = commands
    QTest.keyClick(made.line, Qt.Key.Key_Down)
    QTest.keyClick(made.line, Qt.Key.Key_Down)
    second = made.shown()[2]
    QTest.keyClick(made.line, Qt.Key.Key_Return)
    assert told == [second]


def test_whole_words_come_before_scattered_letters() -> None:
    titles = ["Camera from the front", "Run all stages", "Undo", "Run to here"]
    assert sorted((t for t in titles if score("run", t) is not None), key=lambda t: -score("run", t))[0].startswith(
        "Run"
    )
    assert score("xyz", "Undo") is None
    assert score("", "Undo") == 0.0
    assert score("undo", "Undo") > score("ud", "Undo") > 0


def test_messages_say_what_where_and_what_to_do(qapp: QApplication) -> None:
    made = MessageBar()
    assert not made.isVisibleTo(None)
    made.show_message(Message("error", "The file ends early.", "walk.c3d, frame 12", "export it again", "Retry"))
    assert made.rows()[0].sentence() == "walk.c3d, frame 12: The file ends early. Export it again."
    acted: list[Message] = []
    closed: list[Message] = []
    made.action_wanted.connect(acted.append)
    made.closed.connect(closed.append)
    made.show()
    press(made.rows()[0].action_button)
    QTest.keyClick(made.rows()[0], Qt.Key.Key_Escape)
    assert [m.action for m in acted] == ["Retry"]
    assert len(closed) == 1
    assert made.messages() == []
    assert not made.isVisible()


def test_errors_outlast_notes_and_a_key_replaces(qapp: QApplication) -> None:
    made = MessageBar()
    made.show_message(Message("error", "one"))
    for k in range(5):
        made.show_message(Message("info", f"note {k}"))
    assert [m.what for m in made.messages()] == ["note 4", "note 3", "one"]
    made.show_message(Message("warning", "other words", key="one"))
    assert [m.what for m in made.messages()] == ["other words", "note 4", "note 3"]
    made.clear("one")
    assert len(made.messages()) == 2


def test_the_strip_shows_only_what_runs(qapp: QApplication) -> None:
    made, told = ProgressStrip(), []
    made.stop.connect(lambda: told.append("stop"))
    made.show()
    assert not made.bar.isVisible()
    made.set_progress(StageProgress(0.5, "candidate 2", 12.0), "Orientation")
    assert made.label.text() == "Orientation: candidate 2, about 10 s left"
    press(made.stop_button)
    assert told == ["stop"]
    made.set_progress(None)
    assert not made.stop_button.isVisible()


def test_history_goes_back_and_forth(qapp: QApplication) -> None:
    made, told = HistoryList(), []
    made.resize(300, 300)
    made.jump_requested.connect(told.append)
    made.set_history(["cut", "merge", "pin"], 2)
    made.show()
    assert [made.item(k).text() for k in range(made.count())] == ["As opened", "cut", "merge", "pin"]
    assert made.currentRow() == 2
    place = made.visualItemRect(made.item(0)).center()
    QTest.mouseClick(made.viewport(), Qt.MouseButton.LeftButton, pos=place)
    made.setCurrentRow(3)
    QTest.keyClick(made, Qt.Key.Key_Return)
    assert told == [0, 3]


def test_the_welcome_page_offers_three_ways_and_recent_ones(qapp: QApplication) -> None:
    made, told = WelcomePage(), []
    made.resize(700, 600)
    made.example_wanted.connect(lambda: told.append("example"))
    made.markers_wanted.connect(lambda: told.append("markers"))
    made.session_wanted.connect(lambda: told.append("session"))
    made.recent_chosen.connect(told.append)
    made.set_recent([Recent("/a.markerscope", "a"), Recent("/b.markerscope", "b", present=False)])
    made.show()
    for button in (made.example, made.markers, made.session, *made.recent_buttons()):
        press(button)
    assert told == ["example", "markers", "session", "/a.markerscope"]


def test_files_can_be_dropped(qapp: QApplication) -> None:
    made, told = WelcomePage(), []
    made.files_dropped.connect(told.append)
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile("/x/walk.c3d"), QUrl.fromLocalFile("/x/walk.mp4"), QUrl("https://a.example/b")])
    none = Qt.KeyboardModifier.NoModifier
    made.dropEvent(QDropEvent(QPointF(5, 5), Qt.DropAction.CopyAction, data, Qt.MouseButton.LeftButton, none))
    assert told == [["/x/walk.c3d", "/x/walk.mp4"]]


def test_the_sheet_holds_all_keys(qapp: QApplication) -> None:
    made = ShortcutSheet({"Playing": [("Space", "Play")], "Session": [("Ctrl+S", "Save"), ("Ctrl+Z", "Undo")]})
    assert {"Playing", "Space", "Play", "Ctrl+S", "Save", "Ctrl+Z", "Undo"} <= set(said(made).split("\n"))
