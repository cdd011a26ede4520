"""All that stands over the picture of a scene, and what it is made from."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFont, QPainter

from markerscope.widgets import palette, theme
from markerscope.widgets.scene.camera import Camera
from markerscope.widgets.scene.layers import LEAST_RADIUS_PX, MARKER_RADIUS
from markerscope.widgets.scene.legend import Legend
from markerscope.widgets.scene.legend_paint import LegendPainter
from markerscope.widgets.scene.overlay import Places, Words, draw_axes, draw_band, draw_labels, draw_rings, draw_ticks
from markerscope.widgets.scene.stage import Stage
from markerscope.widgets.theme import qcolour

_Point = tuple[float, float]


class Sheet:
    """Names, rings and the legend.

    Attributes
    ----------
    labels : a name for each marker
    selected, hovered : the markers with a ring, and the one under the pointer (-1 for none)
    legend : None for none
    """

    def __init__(self) -> None:
        self.labels: list[str] = []
        self.selected: list[int] = []
        self.hovered = -1
        self.legend: Legend | None = None
        self._words = Words()
        self._panel = LegendPainter()

    def paint(
        self,
        painter: QPainter,
        stage: Stage,
        camera: Camera,
        size: tuple[int, int],
        band: tuple[_Point, _Point] | None = None,
    ) -> None:
        """Paint over a picture of the stage, ``size`` pixels wide and high."""
        look, (width, height) = theme.colours(), size
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.TextAntialiasing)
        if stage.problem is not None:
            painter.setPen(qcolour(look.text))
            box = QRectF(0, 0, width, height).adjusted(20, 20, -20, -20)
            painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap), stage.problem)
            return
        places = Places()
        if stage.shows("axes"):
            places.hold(np.array([[0, height - 84, 88, height]]))
        if self.legend is not None and stage.shows("legend"):
            panel = self._panel.paint(painter, self.legend, size, look)
            places.hold(np.array([[panel.left(), panel.top(), panel.right(), panel.bottom()]]))
        if stage.shows("markers"):
            self._markers(painter, stage, camera, size, places)
        if stage.floor is not None and stage.shows("floor"):
            points, texts = stage.floor.ticks(camera, width, height)
            pixels, depth = camera.project(points, width, height)
            pixels[stage.covers(camera, pixels, depth, size)] = np.nan
            draw_ticks(painter, self._words, places, pixels, texts, look)
        if stage.shows("axes"):
            draw_axes(painter, self._words, camera, QPointF(44, height - 42), look)
        if band is not None:
            draw_band(painter, *band, look)

    def _markers(self, painter: QPainter, stage: Stage, camera: Camera, size: tuple[int, int], places: Places) -> None:
        look, (width, height) = theme.colours(), size
        pixels, _ = camera.project(stage.markers, width, height)
        outside = (pixels < 0).any(axis=1) | (pixels[:, 0] > width) | (pixels[:, 1] > height)
        pixels = np.where(outside[:, None], np.nan, pixels)
        radius = max(LEAST_RADIUS_PX, MARKER_RADIUS / camera.metres_per_pixel(height))
        chosen = [i for i in self.selected if i < len(pixels)]
        draw_rings(painter, pixels[chosen], radius + 3.5, palette.SELECTED, look)
        hovered = [self.hovered] if 0 <= self.hovered < len(pixels) else []
        draw_rings(painter, pixels[hovered], radius + 3.5, look.text, look)
        if not self.labels:
            return
        dots = pixels[np.isfinite(pixels[:, 0])]
        places.hold(np.concatenate([dots - 0.8 * radius, dots + 0.8 * radius], axis=1))
        first = hovered + [i for i in chosen if i not in hovered]
        rest = [i for i in range(len(pixels)) if i not in set(first)] if stage.shows("labels") else []
        plain, bold = QFont(painter.font()), QFont(painter.font())
        bold.setBold(True)
        for which, font in ((first, bold), (rest, plain)):
            which = [i for i in which if i < len(self.labels)]
            painter.setFont(font)
            texts = [self.labels[i] for i in which]
            ink, outline = qcolour(look.text), qcolour(look.outline, 210)
            draw_labels(painter, self._words, places, pixels[which], texts, ink, outline, radius + 5)
        painter.setFont(plain)
