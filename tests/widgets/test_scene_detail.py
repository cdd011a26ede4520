"""What is drawn while things move and when they rest, what stands beside the scene, and what happens if it fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from markerscope.widgets.images import to_rgb
from markerscope.widgets.scene import Scene3D
from markerscope.widgets.video import VideoView
from tests.widgets.drawn import pixels
from tests.widgets.seen import COLOURS, THREE, at, box, picture

MIDDLE, RIM = np.array([240.0, 180.0]), np.array([240.0, 110.0])
"""px: on both boxes, and on the larger one alone."""
SKIN = (220, 160, 120)


@pytest.fixture
def rest(scene: Scene3D, qapp: QApplication) -> Callable[[], None]:
    """Let the scene come to rest without waiting for its timer."""

    def settle() -> None:
        for _ in range(500):
            if scene.settled:
                break
            if scene._rest.isActive():
                scene._rest.setInterval(0)
            qapp.processEvents()
        assert scene.settled

    return settle


def is_skin(drawn: np.ndarray, where: np.ndarray) -> bool:
    """Whether a pixel has the skin's hue, which the ground has not."""
    red, _, blue = at(drawn, where).astype(int)
    return bool(red - blue > 40)


def show(scene: Scene3D) -> np.ndarray:
    """A small box, and a larger one for when there is time; what is on the screen then."""
    scene.set_mesh("body", *box(0.2), SKIN, 1.0, finer=lambda: box(0.6))
    drawn = pixels(scene)
    assert is_skin(drawn, MIDDLE)
    return drawn


def test_skins_are_coarse_while_things_move_and_fine_when_they_rest(scene: Scene3D, rest: Callable[[], None]) -> None:
    scene.patience_ms = 0.0
    for _ in range(2):
        assert not is_skin(show(scene), RIM) and not scene.fine
        rest()
        assert is_skin(pixels(scene), RIM) and scene.fine
    scene.orbit(0.2, 0.0)
    assert is_skin(pixels(scene), RIM), "what rests is not drawn coarse again because one looks from elsewhere"
    scene.set_mesh("body", *box(0.2), SKIN, 1.0)
    assert not is_skin(pixels(scene), RIM), "there is no finer one now"
    rest()
    assert not is_skin(pixels(scene), RIM)


def test_skins_are_fine_at_once_where_that_has_been_quick(scene: Scene3D, rest: Callable[[], None]) -> None:
    scene.patience_ms = 1e9
    show(scene)
    rest()
    assert is_skin(show(scene), RIM)


def test_a_picture_for_a_file_is_always_fine(scene: Scene3D) -> None:
    scene.patience_ms = 0.0
    show(scene)
    assert is_skin(picture(scene), RIM)


def test_hiding_a_skin_hides_both_and_removing_it_forgets_both(scene: Scene3D) -> None:
    empty = picture(scene)
    scene.patience_ms = 0.0
    for hide in (lambda: scene.show_layer("body", False), lambda: scene.remove("body")):
        scene.show_layer("body", True)
        show(scene)
        picture(scene)
        hide()
        assert np.array_equal(picture(scene), empty)


def test_a_portrait_leaves_the_scene_as_it_was(scene: Scene3D) -> None:
    scene.set_markers(THREE, COLOURS)
    scene.set_mesh("body", *box(0.2), SKIN, 1.0)
    before = picture(scene)
    portraits = scene.portraits()
    vertices, faces = box(0.5)
    drawn = [
        to_rgb(portraits.draw(vertices, faces, THREE, np.array([[0, 1]]), THREE, np.array(colour)))
        for colour in ((20, 60, 220), (220, 60, 20), (20, 60, 220))
    ]
    assert np.array_equal(drawn[0], drawn[2]) and not np.array_equal(drawn[0], drawn[1])
    blue = (drawn[0][..., 2].astype(int) - drawn[0][..., 0] > 60).mean()
    assert 0.1 < blue < 0.9, f"the body takes {blue:.0%} of its picture"
    assert np.array_equal(picture(scene), before)


@pytest.mark.parametrize("make", [Scene3D, VideoView])
def test_a_painting_that_fails_becomes_a_message(
    make: type[Scene3D] | type[VideoView], scene: Scene3D, qapp: QApplication, monkeypatch: pytest.MonkeyPatch
) -> None:
    widget = scene if make is Scene3D else VideoView()
    widget.resize(480, 360)
    widget.show()
    well = pixels(widget)
    heard: list[str] = []
    widget.trouble.connect(heard.append)

    def fail(*anything: object) -> None:
        raise RuntimeError("out of memory")

    owner = widget._sheet if isinstance(widget, Scene3D) else widget
    with monkeypatch.context() as broken:
        broken.setattr(owner, "paint" if isinstance(widget, Scene3D) else "_paint", fail)
        for _ in range(3):
            assert not np.array_equal(pixels(widget), well)
            qapp.processEvents()
    assert len(heard) == 1 and heard[0].endswith("cannot be drawn: out of memory")
    assert np.array_equal(pixels(widget), well)
    if widget is not scene:
        widget.close()
        widget.deleteLater()
