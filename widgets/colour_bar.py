"""A scale of colours, as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ColourBar:
    """A scale of colours from ``lo`` to ``hi`` in ``unit``; ``name`` is one of
    :data:`markerscope.widgets.palette.SCALES`.
    """

    lo: float
    hi: float
    unit: str
    name: str = "viridis"

    def ticks(self) -> list[tuple[float, str]]:
        """Shares of the bar, 0 to 1, and what stands there."""
        span = max(abs(self.lo), abs(self.hi), abs(self.hi - self.lo))
        digits = 0 if span >= 20 else 1 if span >= 2 else 2 if span >= 0.2 else 3
        middle = 0.5 * (self.lo + self.hi)
        return [(share, f"{value:.{digits}f}") for share, value in ((0.0, self.lo), (0.5, middle), (1.0, self.hi))]
