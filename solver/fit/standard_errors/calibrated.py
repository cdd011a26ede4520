"""What the standard errors are multiplied by, so that they cover what they should on sessions of known truth.

The linear theory does not see that a bad video also lays markers on wrong places, nor that skin which slides far, or a
body unlike those of the shapes, is off in ways that its terms do not have: errors grow more with both than it says. The
powers and factors are those that ``python -m benchmarks.error_bars calibrate`` prints.
"""

from __future__ import annotations

import numpy as np

USUAL_VIDEO_DEG, USUAL_MARKER_MM = 7.5, 3.0
POWERS = (0.68, 0.47)
"""Of the video's noise over the usual, and of the markers'."""
FACTORS = {"markers": (0.64, 0.74), "one segment": (0.59, 0.57), "video only": (0.49, 0.59)}
"""Shape and level, by what an angle rests on, where both are as usual."""
_WITHIN = (0.4, 4.0)
"""Noise so many times the usual is the least and the most that was looked at."""


def factors(ground: str, video_deg: float, marker_mm: float) -> tuple[float, float]:
    """Of shape and level, by what an angle rests on and the noise found in the session; NaN where there is none."""
    shape, level = FACTORS[ground]
    times = growth(video_deg, marker_mm)
    return shape * times, level * times


def growth(video_deg: float, marker_mm: float) -> float:
    """By how much more errors grow with the session's noise than the linear theory says."""
    times = 1.0
    for found, usual, power in zip((video_deg, marker_mm), (USUAL_VIDEO_DEG, USUAL_MARKER_MM), POWERS, strict=True):
        if np.isfinite(found):
            times *= float(np.clip(found / usual, *_WITHIN)) ** power
    return times
