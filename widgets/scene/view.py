"""The 3D scene as a widget: takes arrays, tells what was clicked, and gives pictures of itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import QImage, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from widgets import theme
from widgets.images import draw_focus, of_rgba, save, to_rgb
from widgets.scene.legend import ColourBar, Legend, Rgb
from widgets.scene.navigate import HELP, Navigator
from widgets.scene.picking import nearest_point, nearest_segment, points_in_box
from widgets.scene.sheet import Sheet
from widgets.scene.sight import Sight
from widgets.scene.stage import Stage

REST_MS = 140
"""How long nothing must change before edges are smoothed, where that costs time."""
_REACH_MARKER, _REACH_BONE = 10.0, 7.0  # px from what a click is meant for


class Scene3D(Sight):
    """Markers, bodies, skeletons and lines over a floor.

    Everything is in metres in the lab, z up; colours are 0 to 255. Layers that need no name are "markers", "trails",
    "floor", "labels", "axes" and "legend"; meshes, bones and lines are named by who sets them.

    Signals
    -------
    marker_clicked(int, modifiers), markers_boxed(list of int, modifiers), bone_clicked(layer, int, modifiers),
    background_clicked(modifiers), hovered(int) -1 for none, camera_changed()
    """

    marker_clicked = Signal(int, object)
    markers_boxed = Signal(list, object)
    bone_clicked = Signal(str, int, object)
    background_clicked = Signal(object)
    hovered = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setMinimumSize(160, 120)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("3D scene")
        self.setAccessibleDescription(HELP)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._stage = stage = Stage(theme.colours())
        self._sheet = Sheet()
        self._navigator = Navigator(self)
        self._picture: QImage | None = None
        self._dirty = True
        self._smoothing: Iterator[np.ndarray | None] | None = None
        self._rest = QTimer(self, singleShot=True)
        self._rest.timeout.connect(self._smooth)
        self.destroyed.connect(lambda: stage.release())  # no reference to self, which is half gone by then

    # What is shown

    def set_markers(self, positions: np.ndarray, colours: np.ndarray, sizes: np.ndarray | None = None) -> None:
        """Markers at (M, 3) m, NaN hidden, in colours (M, 3) uint8 (or one for all), ``sizes`` (M) times the usual."""
        self._stage.set_markers(positions, colours, sizes)
        if self._sheet.hovered >= len(self._stage.markers):
            self._sheet.hovered = -1
        self._changed()

    def set_marker_labels(self, labels: Sequence[str] | None) -> None:
        """A name for each marker; None for none."""
        self._sheet.labels = list(labels or [])
        self.update()

    def set_selected(self, indices: Iterable[int]) -> None:
        """The markers with a ring about them."""
        self._sheet.selected = sorted({int(i) for i in indices})
        self.update()

    def set_trails(self, points: np.ndarray | None) -> None:
        """Where the markers were, (k, M, 3) m, oldest first; None for no trails. Set the markers first."""
        self._stage.set_trails(points)
        self._changed()

    def set_mesh(
        self,
        layer: str,
        vertices: np.ndarray | None,
        faces: np.ndarray,
        colour: np.ndarray | Rgb | None = None,
        opacity: float = 1.0,
    ) -> None:
        """A skin of vertices (V, 3) m, None for none, and faces (F, 3).

        ``colour`` is one (3), one a vertex (V, 3) uint8, or None for the theme's body colour.
        """
        wanted = np.asarray(theme.colours().body if colour is None else colour)
        self._stage.set_mesh(layer, vertices, np.asarray(faces), wanted, opacity)
        self._changed()

    def set_bones(
        self, layer: str, points: np.ndarray | None, edges: np.ndarray, colour: np.ndarray | Rgb | None = None
    ) -> None:
        """A skeleton of joints (J, 3) m, None for none, and edges (B, 2) from the nearer to the farther joint.

        ``colour`` is one (3), one a bone (B, 3) uint8, or None for the theme's bone colour.
        """
        wanted = np.asarray(theme.colours().bone if colour is None else colour)
        self._stage.set_bones(layer, points, np.asarray(edges), wanted)
        self._changed()

    def set_lines(
        self, layer: str, a: np.ndarray | None, b: np.ndarray | None, colours: np.ndarray | Rgb = (128, 128, 128)
    ) -> None:
        """Pieces from (N, 3) to (N, 3) m, NaN left out, None for none; one colour (3) or one a piece (N, 3) uint8."""
        self._stage.set_lines(layer, a, b, np.asarray(colours))
        self._changed()

    def set_floor(self, z: float | None) -> None:
        """The floor's height, m, None for no floor. It holds what is shown now, and grows with the markers."""
        self._stage.set_floor(z)
        self._changed()

    def show_layer(self, layer: str, shown: bool) -> None:
        """Hide a layer, or show it again."""
        self._stage.show(layer, shown)
        self._changed()

    def remove(self, layer: str) -> None:
        """Take a mesh, bones or lines out for good."""
        self._stage.remove(layer)
        self._changed()

    def set_legend(self, title: str, entries: Sequence[tuple[str, Rgb]] | ColourBar | None) -> None:
        """What the colours mean: kinds with their colour, or a scale; None for no legend."""
        self._sheet.legend = None if entries is None else Legend(title, entries)
        self.update()

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
        painter = QPainter(self)
        if self._stage.problem is None:
            if self._dirty or self._picture is None:
                self._quick()
            assert self._picture is not None
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            if self._picture.size() == self.size() * self.devicePixelRatioF():
                painter.drawImage(QPointF(0, 0), self._picture)
            else:
                painter.drawImage(QRectF(self.rect()), self._picture)
        else:
            painter.fillRect(self.rect(), theme.qcolour(theme.colours().scene_bottom))
        self._sheet.paint(painter, self._stage, self._camera, (self.width(), self.height()), self._navigator.band)
        if self.hasFocus():
            draw_focus(painter, self.rect())
        painter.end()

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
        """Keys of :data:`widgets.scene.navigate.HELP`; others go on to the window."""
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
        ratio = 1.0 if self._stage.software else self.devicePixelRatioF()
        drawn = self._stage.picture(self._camera, (self.width(), self.height()), ratio, smooth=False)
        self._picture = of_rgba(drawn)
        if self._stage.software:
            self._rest.start(REST_MS)

    def _smooth(self) -> None:
        """One step towards a smooth picture; then the next, unless something changed meanwhile."""
        if self._dirty or self._stage.problem is not None:
            return
        if self._smoothing is None:
            size = (self.width(), self.height())
            self._smoothing = self._stage.smoothing(self._camera, size, self.devicePixelRatioF())
        drawn = next(self._smoothing, None)
        if drawn is None:
            self._rest.start(0)
            return
        self._smoothing, self._picture = None, of_rgba(drawn)
        self.update()
