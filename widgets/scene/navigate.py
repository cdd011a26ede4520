"""Mouse and keys in the scene: orbit, pan, zoom, click, and a box about markers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent

if TYPE_CHECKING:
    from markerscope.widgets.scene.view import Scene3D

_CLICK_PX = 4.0  # a press that moves less is a click
_TURN_PER_PX = float(np.radians(0.45))
_STEP = float(np.radians(5))
_PRESET_KEYS = {
    Qt.Key.Key_1: "front", Qt.Key.Key_2: "back", Qt.Key.Key_3: "left", Qt.Key.Key_4: "right", Qt.Key.Key_5: "top",
    Qt.Key.Key_6: "isometric", Qt.Key.Key_0: "fit", Qt.Key.Key_F: "fit",
}  # fmt: skip
_WAYS = {
    Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, 1), Qt.Key.Key_Down: (0, -1),
}  # fmt: skip
HELP = (
    "Drag to orbit, right-drag or Ctrl+drag to pan, wheel to zoom. Click a marker to select it, Shift+drag a box about "
    "several. Keys: Ctrl+1 to Ctrl+6 views, 0 everything, Ctrl+arrows orbit, Ctrl+Shift+arrows pan, + and - zoom."
)


class Navigator:
    """Turns what the user does with mouse and keys into calls of the scene.

    Attributes
    ----------
    tool : "orbit", or "select" where a plain drag draws a box
    band : two corners of the box being drawn, None where there is none
    """

    def __init__(self, scene: Scene3D) -> None:
        self._scene = scene
        self.tool = "orbit"
        self.band: tuple[tuple[float, float], tuple[float, float]] | None = None
        self._pressed: tuple[float, float] | None = None
        self._last = (0.0, 0.0)
        self._act = ""

    def press(self, event: QMouseEvent) -> None:
        """A button goes down."""
        self._pressed = self._last = _at(event)
        held = event.modifiers()
        left = event.button() == Qt.MouseButton.LeftButton
        if not left or held & Qt.KeyboardModifier.ControlModifier:
            self._act = "pan"
        elif held & Qt.KeyboardModifier.ShiftModifier or self.tool == "select":
            self._act = "box"
        else:
            self._act = "orbit"

    def move(self, event: QMouseEvent) -> None:
        """The pointer moves, with or without a button."""
        at = _at(event)
        if self._pressed is None:
            self._scene.hover(at)
            return
        if self._act != "box" and not self._moved(at) and self._last == self._pressed:
            return  # perhaps a click
        dx, dy = at[0] - self._last[0], at[1] - self._last[1]
        self._last = at
        if self._act == "orbit":
            self._scene.orbit(-dx * _TURN_PER_PX, dy * _TURN_PER_PX)
        elif self._act == "pan":
            self._scene.pan(dx, dy)
        elif self._moved(at):
            self.band = (self._pressed, at)
            self._scene.update()

    def release(self, event: QMouseEvent) -> None:
        """A button comes up."""
        at, band, pressed = _at(event), self.band, self._pressed
        clicked = pressed is not None and self._last == pressed if self._act != "box" else band is None
        self.band = self._pressed = None
        if band is not None:
            self._scene.box(band[0], at, event.modifiers())
        elif clicked and pressed is not None and event.button() == Qt.MouseButton.LeftButton:
            self._scene.click(at, event.modifiers())

    def wheel(self, event: QWheelEvent) -> None:
        """The wheel turns: nearer where the pointer is."""
        at = event.position()
        self._scene.zoom(1.0015 ** event.angleDelta().y(), (at.x(), at.y()))

    def key(self, event: QKeyEvent) -> bool:
        """A key; False where it means nothing here."""
        key, held = Qt.Key(event.key()), event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        control, shift = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
        if key in _WAYS and held in (control, control | shift):
            right, up = _WAYS[key]
            if held & shift:
                self._scene.pan(-20 * right, 20 * up)
            else:
                self._scene.orbit(_STEP * right, _STEP * up)
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._scene.zoom(1.15)
        elif key == Qt.Key.Key_Minus:
            self._scene.zoom(1 / 1.15)
        elif key == Qt.Key.Key_Escape and self.band is not None:
            self.band = self._pressed = None
            self._scene.update()
        elif key in _PRESET_KEYS and held in (control, Qt.KeyboardModifier.NoModifier):
            name = _PRESET_KEYS[key]
            if (name == "fit") == (held == control):  # plain digits are the colours', in the window
                return False
            self._scene.view_from(name)
        else:
            return False
        return True

    def _moved(self, at: tuple[float, float]) -> bool:
        return self._pressed is not None and np.hypot(at[0] - self._pressed[0], at[1] - self._pressed[1]) >= _CLICK_PX


def _at(event: QMouseEvent) -> tuple[float, float]:
    return event.position().x(), event.position().y()
