"""The whole session along one clock: what was seen, what was lost, and how well each fit explains it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QFrame, QMenu, QScrollArea, QVBoxLayout, QWidget

from markerscope.widgets.plots.rows import Row
from markerscope.widgets.plots.time_window import TimeWindow
from markerscope.widgets.plots.timeline_header import TimelineHeader
from markerscope.widgets.plots.timeline_rows import TimelineRows


class Timelines(QWidget):
    """An overview, a ruler, and rows below each other that are zoomed and panned together.

    Wheel zooms about the pointer, Shift+wheel (or the middle button) pans, Ctrl+wheel scrolls the rows; a drag moves
    the cursor, a drag with Shift marks the range to loop over. Keys: ``+`` ``-`` ``0`` zoom, ``[`` ``]`` set the ends
    of the range to the cursor, Escape clears it, Ctrl+Left and Ctrl+Right shift the video by a hundredth of a second.

    Signals
    -------
    seeked(time) : s, the user moved the cursor
    range_changed(range) : (start, end) in s, or None
    offset_dragged(offset) : s, while the video's bar is being dragged
    offset_committed(offset) : s, as it is let go, nudged, or the automatic one is accepted
    row_clicked(name, time, index) : index of the marker, state or curve, -1 for none
    view_changed(start, end) : s, the visible part
    """

    seeked = Signal(float)
    range_changed = Signal(object)
    offset_dragged = Signal(float)
    offset_committed = Signal(float)
    row_clicked = Signal(str, float, int)
    view_changed = Signal(float, float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Timelines")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.window_of_time = TimeWindow(self)
        self.header = TimelineHeader(self.window_of_time, self)
        self.rows = TimelineRows(self.window_of_time, self)
        self._scroll = QScrollArea(self)
        self._scroll.setWidget(self.rows)
        self._scroll.setWidgetResizable(True)
        self._scroll.setFrameShape(QFrame.Shape.NoFrame)
        self._scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.header)
        layout.addWidget(self._scroll, 1)
        for part in (self.header, self.rows):
            part.seeked.connect(self.seeked)
            part.range_marked.connect(self._mark)
        self.rows.row_clicked.connect(self.row_clicked)
        self.rows.offset_dragged.connect(self.offset_dragged)
        self.rows.offset_committed.connect(self.offset_committed)
        self.rows.margin_changed.connect(self._line_up)
        self.window_of_time.viewed.connect(lambda: self.view_changed.emit(*self.window_of_time.view))
        self._scroll.verticalScrollBar().rangeChanged.connect(lambda *_: self._line_up(self.rows.margin))

    def set_span(self, start: float, end: float) -> None:
        """Ends of the recording, s on the markers' clock; all of it is shown."""
        self.window_of_time.set_span(start, end)

    def set_rows(self, rows: Sequence[Row]) -> None:
        """Show these rows, top down; rows that are the same object keep what was prepared for them."""
        self.rows.set_rows(rows)
        self.header.set_rows(rows)

    def add_row(self, row: Row) -> None:
        """Show one more row, or replace the one of that name."""
        kept = [old for old in self.rows.shown_rows() if old.name != row.name]
        names = [old.name for old in self.rows.shown_rows()]
        at = names.index(row.name) if row.name in names else len(kept)
        self.set_rows([*kept[:at], row, *kept[at:]])

    def set_row_menu(self, name: str, text: str, tip: str, menu: QMenu) -> None:
        """Offer a menu beside the row of that name, whenever it is shown."""
        self.rows.set_row_menu(name, text, tip, menu)

    def set_time(self, time: float) -> None:
        """Move the cursor to a moment, s."""
        self.window_of_time.set_time(time)

    def set_range(self, ends: tuple[float, float] | None) -> None:
        """Show a loop range, s, or none; nothing is emitted."""
        self.window_of_time.set_range(ends)

    def set_offset(self, offset: float) -> None:
        """Show another offset of the video, s, without building its row anew."""
        self.rows.set_offset(offset)

    def set_selected(self, markers: Iterable[int]) -> None:
        """Frame the strips of these markers."""
        self.rows.set_selected(frozenset(markers))

    def view(self) -> tuple[float, float]:
        """The visible part, s."""
        return self.window_of_time.view

    def set_view(self, start: float, end: float) -> None:
        """Show a part, s."""
        self.window_of_time.set_view(start, end)

    def sizeHint(self) -> QSize:
        """Wide, and high enough for what it shows."""
        return QSize(900, self.header.sizeHint().height() + self.rows.minimumSizeHint().height())

    def minimumSizeHint(self) -> QSize:
        """The header and one row."""
        return QSize(320, self.header.sizeHint().height() + 60)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Zoom, mark and nudge; all other keys belong to the window."""
        window, key = self.window_of_time, event.key()
        if event.text() in ("+", "="):
            window.zoom(1.5)
        elif event.text() == "-":
            window.zoom(1 / 1.5)
        elif event.text() == "0":
            window.set_view(*window.span)
        elif event.text() == "[":
            self._mark((window.time, window.range[1] if window.range else window.span[1]))
        elif event.text() == "]":
            self._mark((window.range[0] if window.range else window.span[0], window.time))
        elif key == Qt.Key.Key_Escape and window.range is not None:
            self._mark(None)
        elif (
            event.modifiers() & Qt.KeyboardModifier.ControlModifier
            and key in (Qt.Key.Key_Left, Qt.Key.Key_Right)
            and (offset := self.rows.offset()) is not None
        ):
            self.rows.set_offset(offset + (0.01 if key == Qt.Key.Key_Right else -0.01))
            self.offset_committed.emit(self.rows.offset())
        else:
            event.ignore()
            return
        event.accept()

    def _mark(self, ends: tuple[float, float] | None) -> None:
        before = self.window_of_time.range
        self.window_of_time.set_range(ends)
        if self.window_of_time.range != before:
            self.range_changed.emit(self.window_of_time.range)

    def _line_up(self, margin: float) -> None:
        """Keep the header's clock above that of the rows, scroll bar or not."""
        bar = self._scroll.verticalScrollBar()
        covered = bar.sizeHint().width() if bar.maximum() > 0 else 0
        self.header.set_margins(margin, covered)
