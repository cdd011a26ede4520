"""Scenes and events for the tests of the widgets."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QWidget

from markerscope.widgets.scene import Scene3D

NO_KEY = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def scene(qapp: QApplication) -> Iterator[Scene3D]:
    """An empty scene of 480 x 360 px without axes, looking at the origin from a known place."""
    widget = Scene3D()
    if widget.problem:
        pytest.skip(widget.problem)
    widget.resize(480, 360)
    widget.show()
    widget.show_layer("axes", False)
    widget.restore_camera({"target": [0, 0, 0], "azimuth": 0.3, "elevation": 0.25, "distance": 3.0, "view_angle": 0.5})
    qapp.processEvents()
    yield widget
    widget.close()
    widget.deleteLater()
    qapp.processEvents()


@pytest.fixture(scope="session")
def mouse() -> Callable[..., None]:
    """``mouse(widget, "press" | "move" | "release" | "double", (x, y), button, modifiers)`` as Qt would send it."""
    kinds = {
        "press": QEvent.Type.MouseButtonPress, "move": QEvent.Type.MouseMove,
        "release": QEvent.Type.MouseButtonRelease, "double": QEvent.Type.MouseButtonDblClick,
    }  # fmt: skip

    def send(
        widget: QWidget,
        kind: str,
        at: tuple[float, float] | np.ndarray,
        button: Qt.MouseButton = Qt.MouseButton.LeftButton,
        held: Qt.KeyboardModifier = NO_KEY,
    ) -> None:
        point = QPointF(float(at[0]), float(at[1]))
        event = QMouseEvent(kinds[kind], point, widget.mapToGlobal(point), button, button, held)
        QApplication.sendEvent(widget, event)

    return send


@pytest.fixture(scope="session")
def wheel() -> Callable[..., None]:
    """``wheel(widget, (x, y), angle)`` as Qt would send it; 120 is one click of the wheel."""

    def send(widget: QWidget, at: tuple[float, float], angle: int) -> None:
        point = QPointF(*at)
        event = QWheelEvent(
            point, widget.mapToGlobal(point), point.toPoint(), point.toPoint() * 0 + QPointF(0, angle).toPoint(),
            Qt.MouseButton.NoButton, NO_KEY, Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(widget, event)

    return send
