"""The head of the stages: what Solve does, figures, and things to check that lead somewhere."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QPlainTextEdit, QVBoxLayout, QWidget

from markerscope.widgets.panels.glance_bar import GlanceBar, GlanceData, Tile


def test_it_says_what_solve_does_and_what_is_to_check(qapp: QApplication) -> None:
    bar = GlanceBar()
    told: list[object] = []
    bar.solve.connect(lambda: told.append("solve"))
    bar.check_chosen.connect(told.append)
    bar.set_data(GlanceData(plan="Computes 3 stages: about 12 s."))
    bar.show()
    qapp.processEvents()
    assert bar.plan.text() == "Computes 3 stages: about 12 s." and not bar.stop_button.isVisible()
    QTest.mouseClick(bar.solve_button, Qt.MouseButton.LeftButton)
    assert told == ["solve"]
    tiles = (Tile("Part", "left leg"), Tile("Confidence", "60 %", "", True))
    bar.set_data(GlanceData("All is there.", tiles=tiles, checks=("a < b", "two", "three", "four")))
    assert bar.tiles() == [("Part", "left leg"), ("Confidence", "60 %")]
    said = bar.checks.text()
    assert "4 to check" in said and "a &lt; b" in said and "and 1 more" in said and "four" not in said
    bar.checks.linkActivated.emit("1")
    assert told == ["solve", 1]
    bar.set_data(GlanceData("Fit: working", running=True))
    assert bar.stop_button.isVisible() and not bar.solve_button.isVisible()
    bar.set_data(GlanceData("All is there.", tiles=tiles))
    assert "Nothing speaks against" in bar.checks.text()
    bar.set_data(GlanceData("Computes Fit.", tiles=tiles, old=True))
    assert any("out of date" in label.text() for label in bar.findChildren(QLabel)) and not bar.checks.isVisible()
    bar.close()


def test_no_sentence_is_cut_off_in_a_narrow_column(qapp: QApplication) -> None:
    column = QWidget()
    layout = QVBoxLayout(column)
    bar = GlanceBar()
    layout.addWidget(bar)
    layout.addWidget(QPlainTextEdit(), 1)
    column.resize(300, 700)
    column.show()
    long = "The markers are 38 mm from where the body puts them, which is no fit to rely on. " * 2
    bar.set_data(GlanceData("Computes 7 stages, Synchronisation to Doubts: about 23 s.", checks=(long, long, long)))
    for _ in range(4):
        qapp.processEvents()
    for label in (bar.plan, bar.checks):
        assert label.height() >= label.heightForWidth(label.width()) > label.fontMetrics().height()
    column.close()
