"""The published method in the window: its chains step by step, and the body along its descents."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.window.main import MainWindow
from markerscope.solver.pipeline.session import Session
from tests.app.window.test_journey import changed, picture


def test_chains_are_stepped_through_and_descents_scrubbed(
    open_window: Callable[[], MainWindow], spin: Callable[..., None], paper_session: Session
) -> None:
    window = open_window()
    window.resize(1280, 800)
    window.open_path(paper_session.folder)
    shown = window.shown
    spin(lambda: shown.track is not None and shown.get("solve") is not None and shown.get("orient") is not None, "it")
    spin(lambda: shown.get("localize") is not None, "the chains")
    window.raise_dock("candidates")
    spin()
    buttons = {button.text().split()[0]: button for button in window.candidates.step_buttons()}
    assert list(buttons) == ["Pool", "Pruned", "Scored", "Refined"]
    counts = {}
    for name, button in buttons.items():
        button.click()
        spin()
        counts[name] = len(window.candidates.table.shown_rows())
    assert counts["Pool"] >= counts["Pruned"] >= counts["Scored"] > 0 and counts["Refined"] == 2
    assert [c.title for c in window.candidates.table.model.columns][4] == "Chamfer"
    buttons["Scored"].click()
    spin()
    plain = picture(window.scene)
    row = window.candidates.table.shown_rows()[0]
    window.candidates.row_selected.emit(row)
    spin()
    assert changed(plain, picture(window.scene)) > 0.002, "the chain's ghost"
    window.table.trigger("ghosts.leave")

    window.raise_dock("convergence")
    spin()
    stages = [window.convergence.stage.itemText(k) for k in range(window.convergence.stage.count())]
    assert stages[0] == "part search" and stages[-1].startswith("5"), "from the search to the last stage"
    slider = window.convergence.slider
    slider.setValue(slider.maximum())
    slider.setValue(0)
    spin()
    first = picture(window.scene)
    slider.setValue(slider.maximum())
    spin()
    assert changed(first, picture(window.scene)) > 0.0005, "the body moves along the descent"
    energies = [curve.energy for curve in window.convergence._curves]
    assert all(np.isfinite(energy).all() for energy in energies)
