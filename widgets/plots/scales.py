"""Ticks and numbers on axes; no Qt."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

HEADING = "Which way the camera looks about the vertical, as found; 0 along the lab's first axis, 90 along its second"
"""What the camera's heading of an answer means."""


def nice_step(rough: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is not below ``rough``."""
    if not rough > 0 or not math.isfinite(rough):
        return 1.0
    power = 10.0 ** math.floor(math.log10(rough))
    return next(power * k for k in (1, 2, 5, 10) if power * k >= rough * (1 - 1e-9))


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between two ends, at most about ``most`` of them."""
    if not high > low:
        return [low]
    step = nice_step((high - low) / max(most, 1))
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def log_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Powers of ten between two positive ends, with 2 and 5 between them where there is room."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    decades = range(first, last + 1)
    tried = [[(p, k) for p in decades for k in inner] for inner in ((1, 2, 5), (1, 3), (1,))]
    tried += [[(p, 1) for p in decades[shift::stride]] for stride in range(2, len(decades)) for shift in range(stride)]
    for parts in tried:
        found = [k * 10.0**p for p, k in parts if low * (1 - 1e-9) <= k * 10.0**p <= high * (1 + 1e-9)]
        if 2 <= len(found) <= most:
            return found
    # Within less than a decade there may be none of them: round numbers then, however they are spaced.
    return ticks(low, high, max(2, min(most, 4)))


def number(value: float, step: float | None = None) -> str:
    """A number with the digits that its neighbours on the axis (``step`` apart) need."""
    if value is None or not math.isfinite(value):
        return "–"
    if step:
        digits = max(0, -math.floor(math.log10(abs(step)) + 1e-9))
        text = f"{value:.{digits}f}"
    elif value and (abs(value) >= 1e5 or abs(value) < 1e-3):
        text = f"{value:.1e}"
    else:
        text = f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    if float(text.replace("−", "-")) == 0:
        text = text.lstrip("-")
    return text.replace("-", "−")


def figure(value: float) -> str:
    """A number of three digits, so that those below each other are alike: "31.0" beside "30.4", "107", never "107."."""
    if value is None or not 1e-3 <= abs(value) < 1e5:
        return number(value)
    if abs(value) >= 999.5:
        return f"{value:.0f}".replace("-", "−")
    return f"{value:#.3g}".rstrip(".").replace("-", "−")


def degrees(value: float) -> str:
    """A direction about the vertical as a whole number from −179 to 180."""
    if value is None or not math.isfinite(value):
        return "–"
    return number(180.0 - (180.0 - round(value)) % 360.0, 1)


def clock(seconds: float, step: float = 0.01) -> str:
    """A time as seconds below a minute, as minutes and seconds beyond."""
    digits = max(0, -math.floor(math.log10(step) + 1e-9)) if step < 1 else 0
    sign = "−" if seconds < 0 and round(abs(seconds), digits) > 0 else ""
    seconds = round(abs(seconds), digits)
    if seconds < 60:
        return f"{sign}{seconds:.{digits}f} s"
    minutes = int(seconds // 60)
    width = digits + 3 if digits else 2
    return f"{sign}{minutes}:{seconds - 60 * minutes:0{width}.{digits}f}"


def time_ticks(low: float, high: float, most: int) -> tuple[list[float], float]:
    """Ticks of a clock, and how far apart they are: round in minutes and seconds."""
    rough = (high - low) / max(most, 1)
    rounds = (5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)
    step = next((s for s in rounds if rough > 2 and s >= rough), nice_step(rough))
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)], step


@dataclass(frozen=True)
class Scale:
    """Values to pixels along one direction.

    Attributes
    ----------
    low, high : ends in the unit of the values
    start, end : the pixels they fall on; ``end < start`` for an axis that points up
    log : True for a logarithmic axis
    """

    low: float
    high: float
    start: float
    end: float
    log: bool = False

    def pixel(self, value: np.ndarray | float) -> np.ndarray:
        """Where a value is drawn."""
        low, high = (math.log10(self.low), math.log10(self.high)) if self.log else (self.low, self.high)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.log10(value) if self.log else np.asarray(value, float)
        return self.start + (values - low) * ((self.end - self.start) / ((high - low) or 1.0))

    def at(self, value: float) -> float:
        """Where one value is drawn."""
        return float(self.pixel(value))

    def value(self, pixel: float) -> float:
        """What is drawn at a pixel."""
        part = (pixel - self.start) / ((self.end - self.start) or 1.0)
        if self.log:
            low, high = math.log10(self.low), math.log10(self.high)
            return float(10.0 ** (low + part * (high - low)))
        return self.low + part * (self.high - self.low)

    def ticks(self, apart: float) -> list[float]:
        """Round values about ``apart`` pixels from each other."""
        most = max(2, int(abs(self.end - self.start) / max(apart, 1)))
        if self.log:
            return log_ticks(self.low, self.high, most)
        # One number alone tells no scale, so there are two however low the plot is.
        tried = (ticks(self.low, self.high, more) for more in range(most, most + 4))
        return next((found for found in tried if len(found) > 1), ticks(self.low, self.high, most))


def limits(values: list[np.ndarray], lowest: float | None = None, room: float = 0.05) -> tuple[float, float]:
    """Ends of an axis that holds all finite values, with some room."""
    finite = [v[np.isfinite(v)] for v in values]
    finite = [v for v in finite if v.size]
    if not finite:
        return (0.0, 1.0) if lowest is None else (lowest, lowest + 1.0)
    low, high = min(float(v.min()) for v in finite), max(float(v.max()) for v in finite)
    if lowest is not None:
        low = min(low, lowest)
    span = (high - low) or abs(high) or 1.0
    return (low if lowest is not None and low >= lowest else low - room * span), high + room * span
