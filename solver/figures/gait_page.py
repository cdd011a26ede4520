"""The usual page of gait curves: a row a joint, a column a plane, both sides over each other, controls behind."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from markerscope.solver.cycles.curve import CutCurve
from markerscope.solver.cycles.scores import Bands, band_for
from markerscope.solver.figures.drawing import Colour, Line, Page, Text

LEFT: Colour = (0.78, 0.10, 0.13)
RIGHT: Colour = (0.07, 0.33, 0.70)
_GREY: Colour = (0.72, 0.72, 0.72)
_INK: Colour = (0.13, 0.13, 0.13)
_SOFT: Colour = (0.45, 0.45, 0.45)
_COLOURS = {"left": LEFT, "right": RIGHT}
PANELS: tuple[tuple[tuple[str, str, str, str], ...], ...] = (
    (
        ("pelvic_tilt", "Pelvic tilt", "post", "ant"),
        ("pelvic_obliquity", "Pelvic obliquity", "down", "up"),
        ("pelvic_rotation", "Pelvic rotation", "back", "forw"),
    ),
    (
        ("hip_flexion", "Hip flexion", "ext", "flex"),
        ("hip_adduction", "Hip adduction", "abd", "add"),
        ("hip_rotation", "Hip rotation", "ext", "int"),
    ),
    (
        ("knee_flexion", "Knee flexion", "ext", "flex"),
        ("knee_varus", "Knee varus", "valg", "var"),
        ("knee_rotation", "Knee rotation", "ext", "int"),
    ),
    (
        ("ankle_dorsiflexion", "Ankle dorsiflexion", "plant", "dors"),
        ("ankle_inversion", "Ankle inversion", "ever", "inv"),
        ("foot_progression", "Foot progression", "ext", "int"),
    ),
    (
        ("trunk_flexion", "Trunk flexion", "ext", "flex"),
        ("trunk_bending", "Trunk bending", "away", "to side"),
        ("trunk_rotation", "Trunk rotation", "away", "to side"),
    ),
)
"""Rows of panels: quantity, title, and what its values mean at the lower and the upper end."""
_COLUMNS = ("sagittal", "frontal", "transverse")
_LEAST_SPAN = 20.0


def gait_page(
    curves: Sequence[CutCurve], title: str, bands: Bands | None = None, *, width_mm: float = 180.0, note: str = ""
) -> Page:
    """The page: mean curves, one SD of the cycles about them, foot off as a line, controls (mean and SD) in grey.

    Parameters
    ----------
    curves : of both sides, by the names of ``PANELS``; others are not shown
    width_mm : as journals want them: 85, 120, 180
    note : a line at the foot of the page
    """
    by_name = {(curve.name, curve.side): curve for curve in curves}
    shown = [row for row in PANELS if any((panel[0], side) in by_name for panel in row for side in _COLOURS)]
    width = width_mm * 72 / 25.4
    size = float(np.clip(width / 64, 5.0, 8.0))
    left, top, gap = 4.4 * size, 7.4 * size, 3.8 * size
    across = (width - left - 0.8 * size - 2 * gap) / 3
    high = 0.62 * across
    row_step = high + 3.0 * size
    height = top + row_step * len(shown) + (2.2 * size if note else 0.8 * size)
    items: list[Line | Text] = [Text(left, 1.5 * size, title, 1.2 * size, bold=True, colour=_INK)]
    items += _legend(left, 3.1 * size, size, curves, bands)
    for j, name in enumerate(_COLUMNS):
        x = left + j * (across + gap)
        items.append(Text(x + across / 2, top - 2.2 * size, name, size, "middle", _SOFT))
    for i, row in enumerate(shown):
        for j, panel in enumerate(row):
            frame = (left + j * (across + gap), top + i * row_step, across, high)
            items += _panel(panel, frame, size, by_name, bands, last=i == len(shown) - 1)
    if note:
        items.append(Text(left, height - 0.8 * size, note, 0.9 * size, colour=_SOFT))
    return Page(width, height, tuple(items), title)


def _legend(x: float, y: float, size: float, curves: Sequence[CutCurve], bands: Bands | None) -> list[Line | Text]:
    items: list[Line | Text] = []
    for side, colour in _COLOURS.items():
        count = max((len(c.values) for c in curves if c.side == side), default=0)
        items.append(Line(np.array([[x, y - 0.3 * size], [x + 1.8 * size, y - 0.3 * size]]), colour, 1.2))
        text = f"{side} ({count} cycle{'' if count == 1 else 's'})"
        items.append(Text(x + 2.2 * size, y, text, size, colour=_INK))
        x += 11.5 * size
    if bands:
        box = np.array([[x, y - 0.7 * size], [x + 1.8 * size, y - 0.7 * size], [x + 1.8 * size, y], [x, y]])
        items.append(Line(box, fill=_GREY, opacity=0.6))
        count = max(band.count for band in bands.values())
        whose = f"controls, mean and SD ({count} people)" if count else "controls, mean and SD"
        items.append(Text(x + 2.2 * size, y, whose, size, colour=_INK))
    return items


def _panel(
    panel: tuple[str, str, str, str],
    frame: tuple[float, float, float, float],
    size: float,
    by_name: dict[tuple[str, str], CutCurve],
    bands: Bands | None,
    last: bool,
) -> list[Line | Text]:
    name, title, lower, upper = panel
    x, y, wide, high = frame
    own = {side: by_name[name, side] for side in _COLOURS if (name, side) in by_name}
    items: list[Line | Text] = [Text(x, y - 0.5 * size, title, size, bold=True, colour=_INK)]
    behind = {side: band for side in _COLOURS if bands and (band := band_for(bands, name, side)) is not None}
    if not own:
        return [*items, Text(x + wide / 2, y + high / 2, "not known", size, "middle", _SOFT)]
    low, top = _range([c.summary.mean for c in own.values()], [c.summary.sd for c in own.values()], behind)
    percent = x + wide * np.linspace(0, 1, 101)

    def at(values: np.ndarray) -> np.ndarray:
        return np.asarray(y + high * (top - values) / (top - low))

    for tick in _ticks(low, top):
        yy = float(at(np.array(tick)))
        colour = _SOFT if tick == 0 else (0.88, 0.88, 0.88)
        items.append(Line(np.array([[x, yy], [x + wide, yy]]), colour, 0.4))
        items.append(Text(x - 0.4 * size, yy + 0.35 * size, f"{tick:g}", 0.85 * size, "end", _INK))
    items.append(Text(x - 2.5 * size, y + high, lower, 0.8 * size, "start", _SOFT, turned=True))
    items.append(Text(x - 2.5 * size, y, upper, 0.8 * size, "end", _SOFT, turned=True))
    drawn = {id(band): band for band in behind.values()}
    for band in drawn.values():
        items.append(Line(_area(percent, at(band.mean - band.sd), at(band.mean + band.sd)), fill=_GREY, opacity=0.6))
    for side, curve in own.items():
        mean, sd = curve.summary.mean, curve.summary.sd
        if np.isfinite(sd).any():
            items.append(Line(_area(percent, at(mean - sd), at(mean + sd)), fill=_COLOURS[side], opacity=0.18))
    for side, curve in own.items():
        items.append(Line(np.stack([percent, at(curve.summary.mean)], axis=1), _COLOURS[side], 1.1))
        offs = [cycle.percent(cycle.off) for cycle in curve.cycles if np.isfinite(cycle.off)]
        if offs:
            xx = x + wide * float(np.mean(offs)) / 100
            items.append(Line(np.array([[xx, y], [xx, y + high]]), _COLOURS[side], 0.6, (2.0, 1.5)))
    corners = np.array([[x, y], [x + wide, y], [x + wide, y + high], [x, y + high], [x, y]])
    items.append(Line(corners, _SOFT, 0.5))
    for tick in (0, 50, 100):
        xx = x + wide * tick / 100
        items.append(Text(xx, y + high + 1.1 * size, f"{tick}", 0.85 * size, "middle", _INK))
    if last:
        items.append(Text(x + wide / 2, y + high + 2.2 * size, "% of gait cycle", 0.85 * size, "middle", _SOFT))
    return items


def _range(means: list[np.ndarray], sds: list[np.ndarray], bands: object) -> tuple[float, float]:
    edges = [mean + sign * np.nan_to_num(sd) for mean, sd in zip(means, sds) for sign in (-1, 1)]
    if isinstance(bands, dict):
        edges += [band.mean + sign * np.nan_to_num(band.sd) for band in bands.values() for sign in (-1, 1)]
    known = np.concatenate(edges)
    known = known[np.isfinite(known)]
    if not len(known):
        return -10.0, 10.0
    low, high = float(known.min()), float(known.max())
    pad = max(0.06 * (high - low), (_LEAST_SPAN - (high - low)) / 2, 0.5)
    return low - pad, high + pad


def _ticks(low: float, high: float) -> list[float]:
    step = next(s for s in (5, 10, 20, 30, 60, 120, 360) if (high - low) / s <= 5 or s == 360)
    return [float(t) for t in np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step + 0.0]


def _area(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The outline between two curves, where both are known."""
    known = np.isfinite(low) & np.isfinite(high)
    return np.concatenate([np.stack([x, high], axis=1)[known], np.stack([x, low], axis=1)[known][::-1]])
