"""The affinity view: a tree and a matrix on the same columns, and a cut that is dragged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from scipy.cluster.hierarchy import fcluster, leaves_list, linkage
from scipy.spatial.distance import squareform

from markerscope.widgets import palette, theme
from markerscope.widgets.plots.affinity import AffinityView
from markerscope.widgets.plots.dendrogram import Dendrogram, blocks
from markerscope.widgets.plots.pair import PairPlot
from tests.widgets.drawn import distance, pixels, shows

# Markers 0, 2, 4 are one group, 1 and 3 another; 5 was never seen and is no leaf.
MATRIX = np.full((6, 6), 0.060)
for group in ([0, 2, 4], [1, 3]):
    MATRIX[np.ix_(group, group)] = 0.002
MATRIX[5], MATRIX[:, 5] = np.nan, np.nan
np.fill_diagonal(MATRIX, 0.0)
TREE = linkage(squareform(MATRIX[:5, :5]), "average")
ORDER = leaves_list(TREE)
CLUSTERS = np.array([0, 1, 0, 1, 0, -1])
COLOURS = palette.categorical(2)[np.maximum(CLUSTERS, 0)]
NAMES = list("abcdef")


@pytest.fixture
def shown(qapp: QApplication) -> Iterator[AffinityView]:
    theme.apply(qapp, "light")
    made = AffinityView()
    made.resize(500, 600)
    made.set_data(MATRIX, ORDER, TREE, NAMES, 0.008, CLUSTERS, COLOURS, leaves=np.arange(5))
    made.show()
    qapp.processEvents()
    yield made
    made.close()


def test_rigid_pairs_are_bright_and_loose_ones_dark(shown: AffinityView) -> None:
    picture = pixels(shown)
    rigid, loose = shown.cell(0, 2).center(), shown.cell(0, 1).center()
    table = palette.scale_table("viridis")
    bright = distance(table, picture[round(rigid.y()), round(rigid.x())]).argmin()
    dark = distance(table, picture[round(loose.y()), round(loose.x())]).argmin()
    assert bright > 180, bright
    assert dark < 40, dark


def test_the_groups_colours_stand_beside_their_columns(shown: AffinityView) -> None:
    picture, strip = pixels(shown), shown.places().strip
    for position, marker in enumerate(ORDER):
        x = strip.left() + (position + 0.5) * strip.width() / 5
        assert shows(picture, (x, strip.center().y()), COLOURS[marker]), NAMES[marker]


def test_the_cut_is_dragged_and_let_go(shown: AffinityView) -> None:
    dragged: list[float] = []
    committed: list[float] = []
    shown.cut_dragged.connect(dragged.append)
    shown.cut_committed.connect(committed.append)
    scale, tree = shown.height_scale(), shown.places().tree
    start = QPointF(tree.center().x(), scale.at(8.0)).toPoint()
    end = QPointF(tree.center().x(), scale.at(30.0)).toPoint()
    QTest.mousePress(shown, Qt.MouseButton.LeftButton, pos=start)
    QTest.mouseMove(shown, end)
    assert committed == []
    QTest.mouseRelease(shown, Qt.MouseButton.LeftButton, pos=end)
    assert dragged[-1] == committed[0] == shown.cut() == pytest.approx(0.030, rel=0.03)
    picture = pixels(shown)
    assert distance(picture[end.y() - 1 : end.y() + 2, end.x() + 20], palette.SELECTED).min() < 60


def test_new_groups_change_colours_and_count(shown: AffinityView) -> None:
    assert shown.groups() == 2
    shown.set_clusters(np.array([0, 0, 0, 0, 0, -1]), np.full((6, 3), (200, 30, 30)), 0.07)
    strip = shown.places().strip
    line = pixels(shown)[round(strip.center().y()), round(strip.left()) + 2 : round(strip.right()) - 2]
    assert distance(line, (200, 30, 30)).max() <= 4
    assert shown.groups() == 1
    assert shown.cut() == 0.07


def test_keys_move_the_cut_and_go_from_marker_to_marker(shown: AffinityView) -> None:
    committed: list[float] = []
    chosen: list[list[int]] = []
    shown.cut_committed.connect(committed.append)
    shown.leaves_clicked.connect(lambda markers, _: chosen.append(markers))
    QTest.keyClick(shown, Qt.Key.Key_Up)
    assert committed == pytest.approx([0.00816])
    shown.set_selected([int(ORDER[1])])
    QTest.keyClick(shown, Qt.Key.Key_Right)
    assert chosen == [[int(ORDER[2])]]


def test_a_cell_names_its_pair(shown: AffinityView) -> None:
    found: list[tuple[int, int]] = []
    shown.pair_clicked.connect(lambda i, j: found.append((i, j)))
    QTest.mouseClick(shown, Qt.MouseButton.LeftButton, pos=shown.cell(3, 4).center().toPoint())
    assert found == [(3, 4)]


def test_a_branch_names_all_below_it(shown: AffinityView) -> None:
    found: list[tuple[list[int], object]] = []
    shown.leaves_clicked.connect(lambda markers, keys: found.append((sorted(markers), keys)))
    tree, scale = shown.places().tree, shown.height_scale()
    # the root joins both groups at 60 mm, over the middle of the picture
    QTest.mouseClick(shown, Qt.MouseButton.LeftButton, pos=QPointF(tree.center().x(), scale.at(60.0)).toPoint())
    group = shown.places().strip
    shift = Qt.KeyboardModifier.ShiftModifier
    QTest.mouseClick(shown, Qt.MouseButton.LeftButton, shift, QPointF(group.left() + 5, group.center().y()).toPoint())
    assert found[0][0] == [0, 1, 2, 3, 4]
    first = np.flatnonzero(np.isin(CLUSTERS, CLUSTERS[ORDER[0]])).tolist()
    assert found[1] == (first, shift)


def test_the_menu_asks_for_edits(shown: AffinityView) -> None:
    asked: list[tuple] = []
    shown.edit_requested.connect(lambda *what: asked.append(what))
    menu = shown.menu_for([0, 1])
    actions = {action.text(): action for action in menu.actions()}
    actions["Merge their groups"].trigger()
    actions["Leave out"].trigger()
    assert asked == [("merge", [0, 1], -1), ("leave_out", [0, 1], -1)]
    shown.edit_why_not = lambda kind, markers, target: "there is but one" if (kind, markers) == ("merge", [0]) else ""
    alone = shown.menu_for([0])
    merge = next(a for a in alone.actions() if a.text() == "Merge their groups")
    assert not merge.isEnabled() and "Not now: there is but one." in merge.toolTip()
    assert next(a for a in alone.actions() if a.text() == "Leave out").isEnabled()
    moves = next(a for a in alone.actions() if a.text() == "Move to group").menu()
    assert [a.text() for a in moves.actions()] == ["2: b, d"]
    moves.actions()[0].trigger()
    assert asked[-1] == ("move", [0], 1)


def test_an_empty_view_says_what_to_do(qapp: QApplication) -> None:
    made = AffinityView()
    made.resize(300, 300)
    assert distance(pixels(made), theme.colours().window).max() > 60
    QTest.mouseClick(made, Qt.MouseButton.LeftButton)
    QTest.keyClick(made, Qt.Key.Key_Up)


def test_every_branch_lies_over_its_leaves() -> None:
    rng = np.random.default_rng(0)
    tree = linkage(rng.random((40, 3)), "average")
    order = leaves_list(tree)
    drawn = Dendrogram(tree, order)
    for join in range(39):
        # by scipy's own cut just above the join, the leaves below it are one group
        together = fcluster(tree, drawn.linkage[join, 2] + 1e-12, "distance")
        assert len(set(together[drawn.below(join)].tolist())) == 1
        x0, y0, x1, y1, top = drawn.brackets[join]
        assert x0 < x1
        assert top >= max(y0, y1)
    assert drawn.groups_at(0.0) == 40
    assert drawn.groups_at(drawn.tallest) == 1


def test_runs_of_groups() -> None:
    assert blocks(np.array([0, 0, -1, 1, 0])) == [(0, 0, 2), (1, 3, 4), (0, 4, 5)]


def test_a_pairs_figures_are_in_millimetres(qapp: QApplication) -> None:
    made, time = PairPlot(), np.arange(200) / 100
    values = np.where(time < 1, 0.100, 0.104)
    values[50] = np.nan
    made.resize(400, 160)
    made.set_pair("a", "b", time, values)
    finite = values[np.isfinite(values)] * 1e3
    assert made.sentence() == f"a – b: {finite.mean():.1f} mm, SD {finite.std():.1f} mm"
    sought: list[float] = []
    made.seeked.connect(sought.append)
    x, y = made.scales()
    QTest.mouseClick(made, Qt.MouseButton.LeftButton, pos=QPointF(x.at(1.5), 60).toPoint())
    assert sought == pytest.approx([1.5], abs=0.01)
    column = distance(pixels(made)[:, round(x.at(1.5))], theme.colours().text)
    assert abs(int(column[21:].argmin()) + 21 - y.at(104.0)) <= 2
