"""Examples of the plots."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QWidget

from widgets import palette
from widgets.plots.rows import Curve, CurveRow, OffsetRow, PresenceRow, StateRow
from widgets.plots.timelines import Timelines


def session_rows(frames: int = 1800, markers: int = 24, rate: float = 30.0) -> list:
    """Made-up rows of every kind: 24 markers in six groups, with gaps, fills and outliers."""
    rng = np.random.default_rng(4)
    time = np.arange(frames) / rate
    present = np.ones((frames, markers), bool)
    for marker in range(markers):
        for start in rng.integers(0, frames, rng.poisson(frames / 600)):
            present[start : start + int(rng.exponential(25)) + 1, marker] = False
    present[: frames // 4, 5] = False
    filled = ~present & (rng.random((1, markers)) < 0.6)
    filled[: frames // 4, 5] = False
    outlier = (rng.random((frames, markers)) < 4e-4) & present
    groups = np.sort(rng.integers(0, 6, markers))
    tracked = np.zeros(frames, np.uint8)
    tracked[frames // 3 : frames // 3 + frames // 12] = 1
    slow = np.interp(time, np.linspace(0, time[-1], 40), rng.random(40))
    quick = np.abs(np.interp(time, np.linspace(0, time[-1], 90), rng.standard_normal(90)))
    colours = palette.categorical(4)
    ours = 6 + 3 * slow + rng.normal(0, 0.3, frames)
    ours[~present.any(axis=1)] = np.nan
    theirs = 11 + 6 * slow + rng.normal(0, 0.5, frames)
    theirs[frames // 2 : frames // 2 + 60] = np.nan
    return [
        StateRow(
            "Video", time, tracked, np.array([palette.GOOD, palette.GAP]), ("person tracked", "person lost"),
            "Where the pose network saw a person in the video.",
        ),
        PresenceRow(
            "Markers", time, present, filled, outlier, palette.categorical(6)[groups],
            tuple(f"M{k:02d}" for k in range(markers)), "A strip a marker: seen, lost, filled, taken out.",
        ),
        CurveRow(
            "Residual", time,
            (Curve("fit, 8 mm cut", ours, colours[0]), Curve("published method", theirs, colours[1])),
            "mm", help="Mean distance of the markers from where the body says they are.",
        ),
        OffsetRow(
            "Video offset", 0.0, 0.8 * time[-1], 3.214, 2.87,
            fixed=Curve("markers", quick, np.array(palette.LOST), time),
            moving=Curve("video", quick[90:], np.array(palette.LEFT), time[: frames - 90]),
            help="How far the video's clock is behind the markers'.",
        ),
    ]  # fmt: skip


def timelines() -> QWidget:
    """All kinds of rows, zoomed in a little, with a loop range."""
    made = Timelines()
    made.set_span(0, 60)
    made.set_rows(session_rows())
    made.set_view(5, 48)
    made.set_range((14, 31))
    made.set_time(21.3)
    made.set_selected([8, 9, 15])
    made.resize(1100, 430)
    return made


EXAMPLES = {"timelines": timelines}
