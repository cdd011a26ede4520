"""What the colours mean: kinds, or a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markerscope.widgets.colour_bar import ColourBar

Rgb = tuple[int, int, int]


@dataclass(frozen=True)
class Legend:
    """A title, and either kinds (words and colour) or a scale; ``also`` comes below it."""

    title: str
    entries: Sequence[tuple[str, Rgb]] | ColourBar
    also: Legend | None = None
