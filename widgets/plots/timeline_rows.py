"""The rows themselves: painted once into a picture, over which only the cursor moves."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QPointF, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QHelpEvent, QMouseEvent, QPainter, QPaintEvent, QPixmap, QWheelEvent
from PySide6.QtWidgets import QMenu, QToolTip, QWidget

from markerscope.widgets import palette
from markerscope.widgets.plots.ink import colour, elided, em, pen
from markerscope.widgets.plots.row_buttons import RowButtons
from markerscope.widgets.plots.row_painters import OffsetPainter, PresencePainter, RowPainter, painter_of
from markerscope.widgets.plots.rows import CurveRow, Row
from markerscope.widgets.plots.scales import Scale
from markerscope.widgets.plots.time_window import TimeWindow
from markerscope.widgets.theme import colours

_GAP = 5.0
"""px between rows."""
_CLICK = 3.0
"""px that the pointer may move between press and release of a click."""


class TimelineRows(QWidget):
    """Rows below each other on one clock; see :class:`Timelines` for what the user can do.

    Signals
    -------
    seeked, range_marked, row_clicked, offset_dragged, offset_committed : as of :class:`Timelines`
    margin_changed(px) : the names at the left need another width
    """

    seeked = Signal(float)
    range_marked = Signal(object)
    row_clicked = Signal(str, float, int)
    offset_dragged = Signal(float)
    offset_committed = Signal(float)
    margin_changed = Signal(float)

    def __init__(self, window: TimeWindow, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setMouseTracking(True)
        self.setAccessibleName("Rows of the timelines")
        self.margin = 0.0
        self._time = window
        self._rows: list[RowPainter] = []
        self._areas: list[QRectF] = []
        self._selected: frozenset[int] = frozenset()
        self._picture: QPixmap | None = None
        self._grabbed = ""
        self._from = 0.0
        self._pressed = QPointF()
        self._buttons = RowButtons(self, self._take_automatic)
        window.viewed.connect(self._repaint)
        window.moved.connect(self._move_cursor)
        window.ranged.connect(self.update)

    def shown_rows(self) -> list[Row]:
        """The rows, top down."""
        return [painter.row for painter in self._rows]

    def set_rows(self, rows: Sequence[Row]) -> None:
        """Show these, top down."""
        known = {id(painter.row): painter for painter in self._rows}
        self._rows = [known.get(id(row)) or painter_of(row) for row in rows]
        self.updateGeometry()
        self._lay_out()

    def set_row_menu(self, name: str, text: str, tip: str, menu: QMenu) -> None:
        """Offer a menu below the name of a row."""
        self._buttons.add_menu(name, text, tip, menu)
        self._place_buttons()

    def set_selected(self, markers: frozenset[int]) -> None:
        """Frame their strips."""
        if markers != self._selected:
            self._selected = markers
            self.update()

    def offset(self) -> float | None:
        """Where the video's bar is, s; None without one."""
        found = self._offset_painter()
        return None if found is None else found.offset

    def set_offset(self, offset: float) -> None:
        """Move the video's bar."""
        found = self._offset_painter()
        if found is not None and found.offset != offset:
            found.offset = offset
            self._place_buttons()
            self._repaint()

    def area_of(self, name: str) -> QRectF:
        """Where a row is drawn, px."""
        return next(area for painter, area in zip(self._rows, self._areas) if painter.row.name == name)

    def clock_scale(self) -> Scale:
        """Time to pixels."""
        return Scale(*self._time.view, self.margin, float(self.width()))

    def minimumSizeHint(self) -> QSize:
        """All rows at their least height."""
        line = em(self)
        return QSize(200, round(sum(painter.height(line) + _GAP for painter in self._rows) + _GAP))

    def sizeHint(self) -> QSize:
        """The same."""
        return self.minimumSizeHint()

    # what is drawn

    def paintEvent(self, event: QPaintEvent) -> None:
        """Show the picture of the rows, the range and the cursor."""
        painter = QPainter(self)
        if self._picture is None:
            self._picture = self._draw()
        ratio = self._picture.devicePixelRatio()
        part = event.rect()
        source = QRect(
            round(part.x() * ratio), round(part.y() * ratio), round(part.width() * ratio), round(part.height() * ratio)
        )
        painter.drawPixmap(part, self._picture, source)
        x = self.clock_scale()
        painter.setClipRect(QRectF(self.margin, 0, self.width() - self.margin, self.height()))
        for row, area in zip(self._rows, self._areas):
            if self._selected and isinstance(row, PresencePainter) and area.intersects(QRectF(part)):
                row.paint_selected(painter, area, self._selected)
        if self._time.range is not None:
            look = colours()
            a, b = (x.at(t) for t in self._time.range)
            for left, right in ((x.start, a), (b, x.end)):
                if right > left:
                    painter.fillRect(QRectF(left, 0, right - left, self.height()), colour(look.window, 105))
            painter.setPen(pen(palette.SELECTED, 1))
            for edge in (a, b):
                painter.drawLine(QPointF(edge, 0), QPointF(edge, self.height()))
        painter.setPen(pen(palette.SELECTED, 1.5))
        cursor = x.at(self._time.time)
        painter.drawLine(QPointF(cursor, 0), QPointF(cursor, self.height()))

    def _draw(self) -> QPixmap:
        ratio = self.devicePixelRatioF()
        picture = QPixmap(round(self.width() * ratio), round(self.height() * ratio))
        picture.setDevicePixelRatio(ratio)
        look = colours()
        picture.fill(colour(look.window))
        painter = QPainter(picture)
        painter.setFont(self.font())
        metrics, x = QFontMetricsF(self.font()), self.clock_scale()
        for row, area in zip(self._rows, self._areas):
            painter.fillRect(area, colour(look.base))
            painter.setPen(colour(look.text))
            right = area.left() - 8 - (self._axis_width() if isinstance(row.row, CurveRow) else 0)
            name = QRectF(8, area.top(), max(right - 8, 10), metrics.height() + 2)
            elided(painter, name, row.row.name)
            row.paint(painter, area, x)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(pen(look.border))
            painter.drawRect(area)
        painter.end()
        return picture

    def _axis_width(self) -> float:
        return QFontMetricsF(self.font()).horizontalAdvance("000.0 mm") + 6

    def _lay_out(self) -> None:
        metrics, line = QFontMetricsF(self.font()), em(self)
        names = [
            metrics.horizontalAdvance(p.row.name) + (self._axis_width() if isinstance(p.row, CurveRow) else 0)
            for p in self._rows
        ]
        margin = round(min(max([*names, 60.0]), max(0.35 * self.width(), 80.0)) + 18)
        spare = max(0.0, self.height() - self.minimumSizeHint().height())
        weight = sum(p.stretch for p in self._rows) or 1.0
        top, self._areas = _GAP, []
        for row in self._rows:
            height = row.height(line) + spare * row.stretch / weight
            self._areas.append(QRectF(margin, round(top), max(self.width() - margin - 1, 1), round(height)))
            top += height + _GAP
        if margin != self.margin:
            self.margin = margin
        self.margin_changed.emit(self.margin)
        self._place_buttons()
        self._repaint()

    def _place_buttons(self) -> None:
        self._buttons.place(self._rows, self._areas, self.margin)

    def _repaint(self) -> None:
        self._picture = None
        self.update()

    def _move_cursor(self, before: float, now: float) -> None:
        x = self.clock_scale()
        for time in (before, now):
            self.update(QRect(round(x.at(time)) - 3, 0, 6, self.height()))

    def resizeEvent(self, event: QEvent) -> None:
        """Give the rows their share."""
        self._lay_out()

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font or theme."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange, QEvent.Type.StyleChange):
            self.updateGeometry()
            self._lay_out()
        super().changeEvent(event)

    # what the user does

    def _offset_painter(self) -> OffsetPainter | None:
        return next((p for p in self._rows if isinstance(p, OffsetPainter)), None)

    def _at(self, y: float) -> tuple[RowPainter, QRectF] | None:
        return next(((p, a) for p, a in zip(self._rows, self._areas) if a.top() <= y <= a.bottom()), None)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Grab the video's bar, the view, a range or the cursor."""
        at, below = event.position(), self._at(event.position().y())
        self._pressed, self._from = at, self.clock_scale().value(at.x())
        if event.button() == Qt.MouseButton.MiddleButton:
            self._grabbed = "view"
        elif event.button() != Qt.MouseButton.LeftButton or at.x() < self.margin:
            self._grabbed = ""
            event.ignore()
        elif event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self._grabbed = "mark"
        elif below and isinstance(below[0], OffsetPainter) and below[0].bar(below[1], self.clock_scale()).contains(at):
            self._grabbed = "offset"
            self._from -= below[0].offset
        else:
            self._grabbed = "seek"
            self._seek(at)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what was grabbed."""
        at, time = event.position(), self.clock_scale().value(event.position().x())
        if self._grabbed == "view":
            self._time.pan(self._from - time)
        elif self._grabbed == "mark" and abs(at.x() - self._pressed.x()) > _CLICK:
            self.range_marked.emit((self._from, time))
        elif self._grabbed == "offset":
            self.set_offset(time - self._from)
            self.offset_dragged.emit(time - self._from)
        elif self._grabbed == "seek":
            self._seek(at)
        else:
            below = self._at(at.y())
            bar = below[0].bar(below[1], self.clock_scale()) if below and isinstance(below[0], OffsetPainter) else None
            over = bar is not None and bar.contains(at)
            self.setCursor(Qt.CursorShape.SizeHorCursor if over else Qt.CursorShape.ArrowCursor)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go; a click names its row."""
        at, grabbed, self._grabbed = event.position(), self._grabbed, ""
        moved = (at - self._pressed).manhattanLength()
        if grabbed == "offset" and moved > 0:
            self.offset_committed.emit(self.offset())
        elif grabbed in ("seek", "offset") and moved <= _CLICK and (below := self._at(at.y())):
            time = self.clock_scale().value(at.x())
            self.row_clicked.emit(below[0].row.name, time, below[0].index_at(time, at.y(), below[1]))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom, pan with Shift, leave Ctrl to the scroll area."""
        turn, keys = event.angleDelta(), event.modifiers()
        if keys & Qt.KeyboardModifier.ControlModifier:
            event.ignore()
            return
        if keys & Qt.KeyboardModifier.ShiftModifier or abs(turn.x()) > abs(turn.y()):
            notches = (turn.x() or turn.y()) / 120
            self._time.pan(-0.1 * notches * (self._time.view[1] - self._time.view[0]))
        else:
            self._time.zoom(1.2 ** (turn.y() / 120), self.clock_scale().value(event.position().x()))
        event.accept()

    def event(self, event: QEvent) -> bool:
        """Say what lies below the pointer."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            below = self._at(event.pos().y())
            if below is not None:
                time = self.clock_scale().value(event.pos().x())
                named = event.pos().x() < self.margin
                text = below[0].row.help if named else below[0].tip(time, event.pos().y(), below[1])
                QToolTip.showText(event.globalPos(), text, self)
            return True
        return super().event(event)

    def _seek(self, at: QPointF) -> None:
        low, high = self._time.span
        self.seeked.emit(min(max(self.clock_scale().value(at.x()), low), high))

    def _take_automatic(self, offset: float) -> None:
        self.set_offset(offset)
        self.offset_committed.emit(offset)
