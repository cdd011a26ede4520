"""What the next cleaning will fill as decided by hand: shown as soon as it is decided, computed beside the window."""

from __future__ import annotations

import threading

import numpy as np

from markerscope.app.models.signal import Signal
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.fill_by_hand import parts_by_hand
from markerscope.solver.cleaning.gaps import Fill

Parts = tuple[tuple[Fill, np.ndarray], ...]


class PendingFills:
    """The fills by hand of some markers, as the trajectories of now would have them.

    Attributes
    ----------
    parts : each fill with its (L, 3) m; empty while they are made
    changed : emitted by ``poll`` when they have arrived
    """

    def __init__(self) -> None:
        self.parts: Parts = ()
        self.changed: Signal[[]] = Signal()
        self._asked: tuple[Working, frozenset[int]] | None = None
        self._arrived: Parts | None = None
        self._lock = threading.Lock()
        self._turn = 0

    @property
    def busy(self) -> bool:
        """Whether some are on their way."""
        return self._waits

    _waits = False

    def ask(self, work: Working | None, markers: frozenset[int]) -> None:
        """Have those of some markers made; the same ones are not made again."""
        known = self._asked
        if known is not None and known[0] is work and known[1] == markers:
            return
        with self._lock:
            self._turn += 1
            self._arrived, turn = None, self._turn
        self._asked, self.parts, self._waits = None, (), False
        if work is None:
            return
        self._asked = work, markers
        fills = [row for row in work.settings.fills if row[0] in markers]
        placed = [row for row in work.settings.placed if row.marker in markers]
        if not fills and not placed:
            return
        self._waits = True

        def make() -> None:
            try:
                parts, _ = parts_by_hand(work.measured, fills, placed)
            except Exception:  # the cleaning makes the same, and says what is wrong
                parts = []
            with self._lock:
                if turn == self._turn:
                    self._arrived = tuple(parts)

        threading.Thread(target=make, name="fills", daemon=True).start()

    def poll(self) -> bool:
        """Take what has arrived; returns whether there was something."""
        with self._lock:
            arrived, self._arrived = self._arrived, None
        if arrived is None:
            return False
        self.parts, self._waits = arrived, False
        self.changed.emit()
        return True
