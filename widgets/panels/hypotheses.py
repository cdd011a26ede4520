"""The answers beside each other: a picture, what their energies are made of, and how far they are apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFont, QImage, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPalette, QPixmap, QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QFrame,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.panels.energy_bars import EnergyBar, TermKey
from markerscope.widgets.panels.hypothesis_data import Hypothesis
from markerscope.widgets.plots.ink import colour, em, pen
from markerscope.widgets.plots.scales import HEADING, degrees, figure
from markerscope.widgets.theme import colours


class HypothesisCard(QFrame):
    """One answer to click on."""

    clicked = Signal(int)
    pin_requested = Signal(int)

    def __init__(self, card: Hypothesis, picture: QImage | None, highest: float, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.card = card
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self._chosen = False
        self._image = image = QLabel()
        self._picture = picture
        image.setAlignment(Qt.AlignmentFlag.AlignCenter)
        title = QLabel(card.title)
        title.setWordWrap(True)
        bold = QFont(title.font())
        bold.setBold(True)
        title.setFont(bold)
        figures = QLabel(
            f"Camera heading {degrees(card.heading_deg)}°\nEnergy {figure(card.energy)}, {card.margin:.2f} × best"
        )
        figures.setWordWrap(True)
        figures.setToolTip(f"{HEADING}. Energy: the less, the better")
        badges = [
            text
            for text, on in (
                ("in use", card.in_use),
                ("runner-up", card.runner_up),
                ("same as the first", card.same_as_first),
            )
            if on
        ]
        badge = QLabel(", ".join(badges))
        badge.setForegroundRole(QPalette.ColorRole.Link)
        self.pin = QPushButton(icon("pin"), "In use" if card.in_use else "Pin")
        self.set_reason("")
        self.pin.clicked.connect(lambda: self.pin_requested.emit(card.candidate))
        column = QVBoxLayout()
        column.setSpacing(4)
        for part in (title, EnergyBar(card.terms, highest), figures, badge):
            column.addWidget(part)
        column.addStretch(1)
        column.addWidget(self.pin)
        self._layout = QBoxLayout(QBoxLayout.Direction.TopToBottom, self)
        self._layout.setContentsMargins(6, 6, 6, 6)
        self._layout.addWidget(image)
        self._layout.addLayout(column, 1)
        self.set_low(False)
        heading, margin = f"camera heading {degrees(card.heading_deg)} degrees", f"{card.margin:.2f} times best"
        self.setAccessibleName(", ".join([card.title, heading, margin, *badges]))

    def set_reason(self, reason: str) -> None:
        """Say why it cannot be pinned now, "" where it can."""
        own = "the fit goes on from it" if self.card.in_use else reason
        allow(self.pin, own, "Hold this answer, and go on from it; can be undone")

    def set_low(self, low: bool) -> None:
        """Put the picture beside the figures instead of above them, where there is little height."""
        self._low = low
        line = self.fontMetrics().height()
        directions = QBoxLayout.Direction
        self._layout.setDirection(directions.LeftToRight if low else directions.TopToBottom)
        self._image.setFixedSize(
            *((round(8 * line), round(7.5 * line)) if low else (round(14 * line), round(10 * line)))
        )
        self.setFixedWidth(round((22 if low else 15) * line))
        if self._picture is None:
            self._image.setText("no picture yet")
            self._image.setEnabled(False)
            return
        ratio = self.devicePixelRatioF()
        size = self._image.size() * ratio
        keep, smooth = Qt.AspectRatioMode.KeepAspectRatioByExpanding, Qt.TransformationMode.SmoothTransformation
        shown = self._picture.scaled(size, keep, smooth)
        beyond = (shown.width() - size.width()) // 2, (shown.height() - size.height()) // 2
        shown = shown.copy(*beyond, size.width(), size.height())
        shown.setDevicePixelRatio(ratio)
        self._image.setPixmap(QPixmap.fromImage(shown))

    def set_chosen(self, on: bool) -> None:
        """Frame the card."""
        if on != self._chosen:
            self._chosen = on
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the ground, and a frame where it is chosen or has the focus."""
        painter, look = QPainter(self), colours()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        strong = self._chosen or self.hasFocus()
        painter.setPen(pen(look.accent if strong else look.border, 2.5 if self._chosen else 1))
        painter.setBrush(colour(look.raised))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(1.5, 1.5, -1.5, -1.5), 4, 4)

    def changeEvent(self, event: QEvent) -> None:
        """Make room for larger words."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange and hasattr(self, "_low"):
            self.set_low(self._low)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose it."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.clicked.emit(self.card.candidate)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose it by Enter, pin it by P."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.clicked.emit(self.card.candidate)
        elif event.key() == Qt.Key.Key_P and self.pin.isEnabled():
            self.pin_requested.emit(self.card.candidate)
        else:
            super().keyPressEvent(event)


class HypothesesView(QWidget):
    """Cards in a row.

    Signals
    -------
    hypothesis_selected(candidate), pin_requested(candidate)
    """

    hypothesis_selected = Signal(int)
    pin_requested = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Hypotheses")
        self._sentence, self._key = QLabel(), TermKey()
        self._sentence.setWordWrap(True)
        self._row = QHBoxLayout()
        self._row.setContentsMargins(0, 0, 0, 0)
        inner = QWidget()
        inner.setLayout(self._row)
        self._scroll = QScrollArea()
        self._scroll.setAccessibleName("Answers side by side")
        self._scroll.setWidgetResizable(True)
        self._scroll.setFrameShape(QFrame.Shape.NoFrame)
        self._scroll.setWidget(inner)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(self._sentence)
        layout.addWidget(self._key)
        layout.addWidget(self._scroll, 1)
        self._cards: list[HypothesisCard] = []
        self.set_cards([])

    def set_cards(
        self, cards: Sequence[Hypothesis], pictures: Sequence[QImage | None] = (), sentence: str = ""
    ) -> None:
        """Show answers, the best first, each with a picture or None; ``sentence`` says how sure the first is."""
        while (item := self._row.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        self._sentence.setText(sentence if cards else "There are no hypotheses yet: run the stage Orientation.")
        self._key.set_terms(cards[0].terms if cards else ())
        highest = max((sum(term.value for term in card.terms) for card in cards), default=1.0)
        shown = [*pictures, *[None] * (len(cards) - len(pictures))]
        self._cards = [HypothesisCard(card, picture, highest) for card, picture in zip(cards, shown)]
        for made in self._cards:
            made.clicked.connect(self._choose)
            made.pin_requested.connect(self.pin_requested)
            self._row.addWidget(made)
        self._row.addStretch(1)
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the figures in sight where there is little height."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        for made in self._cards:
            made.set_low(self.height() < 24 * em(self))

    def cards(self) -> list[HypothesisCard]:
        """The cards, left to right."""
        return list(self._cards)

    def set_reasons(self, reasons: Mapping[int, str]) -> None:
        """Say of candidates why they cannot be pinned now, "" where they can."""
        for made in self._cards:
            made.set_reason(reasons.get(made.card.candidate, ""))

    def set_selected(self, candidate: int) -> None:
        """Frame the card of a candidate; nothing is emitted."""
        for made in self._cards:
            made.set_chosen(made.card.candidate == candidate)
            if made.card.candidate == candidate:
                self._scroll.ensureWidgetVisible(made)

    def sizeHint(self) -> QSize:
        """Three cards."""
        return QSize(round(47 * em(self)), round(26 * em(self)))

    def _choose(self, candidate: int) -> None:
        self.set_selected(candidate)
        self.hypothesis_selected.emit(candidate)
