"""Angles, convergence, hypotheses and the transport bar: what they draw and what they tell."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from markerscope.widgets import palette, theme
from markerscope.widgets.gallery.panels import hypotheses
from markerscope.widgets.images import to_rgb
from markerscope.widgets.panels.energy_bars import EnergyBar
from markerscope.widgets.panels.hypotheses import HypothesesView
from markerscope.widgets.panels.transport import Readout, Transport
from markerscope.widgets.plots.angle_data import AngleCurve, AnglePlot
from markerscope.widgets.plots.angle_plots import _broken
from markerscope.widgets.plots.convergence import ConvergenceView
from markerscope.widgets.plots.convergence_data import EnergyCurve
from markerscope.widgets.plots.curves import CurvesView
from markerscope.widgets.plots.ink import pen, polyline
from tests.widgets.drawn import distance, pixels

TIME = np.arange(400) / 100


def angle_plots() -> list[AnglePlot]:
    knee = (
        AngleCurve("knee_angle_l", "left", 20 + 10 * TIME, TIME * 0 + 55, "flexion", "markers", palette.LEFT),
        AngleCurve("knee_angle_r", "right", np.where(TIME < 2, np.nan, 40.0), None, colour=palette.RIGHT),
    )
    hip = (AngleCurve("hip_flexion_l", "left", TIME * 0 - 12.34, colour=palette.LEFT),)
    trunk = (AngleCurve("trunk_tilt", "", TIME * 0),)
    return [AnglePlot("hip", "Hip flexion", hip), AnglePlot("knee", "Knee", knee), AnglePlot("trunk", "Trunk", trunk)]


@pytest.fixture
def curves(qapp: QApplication) -> Iterator[CurvesView]:
    theme.apply(qapp, "light")
    made = CurvesView()
    made.resize(800, 400)
    made.set_curves(TIME, angle_plots(), "OpenSim", "the T pose")
    made.show()
    qapp.processEvents()
    yield made
    made.close()


def test_bands_are_drawn_about_what_is_measured_and_told_of(curves: CurvesView) -> None:
    def drawn(error: float | None, rests: str = "markers") -> tuple[np.ndarray, str]:
        about = None if error is None else np.full(len(TIME), error)
        curve = AngleCurve("knee_angle_l", "left", 20 + 10 * TIME, None, "", rests, palette.LEFT, about)
        curves.set_curves(TIME, [AnglePlot("knee", "Knee", (curve,))])
        curves.set_shown(["Knee"])
        QApplication.processEvents()
        return pixels(curves.plots), curves._title.text()

    bare, banded, guessed = drawn(None), drawn(2.0), drawn(2.0, "video only")
    assert "standard errors" not in bare[1] and "two standard errors" in banded[1]
    assert "no marker on either segment" in guessed[1] and "no marker" not in banded[1]
    assert (bare[0] != banded[0]).any(axis=-1).mean() > 0.02, "an area, not a line"


@pytest.fixture
def descents(qapp: QApplication) -> Iterator[ConvergenceView]:
    theme.apply(qapp, "light")
    made = ConvergenceView()
    made.resize(500, 420)
    steps = np.array([0, 10, 50, 100])
    made.set_curves(
        [
            EnergyCurve("coarse", "a", steps, np.array([9.0, 5.0, 3.0, 2.0]), (0, 114, 178)),
            EnergyCurve("fine", "a", steps, np.array([2.0, 1.0, 0.5, 0.4]), (0, 114, 178)),
            EnergyCurve("fine", "b", steps, np.array([3.0, 1.0, 0.3, 0.2]), (230, 159, 0), "a tolerance was met"),
        ]
    )
    made.show()
    qapp.processEvents()
    yield made
    made.close()


def said(widget: CurvesView | ConvergenceView | HypothesesView) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel))


def test_the_legs_are_shown_first_and_the_rest_by_a_tick(curves: CurvesView) -> None:
    assert curves.shown() == ["Hip flexion", "Knee"]
    told: list[list[str]] = []
    curves.shown_changed.connect(told.append)
    trunk = curves.tree.topLevelItem(2)
    assert trunk is not None
    trunk.child(0).setCheckState(0, Qt.CheckState.Checked)
    assert told[-1] == ["Hip flexion", "Knee", "Trunk"]
    curves.set_shown(["Knee"])
    assert curves.shown() == ["Knee"]
    assert len(told) == 1
    assert "OpenSim, degrees" in said(curves)
    assert any("ounted from the T pose" in label.toolTip() for label in curves.findChildren(QLabel))


def test_curves_pass_through_their_degrees_and_stop_at_gaps(curves: CurvesView) -> None:
    curves.set_shown(["Knee"])
    picture, area = pixels(curves.plots), curves.plots.areas()[0]
    x = curves.plots.scale(area)
    low, high = 20.0, 59.9
    room = 0.05 * (high - low)
    for time in (0.5, 1.5):
        column = distance(picture[round(area.top()) : round(area.bottom()), round(x.at(time))], palette.LEFT)
        expected = area.height() * (high + room - (20 + 10 * time)) / (high - low + 2 * room)
        middle = round(expected)
        assert column[middle - 2 : middle + 3].min() < 60, time  # elsewhere a dash of the reference may stand
        assert column[middle + 6 :].min() > 60 or expected > area.height() - 8, time
        right = distance(picture[round(area.top()) : round(area.bottom()), round(x.at(time))], palette.RIGHT)
        assert right.min() > 60, "the right knee is lost there"
    column = distance(picture[round(area.top()) : round(area.bottom()), round(x.at(3.0))], palette.RIGHT)
    assert column.min() < 40


def test_the_values_are_those_at_the_cursor(curves: CurvesView) -> None:
    curves.set_time(1.0)
    assert curves.plots.values_at(1, 1.0)[0] == pytest.approx(30.0)
    assert np.isnan(curves.plots.values_at(1, 1.0)[1])
    assert np.isnan(curves.plots.values_at(0, 9.0)).all()


def test_a_drag_over_a_plot_seeks(curves: CurvesView) -> None:
    told: list[float] = []
    curves.seeked.connect(told.append)
    area = curves.plots.areas()[1]
    at = QPointF(curves.plots.scale(area).at(2.5), area.center().y()).toPoint()
    QTest.mouseClick(curves.plots, Qt.MouseButton.LeftButton, pos=at)
    assert told == pytest.approx([2.5], abs=0.02)


def test_ticks_stay_when_another_result_has_the_same_angles(curves: CurvesView) -> None:
    curves.set_shown(["Trunk"])
    curves.set_curves(TIME, angle_plots(), "ISB")
    assert curves.shown() == ["Trunk"]


def test_without_angles_it_says_what_to_run(qapp: QApplication) -> None:
    made = CurvesView()
    made.resize(400, 200)
    assert distance(pixels(made.plots), theme.colours().window).max() > 60
    made.set_curves(np.zeros(0), [])


def test_the_last_stages_lowest_descent_is_chosen_at_its_end(descents: ConvergenceView) -> None:
    assert descents.chosen() == 2
    assert "Iteration 100 of 100, energy 0.2. It ended: a tolerance was met." in said(descents)


def test_the_slider_tells_curve_and_iteration(descents: ConvergenceView) -> None:
    told: list[tuple[int, int]] = []
    descents.iteration_chosen.connect(lambda curve, iteration: told.append((curve, iteration)))
    descents.slider.setFocus()
    QTest.keyClick(descents.slider, Qt.Key.Key_Home)
    QTest.keyClick(descents.slider, Qt.Key.Key_Right)
    assert told == [(2, 0), (2, 1)]
    descents.set_iteration(1, 50)
    assert (descents.chosen(), descents.slider.value()) == (1, 50)
    assert len(told) == 2


def test_a_click_chooses_the_nearest_descent(descents: ConvergenceView) -> None:
    told: list[tuple[int, int]] = []
    descents.iteration_chosen.connect(lambda curve, iteration: told.append((curve, iteration)))
    x, y = descents.plot.scales()
    QTest.mouseClick(descents.plot, Qt.MouseButton.LeftButton, pos=QPointF(x.at(80), y.at(0.5)).toPoint())
    assert told == [(1, 80)]
    picture = pixels(descents.plot)
    line = distance(picture[round(y.at(2.9)) - 2 : round(y.at(2.9)) + 3, round(x.at(80)) - 1 : round(x.at(80)) + 2],
                    palette.SELECTED)  # fmt: skip
    assert line.min() < 60


def test_another_stage_has_its_own_curves(descents: ConvergenceView) -> None:
    stages: list[str] = []
    descents.stage_chosen.connect(stages.append)
    descents.stage.setCurrentIndex(0)
    descents.stage.activated.emit(0)
    assert stages == ["coarse"]
    assert descents.chosen() == 0
    assert descents.curve.count() == 1


def test_curves_that_grow_keep_the_choice(descents: ConvergenceView) -> None:
    descents.set_iteration(1, 10)
    longer = np.array([0, 10, 50, 100, 200])
    descents.set_curves([EnergyCurve("fine", "a", longer, np.array([2, 1, 0.5, 0.4, 0.3]), (0, 114, 178))])
    assert (descents.chosen(), descents.slider.value(), descents.slider.maximum()) == (0, 10, 200)
    descents.set_curves([])
    assert descents.chosen() == -1


def test_playing_goes_on_to_the_end(descents: ConvergenceView, qapp: QApplication) -> None:
    descents.set_iteration(2, 98)
    QTest.mouseClick(descents.play, Qt.MouseButton.LeftButton)
    for _ in range(100):
        QTest.qWait(20)
        if not descents.play.isChecked():
            break
    assert descents.slider.value() == 100
    assert not descents.play.isChecked()


def test_hypotheses_are_chosen_and_pinned(qapp: QApplication) -> None:
    theme.apply(qapp, "light")
    made = hypotheses()
    assert isinstance(made, HypothesesView)
    made.show()
    chosen: list[int] = []
    pinned: list[int] = []
    made.hypothesis_selected.connect(chosen.append)
    made.pin_requested.connect(pinned.append)
    cards = made.cards()
    QTest.mouseClick(cards[2], Qt.MouseButton.LeftButton, pos=cards[2].rect().center())
    QTest.keyClick(cards[3], Qt.Key.Key_Return)
    QTest.mouseClick(cards[1].pin, Qt.MouseButton.LeftButton)
    QTest.mouseClick(cards[0].pin, Qt.MouseButton.LeftButton)  # in use already
    assert (chosen, pinned) == ([2, 3], [1])
    assert not cards[0].pin.isEnabled()
    assert distance(pixels(cards[3])[cards[3].height() // 2, 1:4], theme.colours().accent).min() < 60
    made.close()


def test_bars_share_one_scale(qapp: QApplication) -> None:
    made = hypotheses()
    assert isinstance(made, HypothesesView)
    made.show()
    for card in made.cards():
        bar = card.findChild(EnergyBar)
        ends = [rect.right() for _, rect in bar.parts()]
        most = max(sum(term.value for term in other.card.terms) for other in made.cards())
        total = sum(term.value for term in card.card.terms)
        assert ends[-1] == pytest.approx((bar.width() - 1) * total / most, abs=0.01)
        first = card.card.terms[0]
        assert distance(pixels(bar)[bar.height() // 2, 2], first.colour) <= 4
    made.close()


def test_the_transport_bar_tells_what_is_wanted(qapp: QApplication) -> None:
    made, told = Transport(), []
    made.show()
    made.play_toggled.connect(lambda: told.append("play"))
    made.stepped.connect(told.append)
    made.start_wanted.connect(lambda: told.append("start"))
    made.end_wanted.connect(lambda: told.append("end"))
    made.loop_toggled.connect(told.append)
    made.speed_chosen.connect(told.append)
    for button in (made.play, made.back, made.forward, made.to_start, made.to_end, made.loop):
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    assert told == ["play", -1, 1, "start", "end", True]
    made.set_state(True, 0.25, False)
    assert len(told) == 6
    assert made.play.accessibleName() == "Stop"
    assert made.speed.currentData() == 0.25
    QTest.keyClick(made.speed, Qt.Key.Key_Down)
    assert told[-1] == 0.5
    made.close()


def test_readouts_say_frame_and_time_of_both_streams(qapp: QApplication) -> None:
    made = Transport()
    made.set_readouts(Readout(12, 6000, 0.12), Readout(None, 1800))
    assert made.markers.text() == "Markers 12 / 5999   0.120 s"
    assert made.video.text() == "Video none now"
    made.set_readouts(Readout(5999, 6000, 59.99), Readout(None, 0))
    assert made.video.text() == "Video –"


def test_the_convention_and_the_joint_of_a_bone_are_shown(curves: CurvesView, qapp: QApplication) -> None:
    asked: list[str] = []
    joints: list[str] = []
    curves.convention_chosen.connect(asked.append)
    curves.joint_chosen.connect(joints.append)
    assert not curves.convention.isVisible(), "nothing to choose from"
    curves.set_conventions((("opensim", "OpenSim"), ("isb", "ISB")), "isb")
    assert curves.convention.currentData() == "isb" and asked == []
    curves.convention.setFocus()
    QTest.keyClick(curves.convention, Qt.Key.Key_Up)
    curves.convention.activated.emit(0)
    assert asked[-1] == "opensim"
    qapp.processEvents()
    curves.set_shown(["Knee", "Hip flexion"])
    qapp.processEvents()
    before = pixels(curves.plots)
    curves.set_joint("knee")
    framed = (distance(pixels(curves.plots), palette.SELECTED) < 40) & (distance(before, palette.SELECTED) > 60)
    rows, columns = np.flatnonzero(framed.any(axis=1)), np.flatnonzero(framed.any(axis=0))
    area = next(a for p, a in zip(curves.plots._plots, curves.plots.areas()) if p.joint == "knee")
    found, wanted = (columns[0], columns[-1], rows[0], rows[-1]), (area.left(), area.right(), area.top(), area.bottom())
    assert np.allclose(found, wanted, atol=3), (found, wanted)
    assert joints == [], "what is selected elsewhere is only shown"
    curves.set_joint(None)
    assert np.array_equal(pixels(curves.plots), before)
    curves.tree.itemClicked.emit(curves.tree.topLevelItem(1), 0)
    assert joints == ["knee"]


@pytest.mark.parametrize("count", [40, 700, 1400])
def test_a_dashed_line_has_gaps_and_a_solid_one_none_however_many_points(qapp: QApplication, count: int) -> None:
    def covered(dashed: bool) -> np.ndarray:
        image = QImage(420, 60, QImage.Format.Format_RGB888)
        image.fill(QColor(255, 255, 255))
        painter = QPainter(image)
        painter.setPen(pen((0, 0, 0), 1.6, dashed))
        polyline(painter, np.linspace(10, 410, count), np.full(count, 30.0))
        painter.end()
        return (to_rgb(image)[26:35, 12:408] < 160).any(axis=(0, 2))

    assert covered(False).all(), f"gaps in a solid line of {count} points"
    share = covered(True).mean()
    assert 0.35 < share < 0.8, f"{share:.0%} of a dashed line of {count} points is drawn"


def test_a_curve_breaks_where_its_reading_jumps() -> None:
    time = np.arange(6) / 10
    curve = _broken("arm_flex_r", time, np.array([200.0, 230, -128, np.nan, -100, -90]), palette.RIGHT)
    assert curve.time is not None and np.isfinite(curve.time).all() and (np.diff(curve.time) > 0).all()
    assert np.isnan(curve.values).tolist() == [False, False, True, False, True, False, False]
    assert curve.time[2] == pytest.approx(0.15)
