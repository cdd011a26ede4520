"""How each kind of row is painted, and what lies below a point of it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QPainter

from markerscope.widgets import palette
from markerscope.widgets.plots.curve_paint import curve_value, draw_curve, frame_at, legend
from markerscope.widgets.plots.decimate import Counts, presence_picture, shown_frames, strength
from markerscope.widgets.plots.ink import colour, elided, image_of, pen, runs, y_axis
from markerscope.widgets.plots.rows import CurveRow, OffsetRow, PresenceRow, Row, StateRow
from markerscope.widgets.plots.scales import Scale, clock, limits, number
from markerscope.widgets.theme import colours

_FILLED = 0.4
"""How strong the marker's own colour is where it was not measured but made up."""
_KEY_COLOURS = 4
"""So many of the strips' colours stand for all of them in the key."""


def painter_of(row: Row) -> RowPainter:
    """Find the painter for a row; all painters have the same methods."""
    if isinstance(row, PresenceRow):
        return PresencePainter(row)
    if isinstance(row, StateRow):
        return StatePainter(row)
    return CurvePainter(row) if isinstance(row, CurveRow) else OffsetPainter(row)


class PresencePainter:
    """A strip a marker."""

    stretch = 2.0

    def __init__(self, row: PresenceRow) -> None:
        self.row = row
        self.markers = row.present.shape[1]
        self.numbers = np.arange(self.markers) if row.markers is None else np.asarray(row.markers)
        self.present = Counts(row.present)
        self.filled = None if row.filled is None else Counts(row.filled)
        self.outlier = None if row.outlier is None else Counts(row.outlier)

    def height(self, em: float) -> float:
        """Some two pixels a marker where there is little room, and room for two lines of text."""
        return max(2.2 * em, min(3.0 * self.markers, 4.2 * em))

    def paint(self, painter: QPainter, area: QRectF, x: Scale) -> None:
        """Draw the strips as one picture."""
        look = colours()
        if not self.markers or not len(self.row.time):
            return
        ratio = painter.device().devicePixelRatioF()
        width = max(1, round(area.width() * ratio))
        first, last, inside = shown_frames(self.row.time, x.low, x.high, width)
        seen = self.row.colours if self.row.colours is not None else np.array(look.accent)
        # no further hues: whatever they were, some cluster would have them already
        layers = [(1 - strength(1 - self.present.share(first, last)), seen)]
        if self.filled is not None:
            layers.append((_FILLED * strength(self.filled.share(first, last)), seen))
        if self.outlier is not None:
            layers.append((np.minimum(2 * strength(self.outlier.share(first, last)), 1), np.array(look.text)))
        picture = presence_picture(layers, np.array(look.base), inside)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, False)
        painter.drawImage(area, image_of(picture))
        strip = area.height() / self.markers
        if strip >= 5:
            painter.setPen(pen(look.base))
            for k in range(1, self.markers):
                y = round(area.top() + k * strip)
                painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
        self._paint_key(painter, area, np.atleast_2d(seen))

    def paint_selected(self, painter: QPainter, area: QRectF, selected: frozenset[int]) -> None:
        """Frame the strips of markers, over the picture."""
        strip = area.height() / max(self.markers, 1)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(pen(palette.SELECTED, 1.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for low, high in runs(np.isin(self.numbers, list(selected))):
            painter.drawRect(QRectF(area.left() + 1, area.top() + low * strip, area.width() - 2, (high - low) * strip))

    def _paint_key(self, painter: QPainter, area: QRectF, seen: np.ndarray) -> None:
        """Say below the row's name what the shades mean, where there is room; ``seen`` (M, 3) of the strips."""
        look, line = colours(), QFontMetricsF(painter.font()).height()
        seen = np.array(list(dict.fromkeys(map(tuple, seen.tolist())))[:_KEY_COLOURS], dtype=float)
        entries = [
            ("seen", seen),
            ("filled", np.array(look.base) + _FILLED * (seen - look.base)),
            ("outlier", np.array([look.text])),
            ("lost", np.array([look.base])),
        ]
        known = {"filled": self.filled is not None, "outlier": self.outlier is not None}
        entries = [entry for entry in entries if known.get(entry[0], True)]
        if area.height() < (len(entries) + 1.3) * line:
            return
        for k, (name, inks) in enumerate(entries):
            top = area.top() + (k + 1.3) * line
            box = QRectF(12, top + 0.25 * line, 0.9 * line, 0.5 * line)
            for i, ink in enumerate(inks):
                part = box.width() / len(inks)
                painter.fillRect(QRectF(box.left() + i * part, box.top(), part, box.height()), colour(ink))
            painter.setPen(pen(look.border))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(box)
            painter.setPen(colour(look.faint))
            elided(painter, QRectF(12 + 1.3 * line, top, area.left() - 24 - 1.3 * line, line), name)

    def index_at(self, time: float, y: float, area: QRectF) -> int:
        """Marker."""
        strip = self._strip(y, area)
        return int(self.numbers[strip]) if strip >= 0 else -1

    def tip(self, time: float, y: float, area: QRectF) -> str:
        """Marker, and what was there."""
        index = self._strip(y, area)
        if index < 0 or not len(self.row.time):
            return self.row.help
        frame = frame_at(self.row.time, time)
        what = "seen" if self.row.present[frame, index] else "lost"
        if self.row.filled is not None and self.row.filled[frame, index]:
            what = "filled"
        if self.row.outlier is not None and self.row.outlier[frame, index]:
            what = "taken out as an outlier"
        name = self.row.labels[index] if index < len(self.row.labels) else f"marker {index}"
        return f"{name}: {what} at {clock(time)}, seen in {100 * self.row.present[:, index].mean():.0f} % of all frames"

    def _strip(self, y: float, area: QRectF) -> int:
        index = int((y - area.top()) / max(area.height(), 1) * self.markers)
        return index if 0 <= index < self.markers else -1


class StatePainter:
    """One strip of states."""

    stretch = 0.0

    def __init__(self, row: StateRow) -> None:
        self.row = row
        self.states = Counts(row.states[:, None] == np.arange(len(row.colours)))

    def height(self, em: float) -> float:
        """A line of text."""
        return 1.7 * em

    def paint(self, painter: QPainter, area: QRectF, x: Scale) -> None:
        """Draw each pixel in the colour of its highest state."""
        if not len(self.row.time):
            return
        width = max(1, round(area.width() * painter.device().devicePixelRatioF()))
        first, last, inside = shown_frames(self.row.time, x.low, x.high, width)
        present = self.states.share(first, last) > 0
        highest = present.shape[1] - 1 - present[:, ::-1].argmax(axis=1)
        ground = np.array(colours().base)
        picture = np.where(inside[:, None], self.row.colours[highest], ground)[None].astype(np.uint8)
        bar = area.adjusted(0, area.height() * 0.12, 0, -area.height() * 0.12)
        painter.drawImage(bar, image_of(picture))
        metrics = QFontMetricsF(painter.font())
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        stops = np.flatnonzero(np.diff(highest, prepend=-1, append=-1) | np.diff(inside, prepend=False, append=False))
        for low, high in pairwise(stops):
            name = self.row.labels[highest[low]] if highest[low] < len(self.row.labels) else ""
            box = QRectF(
                area.left() + low * area.width() / width, bar.top(), (high - low) * area.width() / width, bar.height()
            )
            if inside[low] and name and metrics.horizontalAdvance(name) + 12 < box.width():
                painter.setPen(colour(palette.text_on(self.row.colours[highest[low]])))
                painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), name)

    def index_at(self, time: float, y: float, area: QRectF) -> int:
        """State."""
        return int(self.row.states[frame_at(self.row.time, time)]) if len(self.row.time) else -1

    def tip(self, time: float, y: float, area: QRectF) -> str:
        """Say its name."""
        state = self.index_at(time, y, area)
        name = self.row.labels[state] if 0 <= state < len(self.row.labels) else f"state {state}"
        return f"{name} at {clock(time)}. {self.row.help}"


class CurvePainter:
    """Lines with an axis of their own."""

    stretch = 1.0

    def __init__(self, row: CurveRow) -> None:
        self.row = row
        self._names = 0.0
        framed = [curve for curve in row.curves if curve.framed] or row.curves
        self.limits = limits([curve.values for curve in framed], row.lowest)

    def height(self, em: float) -> float:
        """Four lines of text, the first for the names where there are several curves."""
        self._names = 1.15 * em if len(self.row.curves) > 1 else 0.0
        return 3.8 * em + 0.5 * self._names

    def y_scale(self, area: QRectF) -> Scale:
        """Values to pixels, below the names."""
        return Scale(*self.limits, area.bottom() - 3, area.top() + 3 + self._names)

    def paint(self, painter: QPainter, area: QRectF, x: Scale) -> None:
        """Draw the axis, the lines and their names."""
        metrics = QFontMetricsF(painter.font())
        y = self.y_scale(area)
        y_axis(painter, area, y, self.row.unit, 1.25 * metrics.height())
        painter.setClipRect(area)
        for curve in self.row.curves:
            draw_curve(painter, area, x, y, curve, self.row.time)
        legend(painter, area, self.row.curves)
        painter.setClipping(False)

    def index_at(self, time: float, y: float, area: QRectF) -> int:
        """The curve nearest to a point."""
        scale = self.y_scale(area)
        away = [abs(scale.at(value) - y) if np.isfinite(value) else np.inf for value in self.values_at(time)]
        return int(np.argmin(away)) if away and np.isfinite(min(away)) else -1

    def values_at(self, time: float) -> list[float]:
        """Value of each curve at a moment."""
        return [curve_value(curve, self.row.time, time) for curve in self.row.curves]

    def tip(self, time: float, y: float, area: QRectF) -> str:
        """All values at that moment."""
        parts = [f"{c.label}: {number(v)} {self.row.unit}" for c, v in zip(self.row.curves, self.values_at(time))]
        return "\n".join([clock(time), *parts, *([self.row.help] if self.row.help else [])])


class OffsetPainter:
    """The bar of the video on the clock of the markers."""

    stretch = 0.3

    def __init__(self, row: OffsetRow) -> None:
        self.row = row
        self.offset = row.offset

    def height(self, em: float) -> float:
        """Two lines: the name of the bar and the curves to match."""
        return 2.8 * em

    def ends(self) -> tuple[float, float]:
        """Of the video, on the markers' clock."""
        return (
            self.row.rate_ratio * self.row.start + self.offset,
            self.row.rate_ratio * self.row.end + self.offset,
        )

    def bar(self, area: QRectF, x: Scale) -> QRectF:
        """The bar to be dragged."""
        left, right = (x.at(t) for t in self.ends())
        return QRectF(left, area.top() + 3, max(right - left, 6), area.height() - 6)

    def paint(self, painter: QPainter, area: QRectF, x: Scale) -> None:
        """Draw the bar, both motions, and where the automatic offset would put it."""
        look, bar, row = colours(), self.bar(area, x), self.row
        painter.setClipRect(area)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
        painter.setPen(pen(look.accent, 1.5))
        painter.setBrush(colour(look.accent, 40))
        painter.drawRoundedRect(bar, 4, 4)
        low = Scale(0, 1, bar.bottom() - 2, bar.top() + QFontMetricsF(painter.font()).height() + 2)
        for curve, shift, ratio in ((row.fixed, 0.0, 1.0), (row.moving, self.offset, row.rate_ratio)):
            if curve is not None and curve.time is not None and np.isfinite(curve.values).any():
                span = limits([curve.values], 0.0)
                y = Scale(*span, low.start, low.end)
                on_clock = ratio * curve.time + shift
                draw_curve(painter, area, x, y, curve, on_clock, on_clock)
        if row.automatic is not None and abs(row.automatic - self.offset) > 5e-4:
            painter.setPen(pen(look.good, 1.5, dashed=True))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRoundedRect(bar.translated(x.at(row.automatic) - x.at(self.offset), 0), 4, 4)
        painter.setPen(colour(look.text))
        inside = bar.intersected(area).adjusted(8, 0, -8, 0)
        box = QRectF(inside.left(), bar.top(), inside.width(), QFontMetricsF(painter.font()).height() + 2)
        elided(painter, box, f"video, offset {offset_text(self.offset)}")
        painter.setClipping(False)

    def index_at(self, time: float, y: float, area: QRectF) -> int:
        """Nothing to choose among."""
        return -1

    def tip(self, time: float, y: float, area: QRectF) -> str:
        """Say what dragging does."""
        found = "" if self.row.automatic is None else f" Found from the motion: {offset_text(self.row.automatic)}."
        return (
            f"Marker time = {self.row.rate_ratio:.6g} × video time {self.offset:+.3f} s.{found}\n"
            "Drag the bar, or press Ctrl+Left and Ctrl+Right, to shift the video against the markers."
        ).replace("-", "−")


RowPainter = PresencePainter | StatePainter | CurvePainter | OffsetPainter


def offset_text(offset: float) -> str:
    """An offset with its sign and unit."""
    return f"{offset:+.3f} s".replace("-", "−")
