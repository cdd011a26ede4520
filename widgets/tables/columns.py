"""What a column of a table shows; no Qt."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, eq=False)
class Column:
    """One column.

    Attributes
    ----------
    title, unit : in the header
    values : one a row, as shown (mm, not m); NaN and None mean that there is none
    format : of a number, as in f-strings, or a function from value to text
    tooltip : what the column means
    left : True to put it left; words are anyway
    bar : values of an empty and of a full bar behind the number, None for no bar
    colours : (N, 3) uint8 of a swatch before the text
    tips : one a row, for the tooltip of its cell
    none : what stands where there is no value
    """

    title: str
    values: Sequence[Any] | np.ndarray
    unit: str = ""
    format: str | Callable[[Any], str] = ""
    tooltip: str = ""
    left: bool = False
    bar: tuple[float, float] | None = None
    colours: np.ndarray | None = None
    tips: Sequence[str] = ()
    none: str = "–"

    @property
    def heading(self) -> str:
        """Title over unit."""
        return f"{self.title}\n{self.unit}" if self.unit else self.title

    def text(self, row: int) -> str:
        """A value as it is shown."""
        value = self.values[row]
        if absent(value):
            return self.none
        if callable(self.format):
            return self.format(value)
        if isinstance(value, bool | np.bool_):
            return "yes" if value else "no"
        if isinstance(value, float | np.floating):
            return format(float(value), self.format or ".3g").replace("-", "−")
        if isinstance(value, int | np.integer):
            return format(int(value), self.format or "d").replace("-", "−")
        return str(value)

    def is_number(self, row: int) -> bool:
        """Whether the value is put right and sorted as a number."""
        return isinstance(self.values[row], int | float | np.integer | np.floating) and not self.left

    def filled(self, row: int) -> float | None:
        """How full the bar of a row is, 0..1."""
        value = self.values[row]
        if self.bar is None or absent(value) or not math.isfinite(float(value)):
            return None
        low, high = self.bar
        return min(max((float(value) - low) / ((high - low) or 1.0), 0.0), 1.0)


def absent(value: object) -> bool:
    """Whether there is no value."""
    return value is None or (isinstance(value, float | np.floating) and math.isnan(float(value)))


def natural(text: str) -> tuple:
    """Order in which M2 comes before M10."""
    parts: list[tuple[int, int, str]] = []
    digits = ""
    for sign in [*text.casefold(), ""]:
        if sign.isdigit():
            digits += sign
            continue
        if digits:
            parts.append((0, int(digits), ""))
            digits = ""
        if sign:
            parts.append((1, 0, sign))
    return tuple(parts)
