"""The residuals of every fit in the store, so that stages, settings and methods are compared along the session."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.models.results import Ref, Results
from markerscope.app.models.signal import Signal
from markerscope.app.models.stages import StageBoard
from markerscope.solver.pipeline.names import FIT

MOST = 12
"""Fits that are compared at most, the newest: beyond that no eye tells the curves apart."""
CANDIDATE_COLOURS = 12
"""So many colours are those of the candidates, and come round again beyond that."""


def colour_places(board: StageBoard) -> dict[str, int]:
    """The place among the categorical colours of each fit in the store but the one shown, by key.

    The oldest comes first, so that a fit keeps its colour as further ones come; candidates have the colours before.
    """
    latest = board.latest("fit")
    keys = [entry.key for entry in board.results.entries("fit")[:MOST]]
    others = [key for key in reversed(keys) if latest is None or key != latest[0]]
    return {key: CANDIDATE_COLOURS + place for place, key in enumerate(others)}


@dataclass(frozen=True, eq=False)
class FitResidual:
    """How far a fit is from the markers: ``time`` (T,) s, ``residual`` (T, M) m, NaN where there is none."""

    time: np.ndarray
    residual: np.ndarray


class CachedFits:
    """Residuals by key, loaded in the background one after the other; poses are not kept.

    Attributes
    ----------
    known : by the fit's key, the newest first
    changed : emitted when there are others
    """

    def __init__(self, board: StageBoard) -> None:
        self.board = board
        self.changed: Signal[[]] = Signal()
        self.known: dict[str, FitResidual] = {}
        self._of: Results | None = None
        board.changed.connect(self.follow)

    def follow(self) -> None:
        """Have those that are in the store, and no others."""
        results, before = self.board.results, list(self.known)
        if results is not self._of:
            self._of, self.known = results, {}
            results.loaded.connect(self._loaded)
        keys = [entry.key for entry in results.entries("fit")][:MOST] if self.board.document.is_open else []
        found = {key: residual for key in keys if (residual := self._residual(key)) is not None}
        missing = [key for key in keys if key not in found]
        if missing:
            results.load_ahead("fit", missing[0])
        if list(found) != before:
            self.known = found
            self.changed.emit()

    def said(self, key: str) -> str:
        """What a fit was computed with that is not in force, in words; empty for the one in force."""
        earlier = next((row for row in self.board.card("fit").earlier if row.key == key), None)
        return "" if earlier is None or earlier.current else earlier.settings or f"of {earlier.when}"

    def _residual(self, key: str) -> FitResidual | None:
        known = self.known.get(key)
        if known is None and self.board.results.is_loaded("fit", key):
            motion = self.board.results.get(FIT, key)
            known = FitResidual(np.array(motion.time), motion.residual.astype(np.float32))
        return known

    def _loaded(self, ref: Ref) -> None:
        if ref.stage == "fit":
            self.follow()
