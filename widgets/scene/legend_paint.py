"""Painting a legend: a panel in a corner, never larger than the picture."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFont, QFontMetricsF, QImage, QPainter, QPen, QPixmap

from markerscope.widgets import palette
from markerscope.widgets.scene.legend import ColourBar, Legend, Rgb
from markerscope.widgets.theme import Colours, qcolour

_PAD, _GAP, _MARGIN = 8.0, 6.0, 10.0
_BAR = (150.0, 12.0)


class LegendPainter:
    """Keeps the last legend it painted, so that an unchanged one costs next to nothing."""

    def __init__(self) -> None:
        self._key: tuple[object, ...] = ()
        self._kept, self._box = QPixmap(), QRectF()

    def paint(self, painter: QPainter, legend: Legend, size: tuple[int, int], look: Colours) -> QRectF:
        """Paint it in the upper right corner of a picture of this size; returns what it covers."""
        ratio = painter.device().devicePixelRatioF()
        key = (legend, size, look, painter.font().key(), ratio)
        if key != self._key:
            whole = QPixmap(round(size[0] * ratio), round(size[1] * ratio))
            whole.setDevicePixelRatio(ratio)
            whole.fill(Qt.GlobalColor.transparent)
            own = QPainter(whole)
            own.setRenderHints(painter.renderHints())
            own.setFont(painter.font())
            self._box = _draw(own, legend, *size, look)
            own.end()
            # Of the whole picture keep the corner alone, cut at full pixels of the screen.
            left, bottom = int((self._box.left() - 2) * ratio), int((self._box.bottom() + 2) * ratio)
            self._kept = whole.copy(max(0, left), 0, whole.width(), min(bottom, whole.height()))
            self._left, self._key = max(0, left) / ratio, key
        painter.drawPixmap(QPointF(self._left, 0), self._kept)
        return self._box


def _draw(painter: QPainter, legend: Legend, width: float, height: float, look: Colours) -> QRectF:
    bold = QFont(painter.font())
    bold.setBold(True)
    panel = _Panel(painter, bold, look, width, height)
    box = QRectF()
    part: Legend | None = legend
    while part is not None:
        if isinstance(part.entries, ColourBar):
            drawn = panel.bar(part.title, part.entries)
        else:
            drawn = panel.kinds(part.title, list(part.entries), part.also)
        box, part = box.united(drawn), part.also
    return box


def _rows(legend: Legend) -> int:
    return 2 if isinstance(legend.entries, ColourBar) else len(legend.entries)


class _Panel:
    def __init__(self, painter: QPainter, bold: QFont, look: Colours, width: float, height: float) -> None:
        self._painter, self._bold, self._look = painter, bold, look
        self._width, self._height, self._top = width, height, _MARGIN
        self._plain = QFont(painter.font())
        self._metrics, self._title_metrics = QFontMetricsF(self._plain), QFontMetricsF(bold)
        self._row = self._metrics.height() + 2.0

    def kinds(self, title: str, entries: list[tuple[str, Rgb]], also: Legend | None = None) -> QRectF:
        """Draw a panel, and leave room for those below it."""
        below = 0.0
        while also is not None:
            below += (1 + _rows(also)) * self._row + 2 * _PAD + _GAP
            also = also.also
        rows = int(max(1, (self._height - self._top - below - _MARGIN - 2 * _PAD - self._row - 4) // self._row))
        swatch = self._metrics.height() * 0.7
        columns = -(-len(entries) // rows)
        most = max(1, int(0.5 * self._width // 90))
        left_over = 0
        if columns > most:
            left_over = len(entries) - (rows * most - 1)
            entries, columns = entries[: rows * most - 1], most
        words = [text for text, _ in entries] + ([f"and {left_over} more"] if left_over else [])
        rows = -(-len(words) // columns) if columns else 0
        widest = [
            max(self._metrics.horizontalAdvance(text) for text in words[c * rows : (c + 1) * rows] or [""])
            for c in range(columns)
        ]
        room = max(60.0, (self._width - 2 * _MARGIN - 2 * _PAD) / max(1, columns) - swatch - _GAP - 12)
        widest = [min(width, room) for width in widest]
        inside = sum(widest) + columns * (swatch + _GAP) + 12.0 * max(0, columns - 1)
        box = self._ground(title, inside, rows * self._row)
        left, top = box.left() + _PAD, box.top() + _PAD + self._row + 4.0
        for k, text in enumerate(words):
            column, row = divmod(k, rows)
            x = left + sum(widest[:column]) + column * (swatch + _GAP + 12.0)
            y = top + row * self._row
            if k < len(entries):
                self._painter.setPen(QPen(qcolour(self._look.border), 1.0))
                self._painter.setBrush(qcolour(tuple(entries[k][1])))
                self._painter.drawEllipse(QRectF(x, y + 0.5 * (self._row - swatch), swatch, swatch))
            shown = self._metrics.elidedText(text, Qt.TextElideMode.ElideRight, widest[column] + 1.0)
            self._write(QPointF(x + swatch + _GAP, y), shown)
        return box

    def bar(self, title: str, bar: ColourBar) -> QRectF:
        ticks = bar.ticks()
        half = 0.5 * max(self._metrics.horizontalAdvance(text) for _, text in ticks)
        length = max(_BAR[0], 4.5 * half)
        head = f"{title} ({bar.unit})" if bar.unit else title
        inside = max(length + 2 * half, self._title_metrics.horizontalAdvance(head))
        box = self._ground(head, inside, _BAR[1] + 3.0 + self._row)
        left, top = box.left() + _PAD + 0.5 * (inside - length), box.top() + _PAD + self._row + 4.0
        table = palette.scale_table(bar.name)
        picture = QImage(table.tobytes(), len(table), 1, 3 * len(table), QImage.Format.Format_RGB888).copy()
        strip = QRectF(left, top, length, _BAR[1])
        self._painter.drawImage(strip, picture)
        self._painter.setPen(QPen(qcolour(self._look.border), 1.0))
        self._painter.setBrush(Qt.BrushStyle.NoBrush)
        self._painter.drawRect(strip)
        for share, text in ticks:
            x = left + share * length
            self._painter.setPen(QPen(qcolour(self._look.faint), 1.0))
            self._painter.drawLine(QPointF(x, top + _BAR[1]), QPointF(x, top + _BAR[1] + 3.0))
            self._write(QPointF(x - 0.5 * self._metrics.horizontalAdvance(text), top + _BAR[1] + 3.0), text)
        return box

    def _ground(self, title: str, inside: float, below: float) -> QRectF:
        room = self._width - 2 * _MARGIN - 2 * _PAD
        inside = min(max(inside, self._title_metrics.horizontalAdvance(title)), room)
        size = (inside + 2 * _PAD, self._row + 4.0 + below + 2 * _PAD)
        box = QRectF(self._width - _MARGIN - size[0], self._top, *size)
        self._top = box.bottom() + _GAP
        self._painter.setPen(QPen(qcolour(self._look.border), 1.0))
        self._painter.setBrush(qcolour(self._look.base, 225))
        self._painter.drawRoundedRect(box, 5.0, 5.0)
        self._painter.setFont(self._bold)
        shown = self._title_metrics.elidedText(title, Qt.TextElideMode.ElideRight, inside + 1.0)
        self._write(QPointF(box.left() + _PAD, box.top() + _PAD), shown)
        self._painter.setFont(self._plain)
        return box

    def _write(self, at: QPointF, text: str) -> None:
        self._painter.setPen(qcolour(self._look.text))
        ascent = QFontMetricsF(self._painter.font()).ascent()
        self._painter.drawText(QPointF(at.x(), at.y() + 0.5 * (self._row - self._metrics.height()) + ascent), text)
