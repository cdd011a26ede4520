"""The scene as drawn: pixels, not promises."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from markerscope.widgets import palette, theme
from markerscope.widgets.scene import ColourBar, Scene3D
from tests.widgets.seen import BLUE, COLOURS, GREEN, RED, THREE, at, box, picture


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("preset", ["isometric", "front", "top"])
def test_a_marker_is_drawn_where_it_projects_in_its_colour(scene: Scene3D, preset: str, parallel: bool) -> None:
    scene.view_from(preset)
    scene.set_parallel(parallel)
    empty = picture(scene)
    for i in range(3):
        scene.set_markers(THREE[i : i + 1], COLOURS[i : i + 1])
        drawn = picture(scene)
        pixel = scene.project(THREE[i : i + 1])[0]
        assert np.abs(at(drawn, pixel) - COLOURS[i]).max() <= 12, f"{at(drawn, pixel)} where {COLOURS[i]} was asked for"
        y, x = np.nonzero(np.abs(drawn - empty).sum(axis=2) > 30)
        middle = np.array([x.mean(), y.mean()]) + 0.5
        assert np.linalg.norm(middle - pixel) < 0.6, f"drawn about {middle}, projected to {pixel}"
        assert 40 < len(x) < 200, f"{len(x)} pixels: a ball of 4 px radius or a little more has some 50 to 80"


def test_markers_that_are_lost_are_not_drawn_nor_picked(scene: Scene3D) -> None:
    empty = picture(scene)
    lost = np.array([[np.nan, 0, 0], [0.0, 0, 0]])
    scene.set_markers(lost, COLOURS[:2])
    assert np.abs(at(picture(scene), scene.project(lost)[1]) - GREEN).max() <= 12
    assert scene.marker_at((240, 180)) == 1
    scene.set_markers(lost[:1], COLOURS[:1])
    assert np.array_equal(picture(scene), empty)
    scene.set_markers(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8))
    assert np.array_equal(picture(scene), empty)
    assert scene.marker_at((240, 180)) == -1


def test_sizes_are_times_the_usual(scene: Scene3D) -> None:
    empty, covered = picture(scene), []
    for size in (1.0, 3.0):
        scene.set_markers(THREE[:1], COLOURS[:1], np.array([size]))
        covered.append(int((np.abs(picture(scene) - empty).sum(axis=2) > 30).sum()))
    assert 7.0 < covered[1] / covered[0] < 11.5, covered


def test_a_solid_body_hides_and_a_ghost_lets_through(scene: Scene3D) -> None:
    scene.set_markers(THREE[:1], COLOURS[:1])
    middle = scene.project(THREE[:1])[0]
    shown = at(picture(scene), middle)
    vertices, faces = box()
    scene.set_mesh("body", vertices, faces, (200, 200, 200), 1.0)
    solid = at(picture(scene), middle)
    assert solid.max() - solid.min() < 12, f"grey, not {solid}"
    scene.set_mesh("body", vertices, faces, (200, 200, 200), 0.4)
    through = at(picture(scene), middle)
    share = (through - shown) / (solid - shown)
    assert np.all((share > 0.3) & (share < 0.6)), f"{share} of the skin over the marker, 0.4 and a little asked for"
    plain = picture(scene)
    assert scene.marker_at(tuple(middle)) == 0, "a marker that shines through can be picked"
    scene.set_mesh("body", vertices, faces, (200, 200, 200), 0.0)
    assert np.abs(at(picture(scene), middle) - shown).max() < 1
    scene.set_mesh("body", vertices, faces, (200, 200, 200), 0.4)
    assert np.abs(picture(scene) - plain).max() <= 1


def test_a_see_through_skin_shows_no_fold_behind(scene: Scene3D) -> None:
    """Two parts of one skin, one behind the other, look as the front one alone."""
    vertices, faces = box(0.25)
    away = scene.camera.basis()[2] * 0.8
    both = np.concatenate([vertices - away, vertices]), np.concatenate([faces, faces + 8])
    scene.set_mesh("body", vertices, faces, (200, 160, 120), 0.5)
    middle = np.array([240.0, 180.0])
    alone = at(picture(scene), middle)
    for order in (slice(None), slice(None, None, -1)):
        scene.set_mesh("body", both[0], both[1][order].copy(), (200, 160, 120), 0.5)
        assert np.abs(at(picture(scene), middle) - alone).max() <= 1


def test_ghosts_tint_what_is_behind_whoever_came_first(scene: Scene3D) -> None:
    vertices, faces = box(0.2)
    toward = scene.camera.basis()[2] * 0.7
    pictures = []
    for names in (("a ghost", "body"), ("body", "ghost")):
        for name in names:
            if "ghost" in name:
                scene.set_mesh(name, vertices + toward, faces, BLUE, 0.3)
            else:
                scene.set_mesh(name, vertices, faces, (220, 180, 150), 1.0)
        pictures.append(picture(scene))
        for name in names:
            scene.remove(name)
    assert np.abs(pictures[0] - pictures[1]).max() <= 1
    scene.set_mesh("body", vertices, faces, (220, 180, 150), 1.0)
    middle = np.array([240.0, 180.0])
    difference = at(pictures[0], middle) - at(picture(scene), middle)
    assert difference[0] < -20 and difference[2] > difference[0] + 20, f"bluer, not {difference}"


def test_bones_lines_and_trails_are_drawn_and_bones_are_picked(scene: Scene3D, mouse: Callable[..., None]) -> None:
    empty = picture(scene)
    joints = np.array([[0.0, -0.4, 0.2], [0.0, 0.4, 0.2], [0.0, 0.4, -0.4], [np.nan, 0, 0]])
    edges = np.array([[0, 1], [1, 2], [2, 3]])
    scene.set_bones("skeleton", joints, edges, np.array([RED, GREEN, BLUE], dtype=np.uint8))
    drawn = picture(scene)
    for k, colour in ((0, RED), (1, GREEN)):
        a, b = scene.project(joints[edges[k]])
        got = at(drawn, a + 0.25 * (b - a))
        assert np.argmax(got) == np.argmax(colour) and np.abs(got - at(empty, a + 0.25 * (b - a))).max() > 60
    heard = []
    scene.bone_clicked.connect(lambda layer, bone, held: heard.append((layer, bone)))
    place = scene.project(joints[[1, 2]]).mean(axis=0)
    mouse(scene, "press", place)
    mouse(scene, "release", place)
    assert heard == [("skeleton", 1)]
    scene.remove("skeleton")
    assert np.array_equal(picture(scene), empty)
    a, b = joints[:2], joints[1:3]
    scene.set_lines("skin", a, b, np.array([RED, BLUE], dtype=np.uint8))
    drawn = picture(scene)
    for k, colour in ((0, RED), (1, BLUE)):
        x, y = scene.project(np.stack([a[k], b[k]])).mean(axis=0).round().astype(int)
        near = np.abs(drawn[y - 2 : y + 3, x - 2 : x + 3] - colour).max(axis=2).min()
        assert near < 60, f"no pixel is nearer to {colour} than {near}"
    scene.set_lines("skin", None, None)
    assert np.array_equal(picture(scene), empty)
    scene.set_markers(THREE, COLOURS)
    markers = picture(scene)
    trail = THREE + np.linspace(-0.4, 0, 12)[:, None, None] * [0, 1, 0]
    trail[3:5, 1] = np.nan
    scene.set_trails(trail)
    changed = np.abs(picture(scene) - markers).max(axis=2) > 25
    x, y = scene.project(trail[6:7, 0])[0].round().astype(int)
    assert changed[y - 2 : y + 3, x - 2 : x + 3].any()
    gap = np.array([[0.0, 0.4 - 0.4 * 7.5 / 11, 0.3]])  # between the 4th and the 5th of 12
    x, y = scene.project(gap)[0].round().astype(int)
    assert not changed[y - 1 : y + 2, x - 1 : x + 2].any(), "no line where the marker was lost"
    scene.set_trails(None)
    assert np.array_equal(picture(scene), markers)


def test_hidden_layers_are_gone_and_come_back_as_they_were(scene: Scene3D) -> None:
    vertices, faces = box(0.2)
    empty = picture(scene)
    scene.set_markers(THREE, COLOURS)
    scene.set_marker_labels(["A", "B", "C"])
    scene.set_mesh("body", vertices, faces, (200, 180, 170), 0.5)
    scene.set_bones("skeleton", THREE, np.array([[0, 1], [1, 2]]))
    scene.set_floor(-0.4)
    scene.set_legend("Cluster", [("one", RED), ("two", GREEN)])
    full, layers = picture(scene), ("markers", "labels", "body", "skeleton", "floor", "legend")
    for layer in layers:
        scene.show_layer(layer, False)
        assert np.abs(picture(scene) - full).max() > 40, f"without {layer} nothing changes"
        scene.show_layer(layer, True)
        assert np.array_equal(picture(scene), full), layer
    for layer in layers:
        scene.show_layer(layer, False)
    assert np.array_equal(picture(scene), empty)
    scene.show_layer("later", False)
    scene.set_mesh("later", vertices, faces, (0, 0, 0), 1.0)
    assert np.array_equal(picture(scene), empty), "hidden before it came"


def test_labels_and_rings_stand_by_their_marker_and_never_on_each_other(scene: Scene3D) -> None:
    crowd = np.array([[0.0, 0.02 * k, 0.0] for k in range(8)])
    scene.set_markers(crowd, np.zeros((8, 3), dtype=np.uint8))
    plain = picture(scene)
    scene.set_selected([0])
    ring = np.abs(picture(scene) - np.array(palette.SELECTED)).max(axis=2) < 40
    y, x = np.nonzero(ring)
    middle = scene.project(crowd[:1])[0]
    assert len(x) > 20 and np.abs([x.mean() + 0.5 - middle[0], y.mean() + 0.5 - middle[1]]).max() < 0.6
    scene.set_selected([])
    scene.set_marker_labels([f"M{k}" for k in range(8)])
    changed = np.abs(picture(scene) - plain).max(axis=2) > 60
    assert changed.sum() > 100
    low, high = scene.project(crowd).min(axis=0) - 70, scene.project(crowd).max(axis=0) + 70
    outside = changed.copy()
    outside[int(low[1]) : int(high[1]), int(low[0]) : int(high[0])] = False
    assert not outside.any()


def test_a_legend_tells_its_colours_and_stays_in_the_picture(scene: Scene3D) -> None:
    empty = picture(scene)
    scene.set_legend(
        "Cluster",
        [(f"a rather long name of cluster {k}", tuple(int(c) for c in palette.categorical(60)[k])) for k in range(60)],
    )
    drawn = picture(scene)
    changed = np.abs(drawn - empty).max(axis=2) > 8
    assert not changed[:, :8].any() and not changed[-8:].any() and not changed[:, -8:].any(), "cut off"
    assert (np.abs(drawn - RED).max(axis=2) < 4).any() and (np.abs(drawn - BLUE).max(axis=2) < 4).any()
    scene.set_legend("Residual", ColourBar(0.0, 30.0, "mm", "cividis"))
    drawn = picture(scene)
    table = palette.scale_table("cividis")
    for share in (10, 128, 245):
        assert (np.abs(drawn - table[share].astype(int)).max(axis=2) < 8).any()
    scene.set_legend("", None)
    assert np.array_equal(picture(scene), empty)
    assert [text for _, text in ColourBar(0, 1.5, "mm").ticks()] == ["0.00", "0.75", "1.50"]
    assert [text for _, text in ColourBar(-30, 30, "mm").ticks()] == ["-30", "0", "30"]


def test_the_theme_is_followed(scene: Scene3D, qapp: QApplication) -> None:
    scene.set_floor(-0.3)
    try:
        for name in ("dark", "light"):
            look = theme.apply(qapp, name)
            qapp.processEvents()
            got = picture(scene)[-3, 5]
            assert np.abs(got - look.scene_bottom).max() < 25, f"{name}: {got}"
    finally:
        theme.apply(qapp, "light")


def test_a_floor_grows_with_the_markers_and_counts_metres(scene: Scene3D) -> None:
    scene.set_markers(THREE, COLOURS)
    scene.set_floor(0.0)
    stage = scene._stage
    assert stage.floor is not None and stage.floor.low == (-2, -2) and stage.floor.high == (2, 2)
    scene.set_markers(THREE + np.array([2.2, 0, 0]), COLOURS)
    assert stage.floor.low == (-2, -2) and stage.floor.high == (3, 2)
    places, texts = stage.floor.ticks(scene.camera, 480, 360)
    for (x, y, z), text in zip(places, texts):
        number = float(text.replace("\u2212", "-").replace(" m", "").split("= ")[-1])
        assert z == 0 and min(abs(number - x), abs(number - y)) < 1e-9
    assert any("x = " in text for text in texts) and any("y = " in text for text in texts)
