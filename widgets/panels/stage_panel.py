"""The stages of the method below each other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from PySide6.QtCore import QEvent, QObject, QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QScrollArea, QVBoxLayout, QWidget

from markerscope.widgets.panels.stage_card import StageCard
from markerscope.widgets.panels.stage_data import StageData, StageProgress


class StagePanel(QScrollArea):
    """A card for every stage; its signals are those of :class:`StageCard`."""

    run = Signal(str)
    run_to = Signal(str)
    stop = Signal()
    setting_changed = Signal(str, str, object)
    earlier_chosen = Signal(str, str)
    compare_toggled = Signal(str, str, bool)
    opened = Signal(str, bool)
    check_chosen = Signal(str, int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Stages")
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self._inner = QWidget()
        self._layout = QVBoxLayout(self._inner)
        self._layout.setContentsMargins(6, 6, 6, 6)
        self._layout.setSpacing(6)
        self._layout.addStretch(1)
        self.setWidget(self._inner)
        self._cards: dict[str, StageCard] = {}
        self._to_open: frozenset[str] | None = None
        self._least_width = 0

    def set_stages(self, stages: Sequence[StageData]) -> None:
        """Show these, in order; cards of stages that stay are kept, with what is open in them."""
        if [stage.name for stage in stages] != list(self._cards):
            for name in self._cards.keys() - {stage.name for stage in stages}:
                self._cards.pop(name).deleteLater()
            cards = {stage.name: self._cards.get(stage.name) or self._new(stage.name) for stage in stages}
            for row, card in enumerate(cards.values()):
                self._layout.removeWidget(card)
                self._layout.insertWidget(row, card)
            self._cards = cards
        for stage in stages:
            self._cards[stage.name].set_data(stage)
        if self._to_open is not None and self._cards:
            wanted, self._to_open = self._to_open, None
            self.set_open_cards(wanted)

    def set_progress(self, name: str, progress: StageProgress) -> None:
        """Show how far a running stage is."""
        if name in self._cards:
            self._cards[name].set_progress(progress)

    def card(self, name: str) -> StageCard:
        """The card of a stage."""
        return self._cards[name]

    def open_cards(self) -> list[str]:
        """Stages whose cards are open, in order."""
        return [name for name, card in self._cards.items() if card.is_open()]

    def set_open_cards(self, names: Iterable[str]) -> None:
        """Have these open and no others; of stages that are not shown yet, once they are."""
        wanted = frozenset(names)
        if not self._cards:
            self._to_open = wanted
        for name, card in self._cards.items():
            card.set_open(name in wanted)

    def show_stage(self, name: str) -> None:
        """Open a stage's card and bring it into sight."""
        self._cards[name].set_open(True)
        self.ensureWidgetVisible(self._cards[name])

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Ask for the width that the cards need now: nothing of them may be out of sight."""
        if watched is self._inner and event.type() == QEvent.Type.LayoutRequest:
            width = self.minimumSizeHint().width()
            if width != self._least_width:  # asking lays the whole window out anew
                self._least_width = width
                self.updateGeometry()
        return super().eventFilter(watched, event)

    def sizeHint(self) -> QSize:
        """A column."""
        return QSize(26 * self.fontMetrics().height(), 40 * self.fontMetrics().height())

    def minimumSizeHint(self) -> QSize:
        """Wide enough for every button."""
        return QSize(self._inner.minimumSizeHint().width() + 24, 8 * self.fontMetrics().height())

    def _new(self, name: str) -> StageCard:
        card = StageCard(name)
        for signal in (
            "run", "run_to", "stop", "setting_changed", "earlier_chosen", "compare_toggled", "opened", "check_chosen",
        ):  # fmt: skip
            getattr(card, signal).connect(getattr(self, signal))
        return card
