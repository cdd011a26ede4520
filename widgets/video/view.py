"""The video's picture, with what was seen in it and what is projected into it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from markerscope.widgets import palette, theme
from markerscope.widgets.guard import PaintGuard
from markerscope.widgets.images import draw_focus, of_rgb, save
from markerscope.widgets.video.outline import Outline
from markerscope.widgets.video.paint import draw_landmarks, draw_lines, draw_markers, draw_text, stroke
from markerscope.widgets.video.zoom import Zoom

LAYERS = ("picture", "landmarks", "markers", "body", "skeleton")
_REACH = 10.0  # px of the screen
_CLICK_PX = 4.0
HELP = (
    "Wheel zooms where the pointer is, drag pans, double click or 0 fits, 1 shows a pixel of the video as one of the "
    "screen, + and - zoom, Ctrl+arrows pan. Click a marker to select it."
)


class VideoView(QWidget):
    """One frame of a video. Places are pixels of the frame, from the upper left corner of its first pixel.

    Signals
    -------
    marker_clicked(int, modifiers), background_clicked(modifiers), zoom_changed(), trouble(str) why it cannot be drawn
    """

    marker_clicked = Signal(int, object)
    background_clicked = Signal(object)
    zoom_changed = Signal()
    trouble = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(160, 90)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Video")
        self.setAccessibleDescription(HELP)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._guard = PaintGuard(self, "The video", self.trouble.emit)
        self._picture: QImage | None = None
        self._text = ""
        self._empty = "No video"
        self._zoom = Zoom()
        self._hidden: set[str] = set()
        self._landmarks, self._links = np.zeros((0, 2)), np.zeros((0, 2), dtype=int)
        self._visibility = np.zeros(0)
        self._markers, self._colours = np.zeros((0, 2)), np.zeros((0, 3), dtype=np.uint8)
        self._selected: list[int] = []
        self._outline: tuple[np.ndarray, Outline] | None = None
        self._body, self._body_colour = np.zeros((0, 2, 2)), (86, 180, 233)
        self._bones, self._bone_colour = np.zeros((0, 2, 2)), (255, 255, 255)
        self._pressed: QPointF | None = None
        self._last = QPointF()
        self._dragged = False

    # What is shown

    def set_frame(self, rgb: np.ndarray | None, text: str = "") -> None:
        """The picture (H, W, 3) uint8 and words for its corner; None for no picture, ``text`` then says why."""
        size = None if rgb is None else (rgb.shape[1], rgb.shape[0])
        self._picture = None if rgb is None else of_rgb(rgb)
        self._text, self._empty = (text, "") if rgb is not None else ("", text or "No video")
        if size is not None and self._zoom.picture != size:
            self._zoom = Zoom(size, (self.width(), self.height()))
            self.zoom_changed.emit()
        self.update()

    def set_landmarks(
        self, pixels: np.ndarray | None, edges: np.ndarray | None = None, visibility: np.ndarray | None = None
    ) -> None:
        """What the network saw: (L, 2) px, NaN for nothing, links (E, 2), and how sure it is (L), 0 to 1."""
        self._landmarks = np.zeros((0, 2)) if pixels is None else np.asarray(pixels, dtype=float)
        self._links = np.zeros((0, 2), dtype=int) if edges is None or pixels is None else np.asarray(edges, dtype=int)
        sure = np.ones(len(self._landmarks)) if visibility is None else np.asarray(visibility, dtype=float)
        self._visibility = np.clip(np.nan_to_num(sure), 0.0, 1.0)
        self.update()

    def set_markers(self, pixels: np.ndarray | None, colours: np.ndarray | None = None) -> None:
        """Markers where the camera would see them, (M, 2) px, NaN hidden, colours (M, 3) uint8 or one for all."""
        self._markers = np.zeros((0, 2)) if pixels is None else np.asarray(pixels, dtype=float)
        wanted = np.asarray(palette.LOST if colours is None or pixels is None else colours, dtype=np.uint8)
        self._colours = np.broadcast_to(wanted, (len(self._markers), 3))
        self.update()

    def set_body(
        self, pixels: np.ndarray | None, faces: np.ndarray, colour: tuple[int, int, int] = (86, 180, 233)
    ) -> None:
        """The body's outline from its vertices (V, 2) px, None for none, and faces (F, 3); a coarse mesh is enough."""
        self._body_colour = colour
        if pixels is None:
            self._body = np.zeros((0, 2, 2))
        else:
            if self._outline is None or not np.array_equal(self._outline[0], faces):
                self._outline = (np.array(faces), Outline(faces))
            self._body = self._outline[1].segments(np.asarray(pixels, dtype=float))
        self.update()

    def set_skeleton(
        self, pixels: np.ndarray | None, edges: np.ndarray, colour: tuple[int, int, int] = (255, 255, 255)
    ) -> None:
        """The body's bones: joints (J, 2) px, None for none, and edges (B, 2)."""
        self._bone_colour = colour
        self._bones = np.zeros((0, 2, 2)) if pixels is None else np.asarray(pixels, dtype=float)[np.asarray(edges)]
        self.update()

    def set_selected(self, indices: Iterable[int]) -> None:
        """The markers with a ring about them."""
        self._selected = sorted({int(i) for i in indices})
        self.update()

    def show_layer(self, layer: str, shown: bool) -> None:
        """Hide one of :data:`LAYERS`, or show it again."""
        if layer not in LAYERS:
            raise ValueError(f"the video has no layer called {layer}")
        (self._hidden.discard if shown else self._hidden.add)(layer)
        self.update()

    # Zoom

    def fit(self) -> None:
        """Show the whole picture."""
        self._set_zoom(self._zoom.fitted())

    def zoom(self, factor: float, at: QPointF | None = None) -> None:
        """Nearer by ``factor`` where ``at`` is, the middle where None."""
        point = (0.5 * self.width(), 0.5 * self.height()) if at is None else (at.x(), at.y())
        self._set_zoom(self._zoom.nearer(factor, point))

    def state(self) -> dict[str, Any]:
        """Plain numbers that :meth:`restore` takes."""
        return self._zoom.state()

    def restore(self, state: Mapping[str, Any]) -> None:
        """Zoom as it was at :meth:`state`."""
        self._set_zoom(self._zoom.of_state(state))

    def to_widget(self, pixels: np.ndarray) -> np.ndarray:
        """Where pixels (N, 2) of the frame are in this widget."""
        return self._zoom.to_widget(pixels)

    def to_frame(self, points: np.ndarray) -> np.ndarray:
        """Which pixels (N, 2) of the frame are at points of this widget."""
        return self._zoom.to_frame(points)

    def image(self, scale: float = 1.0) -> QImage:
        """What is seen, at ``scale`` times the screen's pixels."""
        ratio = self.devicePixelRatioF() * scale
        picture = QImage(round(self.width() * ratio), round(self.height() * ratio), QImage.Format.Format_RGB32)
        picture.setDevicePixelRatio(ratio)
        painter = QPainter(picture)
        painter.setFont(self.font())
        self._paint(painter)
        painter.end()
        return picture

    def save_png(self, path: str | Path, scale: float = 1.0) -> None:
        """Write :meth:`image` to a file, whole or not at all; OSError where that cannot be done."""
        save(self.image(scale), path)

    # Qt

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw it all."""
        self._guard.paint(self._paint_all)

    def _paint_all(self, painter: QPainter) -> None:
        self._paint(painter)
        if self.hasFocus():
            draw_focus(painter, self.rect())

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the middle of what is seen; a picture that was fitted stays so."""
        self._set_zoom(self._zoom.resized((self.width(), self.height())))

    def changeEvent(self, event: QEvent) -> None:
        """Follow the theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self.update()
        super().changeEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Nearer or farther."""
        self.zoom(1.0015 ** event.angleDelta().y(), event.position())
        event.accept()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """A button goes down."""
        self._pressed, self._last, self._dragged = event.position(), event.position(), False

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Pan."""
        if self._pressed is None:
            return
        moved = event.position() - self._pressed
        if self._dragged or np.hypot(moved.x(), moved.y()) >= _CLICK_PX:
            self._dragged = True
            by = event.position() - self._last
            self._last = event.position()
            self._set_zoom(self._zoom.panned(by.x(), by.y()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """A click that did not move chooses a marker."""
        pressed, self._pressed = self._pressed, None
        if pressed is None or self._dragged or event.button() != Qt.MouseButton.LeftButton:
            return
        away = np.linalg.norm(self.to_widget(self._markers) - [pressed.x(), pressed.y()], axis=1)
        away[np.isnan(away)] = np.inf
        if len(away) and away.min() <= _REACH and "markers" not in self._hidden:
            self.marker_clicked.emit(int(np.argmin(away)), event.modifiers())
        else:
            self.background_clicked.emit(event.modifiers())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Fit."""
        self.fit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Keys of :data:`HELP`; others go on to the window."""
        ways = {
            Qt.Key.Key_Left: (40, 0), Qt.Key.Key_Right: (-40, 0), Qt.Key.Key_Up: (0, 40), Qt.Key.Key_Down: (0, -40),
        }  # fmt: skip
        key = Qt.Key(event.key())
        if key in ways and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._set_zoom(self._zoom.panned(*ways[key]))
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self.zoom(1.25)
        elif key == Qt.Key.Key_Minus:
            self.zoom(1 / 1.25)
        elif key == Qt.Key.Key_0:
            self.fit()
        elif key == Qt.Key.Key_1:
            self.zoom(1 / (self._zoom.scale * self.devicePixelRatioF()))
        else:
            super().keyPressEvent(event)

    def _set_zoom(self, zoom: Zoom) -> None:
        if zoom != self._zoom:
            self._zoom = zoom
            self.update()
            self.zoom_changed.emit()

    def _paint(self, painter: QPainter) -> None:
        look = theme.colours()
        painter.fillRect(self.rect(), theme.qcolour(look.scene_top))
        if self._picture is None:
            painter.setPen(theme.qcolour(look.faint))
            box = QRectF(self.rect()).adjusted(12, 12, -12, -12)
            painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), self._empty)
            return
        (left, top), (right, bottom) = self.to_widget(np.array([[0.0, 0.0], self._zoom.picture]))
        area = QRectF(left, top, right - left, bottom - top)
        if "picture" in self._hidden:
            painter.fillRect(area, theme.qcolour(look.base))
        else:
            # Far in, single pixels are wanted, not a blur.
            smooth = self._zoom.scale * painter.device().devicePixelRatioF() < 3
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, smooth)
            painter.drawImage(area, self._picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        size = stroke(area.width(), area.height())
        if "body" not in self._hidden:
            draw_lines(painter, self._segments(self._body), self._body_colour, max(1.5 * size, 1.5))
        if "skeleton" not in self._hidden:
            draw_lines(painter, self._segments(self._bones), self._bone_colour, max(2.5 * size, 2.0))
        if "landmarks" not in self._hidden:
            draw_landmarks(painter, self.to_widget(self._landmarks), self._links, self._visibility, size)
        if "markers" not in self._hidden:
            draw_markers(painter, self.to_widget(self._markers), self._colours, self._selected, size)
        if self._text:
            draw_text(painter, self._text, self.width())

    def _segments(self, segments: np.ndarray) -> np.ndarray:
        return self.to_widget(segments.reshape(-1, 2)).reshape(-1, 4)
