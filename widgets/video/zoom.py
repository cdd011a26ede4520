"""Which part of a picture is seen where, as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

LARGEST = 40.0
"""Pixels of the widget to one of the picture, at most."""


@dataclass(frozen=True)
class Zoom:
    """The place of a picture in a widget.

    Attributes
    ----------
    picture, widget : (width, height) px
    zoomed : pixels of the widget to one of the picture, as chosen; 0 while the picture is fitted
    middle : (x, y) px of the picture that is in the middle of the widget, where it is not fitted
    """

    picture: tuple[int, int] = (1, 1)
    widget: tuple[int, int] = (1, 1)
    zoomed: float = 0.0
    middle: tuple[float, float] = (0.0, 0.0)

    @property
    def fit(self) -> float:
        """The scale at which the whole picture is seen."""
        return max(1e-6, min(self.widget[0] / self.picture[0], self.widget[1] / self.picture[1]))

    @property
    def scale(self) -> float:
        """Pixels of the widget to one of the picture."""
        return self.zoomed or self.fit

    @property
    def centre(self) -> np.ndarray:
        """(2) px of the picture in the middle of the widget."""
        return np.array(self.middle) if self.zoomed else 0.5 * np.array(self.picture, dtype=float)

    def to_widget(self, pixels: np.ndarray) -> np.ndarray:
        """(N, 2) from pixels of the picture (N, 2)."""
        return self.scale * (np.asarray(pixels, dtype=float) - self.centre) + 0.5 * np.array(self.widget, dtype=float)

    def to_frame(self, points: np.ndarray) -> np.ndarray:
        """(N, 2) pixels of the picture from points of the widget (N, 2)."""
        return (np.asarray(points, dtype=float) - 0.5 * np.array(self.widget, dtype=float)) / self.scale + self.centre

    def nearer(self, factor: float, at: tuple[float, float]) -> Zoom:
        """Scaled by ``factor``, with what is at a point of the widget staying there; fitted where all would be seen."""
        scale = min(self.scale * factor, max(LARGEST, self.fit))
        if scale <= self.fit * 1.0001:
            return self.fitted()
        held = self.to_frame(np.array(at))
        middle = held - (np.array(at) - 0.5 * np.array(self.widget, dtype=float)) / scale
        return replace(self, zoomed=float(scale), middle=self._inside(middle))

    def panned(self, right: float, down: float) -> Zoom:
        """Moved by pixels of the widget; a fitted picture stays."""
        if not self.zoomed:
            return self
        return replace(self, middle=self._inside(self.centre - np.array([right, down]) / self.scale))

    def fitted(self) -> Zoom:
        """With the whole picture seen."""
        return replace(self, zoomed=0.0, middle=(0.0, 0.0))

    def resized(self, widget: tuple[int, int]) -> Zoom:
        """In a widget of another size."""
        other = replace(self, widget=(max(1, widget[0]), max(1, widget[1])))
        return other.fitted() if self.zoomed and self.zoomed <= other.fit else other

    def state(self) -> dict[str, Any]:
        """Plain numbers, for a file."""
        return {"scale": self.zoomed, "centre": list(self.middle)}

    def of_state(self, state: Mapping[str, Any]) -> Zoom:
        """The same picture as at :meth:`state`; fitted where that is no state."""
        try:
            scale = float(state.get("scale", 0.0))
            x, y = (float(v) for v in state.get("centre", (0.0, 0.0)))
        except (TypeError, ValueError):
            return self.fitted()
        if not (np.isfinite([scale, x, y]).all() and 0 < scale <= max(LARGEST, self.fit)):
            return self.fitted()
        return replace(self, zoomed=scale, middle=(x, y))

    def _inside(self, middle: np.ndarray) -> tuple[float, float]:
        x, y = np.clip(middle, 0.0, self.picture)
        return float(x), float(y)
