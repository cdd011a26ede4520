"""The plots of markers: what is drawn of a long recording, where, and what a click, a drag and a double click say."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from markerscope.widgets.gallery.plots import marker_curve_picture
from markerscope.widgets.panels.track_editor import TrackEditor
from markerscope.widgets.plots.gap_histogram import CLASSES, GapHistogram, count_lengths
from markerscope.widgets.plots.marker_curve_data import CurvePicture, CurvePlot, Line, ProposalRow, Shade, Way
from markerscope.widgets.plots.marker_curves import OPTIONS, MarkerCurvesView
from tests.widgets.drawn import pixels

INK = (0, 114, 178)


def view_of(picture: CurvePicture) -> MarkerCurvesView:
    made = MarkerCurvesView(TrackEditor())
    if len(picture.time):
        made.window_of_time.set_span(float(picture.time[0]), float(picture.time[-1]))
    made.set_picture(picture)
    made.resize(900, 420)
    made.show()
    QApplication.processEvents()
    return made


def test_nothing_and_next_to_nothing_is_drawn(qapp: QApplication) -> None:
    for picture in (
        CurvePicture(np.zeros(0), note="Select a marker."),
        CurvePicture(np.zeros(1), (CurvePlot("x", "mm", (Line("measured", "a", np.array([np.nan]), INK),)),)),
        CurvePicture(np.arange(2.0), (CurvePlot("x", "mm", ()),), (Shade(0, 1, "gap", "a", INK),), (("a", INK),)),
    ):
        made = view_of(picture)
        assert pixels(made).size
        made.resize(60, 40)
        QApplication.processEvents()
        made.close()


def test_a_gap_of_one_frame_in_sixty_thousand_is_seen(qapp: QApplication) -> None:
    time = np.arange(60000) / 100
    line = Line("measured", "a", np.sin(time), INK)
    plot = (CurvePlot("x", "mm", (line,)),)
    without, with_gap = (
        pixels(view_of(CurvePicture(time, plot, shades, (("a", INK),))).plots)
        for shades in ((), (Shade(30000, 30000, "gap", "a", INK),))
    )
    assert (without != with_gap).any(axis=-1).sum() > 20


def test_clicks_drags_and_double_clicks_say_where_in_time(qapp: QApplication) -> None:
    made = view_of(marker_curve_picture())
    plots, said = made.plots, list[object]()
    made.seeked.connect(said.append)
    made.range_marked.connect(said.append)
    row = round(plots.areas()[1].center().y())

    def at(time: float) -> QPoint:
        return QPoint(round(plots.scale().at(time)), row)

    QTest.mouseClick(plots, Qt.MouseButton.LeftButton, pos=at(5.0))
    assert isinstance(said[-1], float) and abs(said[-1] - 5.0) < 0.05
    QTest.mousePress(plots, Qt.MouseButton.LeftButton, pos=at(3.0))
    QTest.mouseMove(plots, at(2.5))
    QTest.mouseMove(plots, at(2.0))
    QTest.mouseRelease(plots, Qt.MouseButton.LeftButton, pos=at(2.0))
    assert isinstance(said[-1], tuple) and np.allclose(said[-1], (2.0, 3.0), atol=0.05)
    QTest.mouseDClick(plots, Qt.MouseButton.LeftButton, pos=at(7.0))
    low, high = made.window_of_time.view
    assert low < 400 / 60 and high > 439 / 60 and high - low < 6, "near to the gap"
    QTest.mouseDClick(plots, Qt.MouseButton.LeftButton, pos=at(low + 0.05 * (high - low)))
    assert made.window_of_time.view == made.window_of_time.span
    made.close()


def test_values_at_the_cursor_are_cleaned_or_filled_ones(qapp: QApplication) -> None:
    picture = marker_curve_picture()
    plots = view_of(picture).plots
    values = plots.values_at(picture.plots[0], 1.0)
    own = {line.label: line.values for line in picture.plots[0].lines if line.kind == "measured"}
    assert values == {label: own[label][60] for label in ("LKNE", "LANK")}
    assert np.isnan(list(plots.values_at(picture.plots[0], 7.0).values())).all(), "lost"
    assert np.isfinite(list(plots.values_at(picture.plots[0], 10.15).values())).all(), "filled"


def test_the_legend_names_markers_and_kinds_in_as_many_rows_as_it_needs(qapp: QApplication) -> None:
    made = view_of(marker_curve_picture())
    said = made.legend.accessibleDescription()
    for word in ("LKNE", "LANK", "as in the file", "cleaned", "filled", "as the body predicts", "preview"):
        assert word in said
    wide = made.legend.height()
    made.resize(560, 420)
    QApplication.processEvents()
    assert made.legend.height() > wide
    made.close()


def test_options_are_remembered(qapp: QApplication) -> None:
    made = view_of(marker_curve_picture())
    made.options["velocity"].click()
    made.options["raw"].click()
    state = made.state()
    again = view_of(marker_curve_picture())
    again.restore({**state, "x": 3, "unknown": True})
    assert again.state() == state and set(state) == set(OPTIONS)
    again.restore("nonsense")
    assert again.state() == state


def test_the_editor_offers_ways_and_says_why_not(qapp: QApplication) -> None:
    made = TrackEditor()
    asked: list[str] = []
    made.asked.connect(asked.append)
    ways = [Way("rigid", "Rigid", "0.8 mm"), Way("body", "Body", why_not="there is no fit"), Way("linear", "Line")]
    made.set_gap("a", ways, "linear")
    assert made.way() == "linear"
    made.fill.click()
    made.set_gap("a", [ways[1]])
    made.fill.click()
    assert asked == ["fill.linear", "fill.best"]
    body = made.ways.topLevelItem(0)
    assert body.isDisabled() and "there is no fit" in body.toolTip(0)
    made.set_reasons({"tracks.join": ("two markers have to be selected", "Join them."), "tracks.cut": ("", "Cut it.")})
    assert not made.buttons["tracks.join"].isEnabled() and made.buttons["tracks.cut"].isEnabled()
    assert "two markers" in made.buttons["tracks.join"].toolTip()
    rows = (ProposalRow("a", "1 s", "proposed"), ProposalRow("b", "2 s", "accepted"))
    made.set_proposals(rows, "")
    made.proposals.topLevelItem(1).setSelected(True)
    made.set_proposals(rows, "")
    assert made.chosen() == [1], "what was chosen stays so"


def test_gap_lengths_are_counted_in_classes_that_double(qapp: QApplication) -> None:
    lengths = np.array([1, 1, 2, 3, 4, 7, 8, 300, 5000])
    assert count_lengths(lengths).tolist() == [2, 2, 2, 1, 0, 0, 0, 0, 2]
    assert all(high + 1 == low for (_, high), (low, _) in pairwise(CLASSES)), "no length falls between"
    made = GapHistogram()
    made.set_lengths("a", lengths, 100.0)
    assert sum(made.counts()) == len(lengths) and pixels(made).size
