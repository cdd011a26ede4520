"""The scene's bar, tools, keys and menu in the real window, on a second of the embedded session."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu, QWidget

from markerscope.app.window.main import MainWindow
from tests.app.window.test_journey import changed, picture
from tests.app.window.test_linked import Solved

_NONE = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def window(solved_window: Solved) -> MainWindow:
    return solved_window()


def send(widget: QWidget, kind: QEvent.Type, at: tuple[float, float], button: Qt.MouseButton) -> None:
    point = QPointF(*at)
    QApplication.sendEvent(widget, QMouseEvent(kind, point, widget.mapToGlobal(point), button, button, _NONE))


def click(widget: QWidget, at: tuple[float, float], button: Qt.MouseButton) -> None:
    send(widget, QEvent.Type.MouseButtonPress, at, button)
    send(widget, QEvent.Type.MouseButtonRelease, at, button)


def menu_of(qapp: QApplication) -> QMenu:
    found = qapp.activePopupWidget()
    assert isinstance(found, QMenu)
    return found


def entry(menu: QMenu, text: str) -> object:
    return next(action for action in menu.actions() if action.text().split("\t")[0] == text)


def test_the_bar_sets_what_the_scene_shows_and_is_remembered(
    window: MainWindow, spin: Callable[..., None], solved_window: Solved
) -> None:
    bar, display = window.scene_bar, window.bench.display
    before = picture(window.scene)
    bar.opacity.setFocus()
    QTest.keyClick(bar.opacity, Qt.Key.Key_Home)
    spin()
    assert display.opacity == 0.0
    assert changed(before, picture(window.scene)) > 0.005, "the body is to be gone"
    bar.trail.setValue(0.8)
    spin()
    assert (display.trail_s, display.layers["trails"]) == (0.8, True)
    assert "0.8" in bar.trail.text()
    bar.colour.setFocus()
    QTest.keyClick(bar.colour, Qt.Key.Key_Down)
    spin()
    bar.colour.activated.emit(bar.colour.findData("residual"))
    assert display.colour_by == "residual"
    bar.actions_of_layers["labels"].trigger()
    assert display.layers["labels"]
    display.show("body", False)
    assert not bar.actions_of_layers["body"].isChecked(), "the bar follows the keys and menus"
    window.remember()
    folder = window.bench.document.folder
    window.leave()
    again = solved_window(folder)
    found = again.bench.display
    assert (found.opacity, found.trail_s, found.colour_by) == (0.0, 0.8, "residual")
    assert found.layers["labels"] and not found.layers["body"]
    assert again.scene_bar.colour.currentData() == "residual" and again.scene_bar.opacity.value() == 0


def test_the_bones_lie_in_the_body_and_can_be_hidden(window: MainWindow, spin: Callable[..., None]) -> None:
    display = window.bench.display
    assert display.layers["bones"], "they are shown at first"
    with_bones = picture(window.scene)
    window.table.trigger("layer.bones")
    spin()
    assert not display.layers["bones"]
    assert changed(with_bones, picture(window.scene)) > 0.005
    display.set(opacity=1.0)
    spin()
    covered = picture(window.scene)
    window.table.trigger("layer.bones")
    spin()
    assert changed(covered, picture(window.scene)) < 0.01, "a body that is not see-through hides them"


def test_every_control_of_the_bar_is_reached_by_keys_and_says_what_it_is(window: MainWindow) -> None:
    bar = window.scene_bar
    for part in (bar.tool, bar.colour, bar.layers, bar.opacity, bar.trail, bar.views, bar.follow):
        assert part.focusPolicy() & Qt.FocusPolicy.TabFocus and part.toolTip() and part.accessibleName()
        right = part.mapTo(window.scene_bar, part.rect().topRight()).x()
        assert right <= bar.width(), f"{part.accessibleName()} is cut off at {window.width()} px"
    assert "Ctrl+1" in bar.actions_of_views["camera.front"].text()


def test_digits_colour_and_with_ctrl_look(window: MainWindow, spin: Callable[..., None]) -> None:
    window.scene.setFocus()
    before = window.scene.camera
    assert window.bench.display.colour_by == "cluster"
    window.table.trigger("colour.bone")
    assert window.bench.display.colour_by == "bone" and window.scene.camera == before
    seen = []
    for name, key in (
        ("front", "Ctrl+1"),
        ("back", "Ctrl+2"),
        ("left", "Ctrl+3"),
        ("right", "Ctrl+4"),
        ("top", "Ctrl+5"),
    ):
        action = window.menus.qt[f"camera.{name}"]
        assert action.shortcut().toString() == key
        action.trigger()
        spin()
        seen.append(picture(window.scene))
        assert name in window.menus.actions.table[f"camera.{name}"].title
    for k, one in enumerate(seen):
        assert all(changed(one, other) > 0.01 for other in seen[:k]), "each is another view"
    said = [keys for keys, _ in window.menus.sheet()["View"]]
    assert {"1", "5", "Ctrl+1", "Ctrl+5", "Q", "O", "Shift+T"} <= {*said}


@pytest.mark.parametrize("action", ["camera.fit", "camera.selected"])
def test_the_camera_frames_what_the_clock_shows_though_it_was_not_drawn_yet(
    window: MainWindow, spin: Callable[..., None], action: str
) -> None:
    clock = window.bench.clock
    clock.seek(clock.timing.span[0])
    spin()
    clock.seek(clock.timing.span[1])
    window.table.trigger(action)
    found = window.scene.camera_state()
    spin()
    window.table.trigger(action)
    again = window.scene.camera_state()
    assert found["target"] == pytest.approx(again["target"], abs=0.01), "but for the mesh that is refined at rest"


def test_a_box_selects_without_shift_in_its_mode(window: MainWindow, spin: Callable[..., None]) -> None:
    scene = window.scene
    window.table.trigger("camera.fit")
    camera = scene.camera
    corners = (2.0, 2.0), (scene.width() - 3.0, scene.height() - 3.0)

    def drag() -> None:
        send(scene, QEvent.Type.MouseButtonPress, corners[0], Qt.MouseButton.LeftButton)
        send(scene, QEvent.Type.MouseMove, (200.0, 150.0), Qt.MouseButton.LeftButton)
        send(scene, QEvent.Type.MouseMove, corners[1], Qt.MouseButton.LeftButton)
        send(scene, QEvent.Type.MouseButtonRelease, corners[1], Qt.MouseButton.LeftButton)
        spin()

    QTest.mouseClick(window.scene_bar.tool, Qt.MouseButton.LeftButton)
    assert window.bench.display.boxing
    drag()
    assert scene.camera == camera, "nothing turns"
    assert len(window.bench.selection.markers) > 20
    window.bench.selection.clear()
    window.table.trigger("tool.select")
    assert not window.scene_bar.tool.isChecked()
    drag()
    assert scene.camera != camera and not window.bench.selection.markers


def test_groups_are_edited_from_the_scenes_menu(
    window: MainWindow, spin: Callable[..., None], qapp: QApplication
) -> None:
    bench, scene = window.bench, window.scene
    groups = bench.board.current["segment"].clusters
    here = window.shown.tracks.seen(window.shown.tracks.nearest(bench.clock.time))
    pixels = scene.project(here)
    marker = next(
        m
        for m in np.flatnonzero(np.isfinite(pixels).all(axis=1))
        if scene.marker_at(tuple(pixels[m])) == m and groups[m] >= 0
    )
    at = tuple(pixels[marker].tolist())
    click(scene, at, Qt.MouseButton.RightButton)
    menu = menu_of(qapp)
    assert bench.selection.markers == {marker}, "what is below the pointer is what is meant"
    assert not entry(menu, "Merge their groups").isEnabled() and not entry(menu, "Put back in").isEnabled()
    entry(menu, "Leave out").trigger()
    menu.close()
    assert bench.board.current["segment"].clusters[marker] == -1
    assert "left out" in (bench.document.history.undo_sentence or "")
    QApplication.sendEvent(scene, QContextMenuEvent(QContextMenuEvent.Reason.Keyboard, QPoint(5, 5), QPoint(5, 5)))
    menu = menu_of(qapp)
    entry(menu, "Put back in").trigger()
    menu.close()
    assert bench.board.current["segment"].clusters[marker] >= 0
    for _ in range(2):
        window.table.trigger("edit.undo")
    assert np.array_equal(bench.board.current["segment"].clusters, groups)

    other = int(np.flatnonzero((groups >= 0) & (groups != groups[marker]))[0])
    bench.selection.select_markers([marker, other])
    menu = window.scene_menu.menu_for([marker, other])
    entry(menu, "Merge their groups").trigger()
    merged = bench.board.current["segment"].clusters
    assert merged[marker] == merged[other]
    menu = window.scene_menu.menu_for([marker])
    moves = entry(menu, "Move to group").menu()
    moves.actions()[0].trigger()
    moved = bench.board.current["segment"].clusters
    assert moved[marker] != merged[marker] or moved[marker] != moved[other]
    assert bench.document.history.position == 2

    send(scene, QEvent.Type.MouseButtonPress, at, Qt.MouseButton.RightButton)
    send(scene, QEvent.Type.MouseMove, (at[0] + 40, at[1]), Qt.MouseButton.RightButton)
    send(scene, QEvent.Type.MouseButtonRelease, (at[0] + 40, at[1]), Qt.MouseButton.RightButton)
    assert qapp.activePopupWidget() is None, "a right drag pans"
