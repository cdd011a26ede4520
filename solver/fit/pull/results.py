"""What a pull to landmarks leaves: whether it was earned, and which markers it drew to which landmarks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

EARNED = float(np.log(1000))
"""Logarithm of the likelihood ratio above which a layout is drawn to landmarks."""
State = Literal["earned", "by hand", "not earned", "given up", "off"]
"""Drawn because the layout earned it, or only where it was pinned; else not: for want of likelihood, because markers
turned out to lie too far beside the landmarks, or because the setting says so."""


@dataclass(frozen=True, eq=False)
class LandmarkPull:
    """Palpable landmarks that markers were taken to sit on.

    Attributes
    ----------
    state : whether markers were drawn to landmarks, and why or why not
    log_ratio : natural logarithm of how much likelier the places of the markers are with some of them on landmarks
        than with all of them anywhere, before any pull
    landmark : (M,) the likeliest landmark of each marker, "" where none has at least the least probability that counts
    probability : (M,) that it sits there, 0..1
    before, after : (M,) m, the marker's distance from that landmark before and after the pull; NaN where there is none
    spread : m, how far from the landmarks the markers were taken to be along each direction of the skin
    """

    state: State
    log_ratio: float
    landmark: tuple[str, ...]
    probability: np.ndarray
    before: np.ndarray
    after: np.ndarray
    spread: float = float("nan")

    @property
    def hits(self) -> int:
        """How many markers are likelier on their landmark than not."""
        return int((self.probability >= 0.5).sum())

    def over(self, used: np.ndarray, count: int) -> LandmarkPull:
        """The same for all ``count`` markers of a recording, of which these are the ``used`` ones (U,)."""
        names = np.full(count, "", dtype=object)
        names[used] = self.landmark
        whole = {"probability": np.zeros(count), "before": np.full(count, np.nan), "after": np.full(count, np.nan)}
        for name, values in whole.items():
            values[used] = getattr(self, name)
        return LandmarkPull(self.state, self.log_ratio, tuple(names), **whole, spread=self.spread)


def nothing_drawn(state: State, log_ratio: float, count: int, spread: float = float("nan")) -> LandmarkPull:
    """No marker drawn anywhere."""
    lost = np.full(count, np.nan)
    return LandmarkPull(state, log_ratio, ("",) * count, np.zeros(count), lost, lost.copy(), spread)


def summary(pull: LandmarkPull, labels: Sequence[str]) -> dict[str, Any]:
    """Plain values for a JSON document, one row for each marker that may sit on a landmark."""
    plain = [None if not np.isfinite(value) else float(value) for value in (pull.log_ratio, 1000 * pull.spread)]
    rows = [
        {
            "marker": m,
            "label": labels[m],
            "landmark": name,
            "probability": round(float(pull.probability[m]), 4),
            "before_mm": round(float(1000 * pull.before[m]), 2),
            "after_mm": round(float(1000 * pull.after[m]), 2),
        }
        for m, name in enumerate(pull.landmark)
        if name
    ]
    return {"state": pull.state, "log_ratio": plain[0], "spread_mm": plain[1], "markers": rows}


def words_of(pull: LandmarkPull) -> tuple[str, ...]:
    """Of each marker its landmark, how probable, and how far beside it was and is, for a table; "" for none."""
    return tuple(
        f"{name.replace('_', ' ')}, {100 * p:.0f} %, {1000 * then:.0f} to {1000 * now:.0f} mm" if name else ""
        for name, p, then, now in zip(pull.landmark, pull.probability, pull.before, pull.after, strict=True)
    )


def said(pull: LandmarkPull) -> str:
    """In words, for a line of text."""
    ratio = f"log likelihood ratio {pull.log_ratio:.1f}"
    drawn = f"{pull.hits} markers on bony landmarks"
    return {
        "earned": f"{drawn} ({ratio}, some {1000 * pull.spread:.0f} mm beside)",
        "by hand": f"{drawn} by hand",
        "not earned": f"no pull to bony landmarks ({ratio})",
        "given up": f"pull to bony landmarks given up: markers lie some {1000 * pull.spread:.0f} mm beside ({ratio})",
        "off": "pull to bony landmarks off",
    }[pull.state]
