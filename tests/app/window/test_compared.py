"""Earlier results: gone back to at once, laid beside the one in force; and what comes while a stage still runs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from markerscope.app.models import edits
from markerscope.app.window.main import MainWindow
from tests.app.window.test_journey import changed, picture, states
from tests.app.window.test_linked import Solved

Spin = Callable[..., None]


@pytest.fixture
def window(solved_window: Solved) -> MainWindow:
    return solved_window()


def test_a_compared_fit_brings_its_ghost_its_residual_and_its_angles(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    first, degrees = bench.board.keys["fit"], bench.board.current["angles"].degrees
    bench.selection.select(candidate=1)
    assert window.table.trigger("candidate.pin_run")
    spin(lambda: not bench.runner.running and not window.shown.stale("angles"), "the run")
    bench.selection.clear()
    spin()
    plain = picture(window.scene)
    bench.board.compare("fit", first, True)
    spin(lambda: any(c.reference is not None for p in window.angles._all for c in p.curves), "the angles of before")
    spin(lambda: window.ghosts.all != (), "its ghost")
    spin()
    assert changed(plain, picture(window.scene)) > 0.001
    shown = {c.name: c.reference for p in window.angles._all for c in p.curves}
    names = bench.board.current["angles"].names
    column = names.index("knee_angle_l")
    known = np.isfinite(shown["knee_angle_l"])
    assert np.allclose(shown["knee_angle_l"][known], degrees[known, column])
    assert "Dashed" in window.angles._title.text()

    position = bench.document.history.position
    window.stages.earlier_chosen.emit("fit", first)
    spin()
    assert (
        bench.board.keys["fit"] == first and states(window)["fit"] == "cached" and states(window)["angles"] == "cached"
    )
    assert bench.document.history.position == position + 1
    assert window.table.trigger("edit.undo")
    assert bench.board.keys["fit"] != first


def test_angles_are_told_by_another_convention_at_once(window: MainWindow, spin: Spin) -> None:
    window.raise_dock("angles")
    bench = window.bench
    names = [window.angles.convention.itemData(k) for k in range(window.angles.convention.count())]
    assert {"opensim", "isb"} <= set(names) and window.angles.convention.currentData() == "opensim"
    window.angles.convention.activated.emit(names.index("isb"))
    assert bench.board.settings["angles"].convention == "isb"
    spin(lambda: not bench.runner.running and not window.shown.stale("angles"), "the angles")
    assert any("varus" in plot.title for plot in window.angles._all)
    assert window.table.trigger("edit.undo")
    spin(lambda: not window.shown.stale("angles"), "those of before")
    assert window.angles.convention.currentData() == "opensim"
    assert not any("varus" in plot.title for plot in window.angles._all)


def test_a_bone_is_the_joint_of_its_angles(window: MainWindow, spin: Spin) -> None:
    from markerscope.solver.core.skeleton import JOINTS

    bones = window.bench.board.current["fit"].marker_joint
    knee = JOINTS.index("left_knee")
    if not (bones == knee).any():
        pytest.skip("no marker on that bone")
    window.bench.selection.select_bone(knee)
    assert window.angles.plots._joint == "knee"
    window.angles.joint_chosen.emit("hip")
    hips = [JOINTS.index("left_hip"), JOINTS.index("right_hip")]
    assert window.bench.selection.markers == set(np.flatnonzero(np.isin(bones, hips)).tolist())


def test_candidates_fill_the_table_while_they_are_searched(window: MainWindow, spin: Spin) -> None:
    bench = window.bench
    window.raise_dock("candidates")
    bench.apply(edits.set_value(bench.document.session, "orient", "prior_deg", 25.0))
    bench.selection.select(stage="orient")
    counts: list[int] = []

    def count() -> None:
        scores = window.candidates.table.model.columns[3].values if window.candidates.table.model.columns else []
        counts.append(int(np.isfinite(np.asarray(scores, float)).sum()))

    bench.runner.found.connect(lambda found: count() if found.kind == "candidate" else None)
    assert window.table.trigger("run.stage")
    spin(lambda: not bench.runner.running, "the search")
    assert counts and counts[-1] > counts[0] >= 1, counts
    assert sorted(counts) == counts, "none is lost on the way"
    titles = [button.text() for button in window.candidates.step_buttons()]
    assert [title.split()[0] for title in titles] == ["Pool", "Scored", "Kept", "Refined"]
    shown = []
    for button in window.candidates.step_buttons():
        button.click()
        spin()
        shown.append(len(window.candidates.table.shown_rows()))
        assert f"({shown[-1]})" in button.text() and button.toolTip()
    assert shown == sorted(shown, reverse=True), "each step narrows them down"
