"""Where one looks at a scene from: presets, following, and a state for a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from markerscope.widgets.scene.camera import Camera


class Sight(QWidget):
    """A widget with a camera; whoever draws it says what is shown, and hears of every change."""

    camera_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._camera = Camera()
        self._facing = 0.0
        self._follow = False
        self._followed: np.ndarray | None = None

    @property
    def camera(self) -> Camera:
        """Where one looks from."""
        return self._camera

    def set_camera(self, camera: Camera) -> None:
        """Look from there."""
        if camera != self._camera:
            self._camera = camera
            self._changed()
            self.camera_changed.emit()

    def set_facing(self, direction: Sequence[float]) -> None:
        """Where the person faces, (x, y), so that "front" and "left" are the person's; the view stays."""
        self._facing = float(np.arctan2(direction[1], direction[0]))

    def view_from(self, preset: str) -> None:
        """One of :data:`markerscope.widgets.scene.PRESETS`, or "fit" to see everything from where one looks."""
        if preset == "fit":
            self.frame()
        else:
            self.set_camera(self._camera.turned_to(preset, self._facing))

    def frame(self, points: np.ndarray | None = None) -> None:
        """Come as near as shows points (N, 3) m, all that is visible where None."""
        wanted = self._shown_points(selected=False) if points is None else points
        self.set_camera(self._camera.fitted(wanted, self.width() / max(1, self.height())))

    def frame_selected(self) -> None:
        """Come near the selected markers, all of them where none is."""
        self.frame(self._shown_points(selected=True))

    def set_parallel(self, parallel: bool) -> None:
        """Whether things keep their size however far they are."""
        self.set_camera(Camera.of_state(self._camera.state() | {"parallel": parallel}))

    def set_follow(self, follow: bool) -> None:
        """Whether the camera goes along with the point of :meth:`follow_point`."""
        self._follow = follow

    def follow_point(self, point: np.ndarray | None) -> None:
        """Where the followed thing, the pelvis say, is now, (3) m; None or NaN where nobody knows."""
        if point is None or not np.isfinite(point).all():
            return
        before, self._followed = self._followed, np.array(point, dtype=float)
        if self._follow and before is not None:
            self.set_camera(self._camera.moved(self._followed - before))

    def camera_state(self) -> dict[str, Any]:
        """Plain numbers that :meth:`restore_camera` takes."""
        return self._camera.state() | {"follow": self._follow, "facing": self._facing}

    def restore_camera(self, state: Mapping[str, Any]) -> None:
        """Look from where :meth:`camera_state` was taken."""
        self._follow = bool(state.get("follow", False))
        facing = state.get("facing", 0.0)
        self._facing = float(facing) if isinstance(facing, int | float) else 0.0
        self.set_camera(Camera.of_state(state))

    def orbit(self, right: float, up: float) -> None:
        """Turn about the target, rad."""
        self.set_camera(self._camera.orbited(right, up))

    def pan(self, right: float, down: float) -> None:
        """Shift what is seen, px."""
        self.set_camera(self._camera.panned(right, down, self.height()))

    def zoom(self, factor: float, at: tuple[float, float] | None = None) -> None:
        """Nearer by ``factor``, towards a pixel."""
        self.set_camera(self._camera.zoomed(factor, at, (self.width(), self.height())))

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels (N, 2) of this widget where points (N, 3) m are seen, NaN behind the camera."""
        return self._camera.project(points, self.width(), self.height())[0]

    def _changed(self) -> None:
        """What is seen is another."""
        raise NotImplementedError

    def _shown_points(self, selected: bool) -> np.ndarray:
        """(N, 3) m that are shown; of the selected markers alone where asked for and there are any."""
        raise NotImplementedError
