"""One glance: what is doubtful is amber and leads to its place, Solve says what it does, markers alone are grouped."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QWidget

from markerscope.app.models import edits
from markerscope.app.models.demo import DEMO_MARKERS
from markerscope.app.models.imports import new_session
from markerscope.app.window.main import MainWindow

Spin = Callable[..., None]


def words(widget: QWidget) -> str:
    return "\n".join(label.text() for label in widget.findChildren(QLabel) if label.isVisibleTo(widget))


def test_markers_alone_are_cleaned_and_grouped(open_window: Callable[..., MainWindow], spin: Spin) -> None:
    window = open_window()
    bench = window.bench
    made = new_session(DEMO_MARKERS)
    bench.document.new(**{**made, "edits": {"markers": {"start": 2.0, "stop": 4.0}}})
    spin(lambda: bench.clock.timing.frames > 0, "the markers")
    spin(lambda: "Computes" in window.glance.plan.text(), "the plan")
    assert "Cleaning to Segmentation" in window.glance.plan.text() and "about" in window.glance.plan.text()
    assert not bench.board.card("segment").why_not
    assert "neither a video nor a pose prior" in bench.board.card("fit").why_not
    QTest.mouseClick(window.glance.solve_button, Qt.MouseButton.LeftButton)
    assert bench.runner.running
    spin(lambda: window.glance.stop_button.isVisibleTo(window.glance), "Stop")
    spin(lambda: not bench.runner.running, "the run")
    assert bench.board.state("clean") == bench.board.state("segment") == "cached"
    assert bench.board.state("landmarks") == "not run" and "failed" not in words(window.glance)
    assert any("files that are there" in said.what for said in window.said)  # type: ignore[attr-defined]
    spin(lambda: window.shown.clusters is not None, "the groups")


def test_done_is_not_good_and_leads_to_its_place(solved_window: Callable[..., MainWindow], spin: Spin) -> None:
    window = solved_window()
    bench = window.bench
    spin(lambda: bool(window.glance.tiles()), "the figures")
    shown = dict(window.glance.tiles())
    assert {"Part", "Confidence", "Marker residual", "Sync offset"} <= shown.keys()
    assert shown["Sync offset"] == "+0.370 s"
    # A pin is said by the fit as something to check, and by all that stands on it.
    other = bench.board.current["orient"].candidates
    bench.document.apply(edits.pin_candidate(bench.document.session, len(other) - 1))
    assert window.table.trigger("run.all")
    spin(lambda: not bench.runner.running, "the run", 300)
    spin(lambda: any("pinned by hand" in concern.text for concern in window.concerned.all), "the pin")
    number = f"candidate {len(other)}"
    spin(lambda: number in words(window.stages.card("angles")), "what the angles stand on")
    card = window.stages.card("fit")
    assert "to check" in words(card) and number in words(card)
    row = next(i for i, own in enumerate(window.concerned.of("fit")) if "pinned" in own.text)
    window.raise_dock("markers")
    card.check_chosen.emit("fit", row)
    spin()
    assert bench.selection.candidate == len(other) - 1 and bench.selection.stage == "fit"
    assert not window.docks.docks["candidates"].visibleRegion().isEmpty()
    # What the filter hides is not held by P, and another method has other candidates.
    window.candidates.table.filter.setText("no such bone")
    spin()
    assert bench.selection.candidate is None
    window.candidates.table.filter.clear()
    bench.selection.select(candidate=0)
    assert window.table.trigger("method.paper")
    spin()
    assert bench.selection.candidate is None
