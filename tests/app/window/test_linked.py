"""One selection and one clock: whatever is chosen in one view is chosen in all."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from markerscope.app.window.main import MainWindow
from markerscope.widgets.panels.transport import Readout
from tests.app.window.test_journey import changed, picture


class Solved(Protocol):
    """Opens the window on a solved session, a copy of its own where no folder is given."""

    def __call__(self, folder: Path | None = None) -> MainWindow: ...


@pytest.fixture
def window(solved_window: Solved) -> MainWindow:
    return solved_window()


def shown_everywhere(window: MainWindow, markers: set[int]) -> dict[str, set[int]]:
    """The markers that each view shows as selected."""
    table = window.markers.table
    return {
        "selection": set(window.bench.selection.markers),
        "scene": set(window.scene._sheet.selected),
        "table": set(table.selected_rows()),
        "affinity": set(window.affinity._selected),
        "timelines": set(window.timelines.rows._selected),
        "video": set(window.video._selected),
    }


def test_a_marker_chosen_in_any_view_is_chosen_in_all(window: MainWindow, spin: Callable[..., None]) -> None:
    bench, shown = window.bench, window.shown
    assert shown.tracks is not None
    seen = shown.tracks.seen(shown.tracks.nearest(bench.clock.time))
    pixels = window.scene.project(seen)
    clickable = [
        m for m in range(len(seen)) if np.isfinite(pixels[m]).all() and window.scene.marker_at(tuple(pixels[m])) == m
    ]
    presence = next(row for row in window.timelines.rows.shown_rows() if row.name == "Markers")

    def in_scene(marker: int) -> None:
        window.scene.click(tuple(pixels[marker]), Qt.KeyboardModifier.NoModifier)

    def in_table(marker: int) -> None:
        window.markers.table.view.selectRow(
            window.markers.table._sorted.mapFromSource(window.markers.table.model.index(marker, 0)).row()
        )

    def in_affinity(marker: int) -> None:
        window.affinity.leaves_clicked.emit([marker], Qt.KeyboardModifier.NoModifier)

    def in_timelines(marker: int) -> None:
        area = window.timelines.rows.area_of("Markers")
        strip = int(np.flatnonzero(np.asarray(presence.markers) == marker)[0])
        y = area.top() + (strip + 0.5) * area.height() / len(presence.markers)
        QTest.mouseClick(window.timelines.rows, Qt.MouseButton.LeftButton, pos=QPoint(round(area.center().x()), int(y)))

    def in_video(marker: int) -> None:
        window.video.marker_clicked.emit(marker, Qt.KeyboardModifier.NoModifier)

    ways = (in_scene, in_table, in_affinity, in_timelines, in_video)
    for choose, marker in zip(ways, clickable):
        bench.selection.clear()
        choose(marker)
        spin()
        assert all(found == {marker} for found in shown_everywhere(window, {marker}).values()), (
            choose.__name__,
            shown_everywhere(window, {marker}),
        )


def test_a_group_and_a_bone_are_their_markers(window: MainWindow, spin: Callable[..., None]) -> None:
    bench = window.bench
    groups = bench.board.current["segment"].clusters
    group = int(np.argmax(np.bincount(groups[groups >= 0])))
    first = int(np.flatnonzero(groups == group)[0])
    area, order = window.affinity.places().strip, window.affinity._order
    column = int(np.flatnonzero(order == first)[0])
    x = area.left() + (column + 0.5) * area.width() / len(order)
    window.raise_dock("affinity")
    QTest.mouseClick(window.affinity, Qt.MouseButton.LeftButton, pos=QPoint(round(x), round(area.center().y())))
    spin()
    wanted = set(np.flatnonzero(groups == group).tolist())
    assert bench.selection.cluster == group
    assert all(found == wanted for found in shown_everywhere(window, wanted).values())

    bones = bench.board.current["fit"].marker_joint
    bone = int(np.bincount(bones[bones >= 0]).argmax())
    before = picture(window.scene)
    window.scene.bone_clicked.emit("skeleton", _edge_of(bone), Qt.KeyboardModifier.NoModifier)
    spin()
    wanted = set(np.flatnonzero(bones == bone).tolist())
    assert bench.selection.bone == bone
    assert all(found == wanted for found in shown_everywhere(window, wanted).values())
    assert changed(before, picture(window.scene)) > 0.0005, "the bone has another colour"


def _edge_of(bone: int) -> int:
    from markerscope.app.views.posing import BONE_EDGES

    return int(np.flatnonzero(BONE_EDGES[:, 0] == bone)[0])


def test_a_pairs_distance_is_shown_over_time(window: MainWindow, spin: Callable[..., None]) -> None:
    window.raise_dock("affinity")
    i, j = (int(m) for m in window.affinity._order[:2])
    cell = window.affinity.cell(i, j)
    QTest.mouseClick(window.affinity, Qt.MouseButton.LeftButton, pos=cell.center().toPoint())
    spin()
    assert window.bench.selection.markers == {i, j} and window.pair.isVisible()
    positions = window.shown.markers.positions
    distance = 1000 * np.linalg.norm(positions[:, i] - positions[:, j], axis=1)
    assert f"{np.nanmean(distance):.1f} mm" in window.pair.sentence()


def test_a_candidate_is_one_in_table_cards_curves_and_scene(window: MainWindow, spin: Callable[..., None]) -> None:
    bench = window.bench
    window.raise_dock("candidates")
    spin()
    plain = picture(window.scene)
    window.candidates.row_selected.emit(next(i for i, r in enumerate(_rows(window)) if r.candidate == 1))
    spin()
    assert bench.selection.candidate == 1
    assert changed(plain, picture(window.scene)) > 0.002, "its ghost"
    assert window.convergence.curve.currentText().startswith("2:"), "its descent"
    residual = next(row for row in window.timelines.rows.shown_rows() if row.name == "Residual")
    assert any("candidate 2" in curve.label for curve in residual.curves), "its residual"
    bench.selection.select(candidate=0)
    spin()
    chosen = [card.card.candidate for card in window.hypotheses.cards() if card._chosen]
    assert chosen == [0]
    assert window.candidates.table.current_row() == next(i for i, r in enumerate(_rows(window)) if r.candidate == 0)
    window.hypotheses.hypothesis_selected.emit(1)
    assert bench.selection.candidate == 1


def _rows(window: MainWindow) -> list:
    binder = next(own for own in window.binders if type(own).__name__ == "CandidatesBinder")
    return list(binder._table.rows)


def test_the_slider_moves_the_body_and_lets_it_go(window: MainWindow, spin: Callable[..., None]) -> None:
    window.raise_dock("convergence")
    spin()
    spin(lambda: window.scene.settled, "a scene at rest")
    fitted = picture(window.scene)
    slider = window.convergence.slider
    assert slider.maximum() > 1
    slider.setFocus()
    QTest.keyClick(slider, Qt.Key.Key_Home)
    spin()
    first = picture(window.scene)
    assert window.ghosts.replaces_body and changed(fitted, first) > 0.01
    QTest.keyClick(slider, Qt.Key.Key_End)
    spin()
    assert changed(first, picture(window.scene)) > 0.003, "another iteration, another pose"
    assert window.bench.selection.iteration == slider.maximum()
    assert window.table.trigger("ghosts.leave")
    spin()
    assert not window.ghosts.replaces_body
    spin(lambda: changed(fitted, picture(window.scene)) < 0.002, "the fit, as fine as it was")


def test_the_worst_frame_of_a_marker_is_gone_to(window: MainWindow) -> None:
    residual = window.bench.board.current["fit"].residual
    marker = int(np.nanargmax(np.nanmax(np.nan_to_num(residual), axis=0)))
    window.markers.table.row_activated.emit(marker)
    assert window.bench.clock.marker_frame == int(np.nanargmax(residual[:, marker]))
    assert window.bench.selection.markers == {marker}


def test_both_readouts_follow_the_clock(window: MainWindow, spin: Callable[..., None]) -> None:
    bench = window.bench
    timing = bench.clock.timing
    for frame in (0, 37, timing.frames - 1):
        bench.clock.seek_marker_frame(frame)
        spin()
        video = int(np.abs(np.asarray(timing.video) * timing.rate_ratio + timing.offset - bench.clock.time).argmin())
        assert window.transport.markers.text().startswith(f"Markers {frame} / {timing.frames - 1} ")
        assert window.transport.video.text().startswith(f"Video {video} / {len(timing.video) - 1} ")
        assert f"{timing.video[video]:.3f} s" in window.transport.video.text(), "the time of the frame that is shown"
    assert Readout(None, 9).text("Video") == "Video none now"
