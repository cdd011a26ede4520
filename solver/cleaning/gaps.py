"""Gaps of trajectories: where they are, and what filled them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.cleaning.request import Method


@dataclass(frozen=True)
class Gap:
    """A span in which a marker was lost; frames from 0, both inclusive."""

    marker: int
    first: int
    last: int

    @property
    def length(self) -> int:
        """Frames."""
        return self.last - self.first + 1


@dataclass(frozen=True)
class Fill:
    """A span that was filled.

    Attributes
    ----------
    marker : index
    first, last : frames from 0, both inclusive
    method : what filled it; the default falls back to others where it cannot be used
    confidence : 0..1, falls as ``error`` rises
    error : m, distance from the truth to be expected on average over the span
    by_hand : whether the user asked for it
    """

    marker: int
    first: int
    last: int
    method: str
    confidence: float
    error: float
    by_hand: bool = False

    @property
    def length(self) -> int:
        """Frames."""
        return self.last - self.first + 1


@dataclass(frozen=True, eq=False)
class Filled:
    """Trajectories after filling.

    Attributes
    ----------
    positions : (T, M, 3) m, NaN where nothing can be known
    filled : (T, M) True where a position was filled
    fills : by marker, then by frame
    notes : what is to be known of the way they were filled, one sentence each
    """

    positions: np.ndarray
    filled: np.ndarray
    fills: tuple[Fill, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FillSettings:
    """How gaps are filled.

    Attributes
    ----------
    method : the first to be tried
    max_gap : s, longer gaps stay; None fills whatever can be told
    min_confidence : 0..1, gaps whose filling would be surer than this are filled
    neighbours : markers that a gap is filled from, at most, with the methods that use several
    only : the one gap that is wanted; None for all
    """

    method: Method = "regression"
    max_gap: float | None = 5.0
    min_confidence: float = 0.2
    neighbours: int = 10
    only: Gap | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        if self.max_gap is not None and not self.max_gap >= 0:
            raise ValueError(f"max_gap is {self.max_gap:g} and has to be 0 or above")
        if not 0 <= self.min_confidence <= 1:
            raise ValueError(f"min_confidence is {self.min_confidence:g} and has to be between 0 and 1")
        if self.neighbours < 3:
            raise ValueError(f"neighbours is {self.neighbours} and has to be 3 or more")


FillMethod = Callable[[np.ndarray, float, FillSettings], Filled]
"""``(positions (T, M, 3) m with NaN = lost, rate in Hz, settings) -> Filled``: what every way of filling is."""

_TRUSTED_M = 0.02
"""Expected error at which the confidence has fallen to 1/e."""


def confidence_of(error: float) -> float:
    """Confidence of a filling whose expected error is ``error`` m."""
    return float(np.exp(-error / _TRUSTED_M)) if np.isfinite(error) else 0.0


def find_gaps(present: np.ndarray) -> list[Gap]:
    """Every span in which a marker that is seen at some time is lost, by marker, then by frame.

    Parameters
    ----------
    present : (T, M) True where seen
    """
    padded = np.zeros((present.shape[1], len(present) + 2), dtype=np.int8)
    padded[:, 1:-1] = ~present.T
    change = np.diff(padded, axis=1)
    marker, first = np.nonzero(change == 1)
    _, after = np.nonzero(change == -1)
    ever = np.asarray(present.any(axis=0))
    return [Gap(int(m), int(f), int(a) - 1) for m, f, a in zip(marker, first, after) if ever[m]]


def gaps_to_fill(present: np.ndarray, rate: float, settings: FillSettings) -> list[Gap]:
    """The gaps that are not too long, and wanted."""
    longest = np.inf if settings.max_gap is None else settings.max_gap * rate + 1e-6
    return [gap for gap in find_gaps(present) if gap.length <= longest and settings.only in (None, gap)]


def together(positions: np.ndarray, parts: list[tuple[Fill, np.ndarray]], settings: FillSettings) -> Filled:
    """The trajectories with those fills put in that are sure enough.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    parts : each fill with its (frames of the span, 3) m; not finite ones are dropped
    """
    out, filled = positions.copy(), np.zeros(positions.shape[:2], dtype=bool)
    kept = []
    for fill, values in parts:
        fill = replace(fill, confidence=confidence_of(fill.error))
        if fill.confidence < settings.min_confidence or not np.isfinite(values).all():
            continue
        span = slice(fill.first, fill.last + 1)
        out[span, fill.marker], filled[span, fill.marker] = values, True
        kept.append(fill)
    return Filled(out, filled, tuple(sorted(kept, key=lambda fill: (fill.marker, fill.first))))
