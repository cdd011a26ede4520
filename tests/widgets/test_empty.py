"""Nothing, one of each, and only NaN: every view must still draw."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from markerscope.widgets.gallery.plots import session_rows
from markerscope.widgets.panels.hypotheses import HypothesesView
from markerscope.widgets.panels.stage_panel import StagePanel
from markerscope.widgets.plots.affinity import AffinityView
from markerscope.widgets.plots.angle_data import AngleCurve, AnglePlot
from markerscope.widgets.plots.convergence import ConvergenceView
from markerscope.widgets.plots.convergence_data import EnergyCurve
from markerscope.widgets.plots.curves import CurvesView
from markerscope.widgets.plots.pair import PairPlot
from markerscope.widgets.plots.rows import Curve, CurveRow, OffsetRow, PresenceRow, StateRow
from markerscope.widgets.plots.timelines import Timelines
from markerscope.widgets.tables.candidates import CandidateTable
from markerscope.widgets.tables.marker_data import MarkerRows
from markerscope.widgets.tables.markers import MarkerTable
from tests.widgets.drawn import pixels

NONE, INK = np.zeros(0), np.array([0, 0, 255], np.uint8)


def poke(widget: QWidget) -> None:
    """Draw it, and click and type on all of it."""
    widget.resize(360, 240)
    widget.show()
    QApplication.processEvents()
    for part in [widget, *widget.findChildren(QWidget)]:
        if part.isVisibleTo(widget) and type(part).__module__.startswith("markerscope.widgets.plots"):
            QTest.mouseClick(part, Qt.MouseButton.LeftButton, pos=part.rect().center())
            QTest.mouseMove(part, part.rect().center())
            for key in (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Plus):
                QTest.keyClick(part, key)
    assert pixels(widget).size
    widget.resize(40, 30)
    QApplication.processEvents()
    widget.close()


@pytest.mark.parametrize("frames", [0, 1, 2])
@pytest.mark.parametrize("markers", [0, 1])
def test_timelines(qapp: QApplication, frames: int, markers: int) -> None:
    time, flags = np.arange(frames) / 30, np.zeros((frames, markers), bool)
    made = Timelines()
    made.set_span(0, 0)
    made.set_rows(
        [
            PresenceRow("a", time, flags, flags, flags),
            StateRow("b", time, np.zeros(frames, np.uint8), INK[None]),
            CurveRow("c", time, (Curve("x", np.full(frames, np.nan), INK),), "mm"),
            CurveRow("d", time, (), "mm"),
            OffsetRow("e", 0.0, 0.0, 0.0, None, fixed=Curve("f", NONE, INK, NONE)),
        ]
    )
    made.set_selected([0, 5])
    poke(made)
    poke(Timelines())


@pytest.mark.parametrize("markers", [1, 2])
def test_affinity(qapp: QApplication, markers: int) -> None:
    made = AffinityView()
    tree = np.array([[0, 1, 0.0, 2]])[: markers - 1]
    matrix = np.full((3, 3), np.nan)
    colours = np.zeros((3, 3), np.uint8)
    made.set_data(matrix, np.arange(markers), tree, list("abc"), 0.0, np.full(3, -1), colours)
    made.set_selected([2], (0, 2))
    assert made.groups() == 0
    assert made.menu_for([2]).actions()
    poke(made)


def test_plots(qapp: QApplication) -> None:
    pair, curves, descents = PairPlot(), CurvesView(), ConvergenceView()
    poke(pair)
    pair.set_pair("a", "b", np.array([0.0]), np.array([np.nan]))
    poke(pair)
    lost = AnglePlot("knee", "Knee", (AngleCurve("k", "left", np.array([np.nan])),))
    curves.set_curves(np.array([0.0]), [lost, AnglePlot("hip", "Hip", ())])
    curves.set_shown(["Knee", "Hip"])
    poke(curves)
    poke(CurvesView())
    descents.set_curves(
        [
            EnergyCurve("s", "none", np.zeros(0, int), NONE, (0, 0, 0)),
            EnergyCurve("s", "zero", np.array([0]), np.array([0.0]), (0, 0, 0)),
        ]
    )
    poke(descents)
    poke(ConvergenceView())


def test_lists(qapp: QApplication) -> None:
    markers, candidates = MarkerTable(), CandidateTable()
    markers.set_rows(MarkerRows([], NONE, NONE, NONE, NONE, [], NONE, NONE, NONE, NONE, [], NONE, NONE))
    candidates.set_rows([])
    candidates.set_steps([])
    stages = StagePanel()
    stages.set_stages([])
    for made in (markers, candidates, stages, HypothesesView()):
        poke(made)


def test_two_thousand_steps_leave_nothing_behind(qapp: QApplication) -> None:
    made = Timelines()
    made.resize(600, 300)
    made.set_span(0, 60)
    made.set_rows(session_rows())
    made.show()

    def steps(count: int) -> int:
        before = sys.getrefcount(None)
        for k in range(count):
            made.set_time(0.03 * k)
            made.set_selected([k % 24])
            qapp.processEvents()
        return sys.getrefcount(None) - before

    steps(100)
    lost = steps(2000)
    made.close()
    assert abs(lost) < 500, f"{lost} references to None for 2,000 steps: the toolkit drops or keeps one a call"
