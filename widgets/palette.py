"""Colours that carry meaning: told apart by people who see red and green alike, on a light or a dark ground.

No Qt in here: whoever prepares what a widget draws may ask for colours, too.
"""

from __future__ import annotations

from functools import cache

import numpy as np

GAP = (150, 150, 155)
"""A marker that is not seen in this frame and was filled, or a stretch without data."""
LOST = (128, 128, 128)
"""No value: a marker without bone or cluster, a number that is NaN."""
SELECTED = (255, 0, 144)
"""What the user chose: drawn as a ring or a frame, so that the thing keeps its own colour."""
OUTLIER = (213, 94, 0)
"""A measurement that was taken out."""
GOOD, DOUBTFUL, BAD = (0, 158, 115), (230, 159, 0), (213, 94, 0)
"""Bluish green, orange, vermilion: always beside a word or a shape, never alone."""
LEFT, RIGHT = (0, 114, 178), (213, 94, 0)
"""Sides of the body."""

# Okabe and Ito's seven without black, then Tol's muted set where it is not one of them again.
_NAMED = (
    "0072b2 e69f00 009e73 cc79a7 56b4e9 d55e00 f0e442 882255 44aa99 999933 7d6bc8 ddcc77 aa4499 5f9e3c a0522d 88ccee"
)
_SCALES = {
    "viridis": "440154 472d7b 3b528b 2c728e 21918c 28ae80 5ec962 addc30 fde725",
    "cividis": "00224e 123570 3b496c 575d6d 707173 8a8678 a59c74 c3b369 e1cc55 fee838",
    "diverging": "364b9a 4a7bb7 6ea6cd 98cae1 c2e4ef eaeccc feda8b fdb366 f67e4b dd3d2d a50026",
    "grey": "1a1a1a f2f2f2",
}
SCALES = tuple(_SCALES)
"""Names that :func:`sequential` knows; ``diverging`` is for values about a middle."""


def categorical(n: int) -> np.ndarray:
    """(n, 3) uint8: colours for ``n`` kinds of things; the first 16 picked by hand, further ones their shades."""
    named = _parse(_NAMED)
    turn, index = np.divmod(np.arange(n), len(named))
    # Darker, then lighter, then darker still: by the third turn a label has to help.
    amount = np.array([0.0, -0.35, 0.45, -0.6, 0.7])[turn % 5][:, None]
    colours = np.where(amount < 0, named[index] * (1 + amount), named[index] + (255.0 - named[index]) * amount)
    return np.round(colours).astype(np.uint8)


def sequential(values: np.ndarray, lo: float, hi: float, name: str = "viridis") -> np.ndarray:
    """(n, 3) uint8: colours for numbers between ``lo`` and ``hi`` (beyond them: the end's colour; NaN: ``LOST``)."""
    table = scale_table(name)
    numbers = np.asarray(values, dtype=float)
    span = hi - lo if hi > lo else 1.0
    with np.errstate(invalid="ignore"):
        index = np.clip((numbers - lo) / span, 0.0, 1.0) * (len(table) - 1)
    lost = ~np.isfinite(index)
    colours = table[np.round(np.where(lost, 0.0, index)).astype(int)]
    colours[lost] = LOST
    return colours


@cache
def scale_table(name: str = "viridis") -> np.ndarray:
    """(256, 3) uint8: a colour scale as a look-up table, low values first. Do not write into it."""
    stops = _parse(_SCALES[name])
    at = np.linspace(0, len(stops) - 1, 256)
    table = np.stack([np.interp(at, np.arange(len(stops)), stops[:, c]) for c in range(3)], axis=1)
    table = np.round(table).astype(np.uint8)
    table.flags.writeable = False
    return table


def text_on(colour: tuple[int, int, int] | np.ndarray) -> tuple[int, int, int]:
    """Black or white, whichever is read better on ``colour``."""
    return (0, 0, 0) if luminance(colour) > 0.179 else (255, 255, 255)


def luminance(colour: tuple[int, int, int] | np.ndarray) -> float:
    """Relative luminance of an sRGB colour by WCAG 2, 0 to 1."""
    part = np.asarray(colour, dtype=float)[:3] / 255.0
    linear = np.where(part <= 0.03928, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    return float(linear @ np.array([0.2126, 0.7152, 0.0722]))


def contrast(a: tuple[int, int, int] | np.ndarray, b: tuple[int, int, int] | np.ndarray) -> float:
    """Contrast ratio of two colours by WCAG 2, 1 to 21."""
    low, high = sorted((luminance(a), luminance(b)))
    return (high + 0.05) / (low + 0.05)


def _parse(words: str) -> np.ndarray:
    return np.array([[int(word[i : i + 2], 16) for i in (0, 2, 4)] for word in words.split()], dtype=float)
