"""The stages' cards: what they say, and what their controls ask for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QCheckBox, QLabel, QPushButton, QWidget

from markerscope.widgets import theme
from markerscope.widgets.boxes import ChoiceBox, CountBox, NumberBox
from markerscope.widgets.gallery.panels import SEGMENT, STAGES
from markerscope.widgets.panels.fields import SettingsForm
from markerscope.widgets.panels.stage_data import StageProgress, duration, left
from markerscope.widgets.panels.stage_panel import StagePanel
from tests.widgets.drawn import distance, pixels


@pytest.fixture
def panel(qapp: QApplication) -> Iterator[StagePanel]:
    theme.apply(qapp, "light")
    made = StagePanel()
    made.resize(400, 900)
    made.set_stages(STAGES)
    made.card("segment").set_open(True)
    made.show()
    qapp.processEvents()
    yield made
    made.close()


@pytest.fixture
def form(qapp: QApplication) -> Iterator[tuple[SettingsForm, list]]:
    made, found = SettingsForm(), []
    made.set_fields(SEGMENT)
    made.changed.connect(lambda name, value: found.append((name, value)))
    made.show()
    yield made, found
    made.close()


def texts(widget: QWidget) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel) if label.isVisibleTo(widget))


def press(button: QWidget) -> None:
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)


def test_every_card_says_how_it_stands(panel: StagePanel) -> None:
    for stage in STAGES:
        said = texts(panel.card(stage.name))
        assert stage.title in said
        words = {"stale": "out of date", "cached": "done", "not run": "to do", "check": "to check"}
        assert words.get(stage.state, stage.state) in said
        assert all(text in said for text in stage.checks)
        assert stage.headline in said


def test_the_state_is_drawn_in_its_colour(panel: StagePanel) -> None:
    look = theme.colours()
    for name, ink in (("markers", look.good), ("sync", look.warning), ("fit", look.error)):
        assert distance(pixels(panel.card(name)), ink).min() <= 4, name


def test_buttons_ask_for_runs(panel: StagePanel) -> None:
    asked: list[tuple[str, str]] = []
    panel.run.connect(lambda name: asked.append(("run", name)))
    panel.run_to.connect(lambda name: asked.append(("to", name)))
    panel.stop.connect(lambda: asked.append(("stop", "")))
    press(panel.card("segment").run_button)
    press(panel.card("segment").run_to_button)
    press(panel.card("orient").stop_button)
    panel.card("orient").set_open(True)
    press(panel.card("orient").run_button)  # says why it cannot
    assert asked == [("run", "segment"), ("to", "segment"), ("stop", "")]
    assert "Not now: stages are running" in panel.card("orient").run_button.toolTip()


def test_earlier_results_are_gone_back_to_and_compared(panel: StagePanel) -> None:
    chosen: list[tuple] = []
    compared: list[tuple] = []
    panel.earlier_chosen.connect(lambda *what: chosen.append(what))
    panel.compare_toggled.connect(lambda *what: compared.append(what))
    current, earlier = panel.card("segment").earlier_rows()
    assert current.findChild(QPushButton) is None
    press(earlier.findChild(QPushButton))
    box = earlier.findChild(QCheckBox)
    QTest.keyClick(box, Qt.Key.Key_Space)
    assert chosen == [("segment", "b2")]
    assert compared == [("segment", "b2", False)]


def test_progress_says_what_is_left(panel: StagePanel) -> None:
    card = panel.card("orient")
    panel.set_progress("orient", StageProgress(0.42, "candidate 5 of 12", 38.0))
    assert card.bar.value() == 420
    assert "candidate 5 of 12, about 40 s left" in texts(card)
    panel.set_progress("orient", StageProgress(None, "starting"))
    assert (card.bar.minimum(), card.bar.maximum()) == (0, 0)
    assert not panel.card("clean").bar.isVisible()


def test_an_open_card_and_the_focus_outlive_new_data(panel: StagePanel) -> None:
    card = panel.card("segment")
    editor = card.form.editor("threshold")
    changed = tuple(replace(stage, state="stale") if stage.name == "segment" else stage for stage in STAGES)
    panel.set_stages(changed)
    assert panel.card("segment") is card
    assert card.is_open()
    assert card.form.editor("threshold") is editor
    panel.set_stages(changed[:3])
    assert panel.findChildren(type(card))[:3]
    panel.show_stage("segment")


def test_a_number_is_told_once_when_it_is_whole(form: tuple[SettingsForm, list]) -> None:
    made, found = form
    box = made.editor("threshold").findChild(NumberBox)
    box.selectAll()
    QTest.keyClicks(box, "12.5")
    assert found == []
    QTest.keyClick(box, Qt.Key.Key_Return)
    assert found == [("threshold", 12.5)]
    assert box.text() == "12.5 mm"


def test_numbers_stay_in_range(form: tuple[SettingsForm, list]) -> None:
    made, _ = form
    box = made.editor("threshold").findChild(NumberBox)
    box.setValue(1e6)
    assert made.editor("threshold").value() == 100.0


def test_automatic_is_none_and_shows_no_number(form: tuple[SettingsForm, list]) -> None:
    made, found = form
    editor = made.editor("groups")
    count = editor.findChild(CountBox)
    assert editor.value() is None
    assert count.text() == ""
    QTest.keyClick(editor.automatic, Qt.Key.Key_Space)
    assert found == [("groups", 1)]
    count.setValue(7)
    assert found[-1] == ("groups", 7)


def test_choices_switches_and_ranges(form: tuple[SettingsForm, list]) -> None:
    made, found = form
    choice = made.editor("convention").findChild(ChoiceBox)
    QTest.keyClick(choice, Qt.Key.Key_Down)
    QTest.keyClick(made.editor("keep").findChild(QCheckBox), Qt.Key.Key_Space)
    made.editor("span").findChildren(NumberBox)[1].setValue(20)
    assert found == [("convention", "isb"), ("keep", False), ("span", (2.0, 20.0))]


def test_only_what_was_changed_can_be_reset(form: tuple[SettingsForm, list]) -> None:
    made, found = form
    assert not made.reset_button("far").isEnabled()
    press(made.reset_button("threshold"))
    assert found == [("threshold", 8.0)]
    assert made.editor("threshold").value() == 8.0


def test_showing_a_value_tells_nobody(form: tuple[SettingsForm, list]) -> None:
    made, found = form
    made.set_fields([replace(SEGMENT[0], value=3.0), *SEGMENT[1:]])
    assert made.editor("threshold").value() == 3.0
    assert found == []


def test_tooltips_carry_meaning_unit_and_range(form: tuple[SettingsForm, list]) -> None:
    tip = form[0].editor("threshold").findChild(NumberBox).toolTip()
    assert "Average standard deviation" in tip
    assert "Default: 8 mm." in tip
    assert "Range: 0.1 to 100 mm." in tip


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.031, "31 ms"), (1.34, "1.3 s"), (12.4, "12 s"), (61.2, "1 min 01 s"), (3_720, "1 h 02 min")],
)
def test_durations(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_what_is_left_is_no_more_exact_than_it_is_known() -> None:
    assert [left(s) for s in (0.2, 4.4, 38, 130)] == [
        "about 1 s left", "about 4 s left", "about 40 s left", "about 2 min left",
    ]  # fmt: skip


def test_a_card_is_never_wider_than_the_panel(panel: StagePanel, qapp: QApplication) -> None:
    for stage in STAGES:
        panel.card(stage.name).set_open(True)
    qapp.processEvents()
    panel.resize(panel.minimumSizeHint())
    qapp.processEvents()
    for stage in STAGES:
        card = panel.card(stage.name)
        right = card.mapTo(panel, card.rect().topRight()).x()
        assert right < panel.viewport().width(), f"{stage.name} goes on beyond the panel's edge"
