"""What the lines of marker curves mean: a strip above the plots, so that it covers none of them."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPointF, QSize
from PySide6.QtGui import QFontMetricsF, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from markerscope.widgets.plots.ink import colour, em, legible, pen
from markerscope.widgets.plots.marker_curve_data import KIND_TITLES, CurvePicture, Line
from markerscope.widgets.plots.marker_curve_plots import pen_of
from markerscope.widgets.theme import colours

_SAMPLE_EM = 2.0


class CurveLegend(QWidget):
    """Markers by colour, kinds by the way of drawing, in as many rows as they need."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Legend of the curves")
        self._shown: CurvePicture | None = None

    def set_picture(self, shown: CurvePicture) -> None:
        """Say what these mean."""
        self._shown = shown if shown.plots else None
        self.setAccessibleDescription(", ".join(text for text, *_ in self._entries()))
        self.setVisible(self._shown is not None)
        self._fit()
        self.update()

    def _entries(self) -> list[tuple[str, Line | None, tuple[int, int, int]]]:
        if self._shown is None:
            return []
        ink = colours().text
        found: list[tuple[str, Line | None, tuple[int, int, int]]] = [
            (name, None, own) for name, own in self._shown.names
        ]
        for kind, title in KIND_TITLES.items():
            if kind in self._shown.kinds:
                line = next(one for plot in self._shown.plots for one in plot.lines if one.kind == kind)
                found.append((title, Line(kind, title, line.values[:0], ink, strong=True), ink))
        return found

    def _laid_out(self) -> tuple[list[tuple[float, int]], int]:
        """Left edge and row of each entry, and how many rows there are."""
        metrics, sample = QFontMetricsF(self.font()), _SAMPLE_EM * em(self)
        x, row, places = 6.0, 0, []
        for text, *_ in self._entries():
            width = metrics.horizontalAdvance(text) + sample + 18
            if x + width > self.width() and x > 6.0:
                x, row = 6.0, row + 1
            places.append((x, row))
            x += width
        return places, row + 1

    def _fit(self) -> None:
        self.setFixedHeight(round(self._laid_out()[1] * 1.25 * em(self)) + 2)

    def sizeHint(self) -> QSize:
        """One row."""
        return QSize(300, round(1.25 * em(self)) + 2)

    def resizeEvent(self, event: QEvent) -> None:
        """Take as many rows as are needed."""
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font or theme."""
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.PaletteChange):
            self._fit()
            self.update()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the entries."""
        painter, line = QPainter(self), 1.25 * em(self)
        painter.setFont(self.font())
        sample, look = _SAMPLE_EM * em(self), colours()
        for (text, drawn, ink), (x, row) in zip(self._entries(), self._laid_out()[0]):
            middle = row * line + 0.55 * line
            if drawn is None:
                painter.fillRect(round(x), round(middle - 0.22 * line), round(0.7 * sample), round(0.44 * line),
                                 colour(legible(ink)))  # fmt: skip
            else:
                painter.setPen(pen_of(drawn))
                painter.drawLine(QPointF(x, middle), QPointF(x + 0.85 * sample, middle))
            painter.setPen(pen(look.text))
            painter.drawText(QPointF(x + sample, middle + 0.35 * QFontMetricsF(self.font()).ascent() + 1), text)
