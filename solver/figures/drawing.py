"""A page of lines, areas and text, in points (1/72 inch) from its upper left corner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Colour = tuple[float, float, float]
Anchor = Literal["start", "middle", "end"]
_WIDTHS = (
    "278 278 355 556 556 889 667 191 333 333 389 584 278 333 278 278 556 556 556 556 556 556 556 556 556 556 278 278 "
    "584 584 584 556 1015 667 667 722 722 667 611 778 722 278 500 667 556 833 722 778 667 778 722 667 611 722 667 944 "
    "667 667 611 278 278 278 469 556 333 556 556 500 556 556 278 556 556 222 222 500 222 833 556 556 556 556 333 500 "
    "278 556 500 722 500 500 500 334 260 334 584"
).split()
"""Widths of Helvetica's characters 32 to 126, thousandths of the size, as its metrics give them."""


@dataclass(frozen=True, eq=False)
class Line:
    """A line through (N, 2) points, or a closed area where ``fill`` is given; NaN breaks a line."""

    points: np.ndarray
    colour: Colour = (0.0, 0.0, 0.0)
    width: float = 0.75
    dash: tuple[float, ...] = ()
    fill: Colour | None = None
    opacity: float = 1.0


@dataclass(frozen=True)
class Text:
    """Text on a baseline; ``turned`` reads upwards."""

    x: float
    y: float
    text: str
    size: float = 8.0
    anchor: Anchor = "start"
    colour: Colour = (0.0, 0.0, 0.0)
    bold: bool = False
    turned: bool = False


@dataclass(frozen=True, eq=False)
class Page:
    """A drawing: its size in points, and what is on it, from back to front."""

    width: float
    height: float
    items: tuple[Line | Text, ...]
    title: str = ""


def text_width(text: str, size: float) -> float:
    """Points that a text takes in Helvetica."""
    return size * sum(int(_WIDTHS[ord(c) - 32]) if 32 <= ord(c) <= 126 else 556 for c in text) / 1000


def pieces(points: np.ndarray) -> Sequence[np.ndarray]:
    """The parts of a line between NaN."""
    known = np.isfinite(points).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
    return [points[a:b] for a, b in zip(edges[::2], edges[1::2])]
