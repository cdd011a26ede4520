"""The 3D scene as a widget: takes arrays, tells what was clicked, and gives pictures of itself."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import numpy as np
from PySide6.QtCore import QEvent, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QImage, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from markerscope.widgets import theme
from markerscope.widgets.guard import PaintGuard
from markerscope.widgets.images import draw_focus, of_rgba, save, to_rgb
from markerscope.widgets.scene.contents import Contents
from markerscope.widgets.scene.navigate import HELP, Navigator
from markerscope.widgets.scene.picking import nearest_point, nearest_segment, points_in_box
from markerscope.widgets.scene.portraits import Portraits

REST_MS = 140
"""How long nothing must change before skins are shown finer and edges are smoothed, where that costs time."""
PATIENCE_MS = 22.0
"""Finer skins are shown while things move if their pictures take no longer than this."""
_REACH_MARKER, _REACH_BONE = 10.0, 7.0  # px from what a click is meant for


class Scene3D(Contents):
    """Markers, bodies, skeletons and lines over a floor.

    Everything is in metres in the lab, z up; colours are 0 to 255. Layers that need no name are "markers", "trails",
    "floor", "labels", "axes" and "legend"; meshes, bones and lines are named by who sets them.

    Signals
    -------
    marker_clicked(int, modifiers), markers_boxed(list of int, modifiers), bone_clicked(layer, int, modifiers),
    background_clicked(modifiers), hovered(int) -1 for none, camera_changed(), trouble(str) why it cannot be drawn

    Attributes
    ----------
    patience_ms : see :data:`PATIENCE_MS`
    """

    marker_clicked = Signal(int, object)
    markers_boxed = Signal(list, object)
    bone_clicked = Signal(str, int, object)
    background_clicked = Signal(object)
    hovered = Signal(int)
    trouble = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("3D scene")
        self.setAccessibleDescription(HELP)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        stage = self._stage
        self._navigator = Navigator(self)
        self._guard = PaintGuard(self, "The 3D scene", self.trouble.emit)
        self._picture: QImage | None = None
        self._dirty = True
        self.patience_ms = PATIENCE_MS
        self._fine_ms: deque[float] = deque(maxlen=7)
        self._smoothing: Iterator[np.ndarray | None] | None = None
        self._rest = QTimer(self, singleShot=True)
        self._rest.timeout.connect(self._smooth)
        self.destroyed.connect(lambda: stage.release())  # no reference to self, which is half gone by then

    # What the mouse does, and what is under the pointer

    def set_tool(self, tool: str) -> None:
        """What a plain drag does: "orbit", or "select" for a box about markers."""
        if tool not in ("orbit", "select"):
            raise ValueError(f"no tool is called {tool}")
        self._navigator.tool = tool
        self.setCursor(Qt.CursorShape.CrossCursor if tool == "select" else Qt.CursorShape.ArrowCursor)

    def marker_at(self, at: tuple[float, float]) -> int:
        """The marker at a pixel, -1 for none."""
        if not self._stage.shows("markers"):
            return -1
        return nearest_point(*self._camera.project(self._stage.markers, self.width(), self.height()), at, _REACH_MARKER)

    def hover(self, at: tuple[float, float]) -> None:
        """The pointer rests there."""
        found = self.marker_at(at)
        if found != self._sheet.hovered:
            self._sheet.hovered = found
            self.hovered.emit(found)
            self.update()

    def click(self, at: tuple[float, float], modifiers: Qt.KeyboardModifier) -> None:
        """The user clicked there."""
        marker = self.marker_at(at)
        if marker >= 0:
            self.marker_clicked.emit(marker, modifiers)
            return
        for layer, (joints, edges) in self._stage.bones().items():
            ends = self.project(joints)[edges]
            bone = nearest_segment(ends[:, 0], ends[:, 1], at, _REACH_BONE)
            if bone >= 0:
                self.bone_clicked.emit(layer, bone, modifiers)
                return
        self.background_clicked.emit(modifiers)

    def box(self, a: tuple[float, float], b: tuple[float, float], modifiers: Qt.KeyboardModifier) -> None:
        """The user drew a box between two pixels."""
        found = points_in_box(self.project(self._stage.markers), a, b) if self._stage.shows("markers") else []
        self.markers_boxed.emit(found, modifiers)
        self.update()

    # Pictures

    @property
    def problem(self) -> str | None:
        """Why nothing is drawn on this machine and what to do; None where all is well."""
        return self._stage.problem

    @property
    def software(self) -> bool:
        """Whether a processor draws, not a graphics card."""
        return self._stage.software

    @property
    def fine(self) -> bool:
        """Whether the skins are seen as fine as there are."""
        return not self._stage.coarse

    @property
    def settled(self) -> bool:
        """Whether what is on the screen is as good as it gets."""
        return self._stage.problem is not None or not (self._dirty or self._rest.isActive())

    def image(self, scale: float = 1.0, size: tuple[int, int] | None = None) -> QImage:
        """What is seen, with smoothed edges, at ``scale`` times the screen's pixels, or for another ``size``."""
        width, height = size or (self.width(), self.height())
        ratio = self.devicePixelRatioF() * scale
        picture = QImage(round(width * ratio), round(height * ratio), QImage.Format.Format_RGB32)
        picture.setDevicePixelRatio(ratio)
        picture.fill(theme.qcolour(theme.colours().scene_bottom))
        painter = QPainter(picture)
        painter.setFont(self.font())
        if self._stage.problem is None:
            self._stage.refine()
            drawn = of_rgba(self._stage.picture(self._camera, (width, height), ratio, smooth=True))
            painter.drawImage(QRectF(0, 0, width, height), drawn)
            self._dirty = True  # the canvas holds another size or shift now
        self._sheet.paint(painter, self._stage, self._camera, (width, height))
        painter.end()
        self.update()
        return picture

    def save_png(self, path: str | Path, scale: float = 1.0) -> None:
        """Write :meth:`image` to a file, whole or not at all; OSError where that cannot be done."""
        save(self.image(scale), path)

    def portraits(self) -> Portraits:
        """What draws small pictures of other bodies, in this scene's canvas."""
        return Portraits(self._stage)

    def turntable(self, count: int, size: tuple[int, int] | None = None) -> Iterator[np.ndarray]:
        """``count`` pictures (H, W, 3) uint8 once about the target; the camera then is where it was."""
        before = self._camera
        try:
            for k in range(count):
                self._camera = before.orbited(2 * np.pi * k / count, 0.0)
                yield to_rgb(self.image(size=size))
        finally:
            self._camera = before
            self._changed()

    # Qt

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the scene where it changed, and what stands over it."""
        self._guard.paint(self._paint)

    def _paint(self, painter: QPainter) -> None:
        if self._stage.problem is None:
            if self._dirty or self._picture is None:
                self._quick()
            assert self._picture is not None
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(QRectF(self.rect()), self._picture)  # however fine its pixels are
        else:
            painter.fillRect(self.rect(), theme.qcolour(theme.colours().scene_bottom))
        self._sheet.paint(painter, self._stage, self._camera, (self.width(), self.height()), self._navigator.band)
        if self.hasFocus():
            draw_focus(painter, self.rect())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Another size needs another picture."""
        self._changed()

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._stage.set_look(theme.colours())
            self._changed()
        super().changeEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A button goes down."""
        self._navigator.press(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """The pointer moves."""
        self._navigator.move(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """A button comes up."""
        self._navigator.release(event)

    def leaveEvent(self, event: QEvent) -> None:
        """The pointer is over nothing any more."""
        self.hover((-1e6, -1e6))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Nearer or farther."""
        self._navigator.wheel(event)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys of :data:`markerscope.widgets.scene.navigate.HELP`; others go on to the window."""
        if not self._navigator.key(event):
            super().keyPressEvent(event)

    def _shown_points(self, selected: bool) -> np.ndarray:
        chosen = [i for i in self._sheet.selected if i < len(self._stage.markers)]
        return self._stage.markers[chosen] if selected and chosen else self._stage.points()

    def _changed(self) -> None:
        self._dirty = True
        self.update()

    def _quick(self) -> None:
        """A picture at once; a processor that draws gets the screen's fine pixels only when all is at rest."""
        self._dirty, self._smoothing = False, None
        began = time.perf_counter()
        if not self._stage.software or self._is_quick():
            self._stage.refine()
        ratio = 1.0 if self._stage.software else self.devicePixelRatioF()
        drawn = self._stage.picture(self._camera, (self.width(), self.height()), ratio, smooth=False)
        self._picture = of_rgba(drawn)
        self._note(began)
        if self._stage.software:
            self._rest.start(REST_MS)

    def _smooth(self) -> None:
        """One step towards a fine and smooth picture; then the next, unless something changed meanwhile."""
        if self._dirty or self._stage.problem is not None:
            return
        if self._stage.coarse:
            self._stage.refine()
            self._changed()
            return
        if self._smoothing is None:
            size = (self.width(), self.height())
            self._smoothing = self._stage.smoothing(self._camera, size, self.devicePixelRatioF())
        began = time.perf_counter()
        drawn = next(self._smoothing, None)
        self._note(began)
        if drawn is None:
            self._rest.start(0)
            return
        self._smoothing, self._picture = None, of_rgba(drawn)
        self.update()

    def _is_quick(self) -> bool:
        """Whether the finer skins have been drawn quickly enough of late to be shown while things move."""
        return len(self._fine_ms) > 3 and median(self._fine_ms) <= self.patience_ms

    def _note(self, began: float) -> None:
        """Remember how long a picture with finer skins took."""
        if self._stage.fine:
            self._fine_ms.append(1000 * (time.perf_counter() - began))
