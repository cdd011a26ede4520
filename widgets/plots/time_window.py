"""The stretch of time that linked plots show together."""

from __future__ import annotations

from PySide6.QtCore import QObject, Signal

_CLOSEST = 0.05
"""s, the shortest stretch that can be shown."""


class TimeWindow(QObject):
    """Whole span, visible part, cursor and loop range, all in s on the markers' clock.

    Signals
    -------
    viewed : the visible part or the whole span changed
    moved(before, now) : the cursor
    ranged : the loop range changed
    """

    viewed = Signal()
    moved = Signal(float, float)
    ranged = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.span = (0.0, 1.0)
        self.view = (0.0, 1.0)
        self.time = 0.0
        self.range: tuple[float, float] | None = None

    def set_span(self, start: float, end: float) -> None:
        """Set the ends of the recording, and show all of it."""
        self.span = self.view = (float(start), float(max(end, start + 1e-3)))
        self.viewed.emit()

    def set_view(self, start: float, end: float) -> None:
        """Show a part; it is kept within the span."""
        low, high = self.span
        width = min(max(end - start, min(_CLOSEST, high - low)), high - low)
        start = min(max(start, low), high - width)
        if (start, start + width) != self.view:
            self.view = (start, start + width)
            self.viewed.emit()

    def zoom(self, factor: float, about: float | None = None) -> None:
        """Show ``1 / factor`` of what is visible; the moment ``about`` stays where it is."""
        start, end = self.view
        about = min(max(self.time if about is None else about, start), end)
        self.set_view(about - (about - start) / factor, about + (end - about) / factor)

    def pan(self, by: float) -> None:
        """Show an equally long part ``by`` s later."""
        self.set_view(self.view[0] + by, self.view[1] + by)

    def set_time(self, time: float) -> None:
        """Move the cursor; a view that is zoomed in follows it by turning the page."""
        before, self.time = self.time, float(time)
        if before != self.time:
            start, end = self.view
            if not start <= self.time <= end and self.span[0] <= self.time <= self.span[1]:
                width = end - start
                first = self.time - (0.1 if self.time > end else 0.9) * width
                self.set_view(first, first + width)
            self.moved.emit(before, self.time)

    def set_range(self, ends: tuple[float, float] | None) -> None:
        """Set or clear the loop range."""
        if ends is not None:
            low, high = sorted(min(max(float(t), self.span[0]), self.span[1]) for t in ends)
            ends = (low, high) if high > low else None
        if ends != self.range:
            self.range = ends
            self.ranged.emit()
