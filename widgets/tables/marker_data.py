"""What the table of markers shows, as plain columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class MarkerRows:
    """Columns of M markers, one a row.

    Attributes
    ----------
    labels : names as the file has them
    measured : per cent of the frames
    gaps : stretches without a measurement, those at the ends included
    longest_gap : s
    group : of markers that move together, counted from 1; 0 for none
    bone : the bone it was given to, "" for none; with "(doubtful)" where it stays over 20 mm from its place, "nobody's"
        where it was left out as somebody else's or a thing's
    mean, p95, worst : mm, distance from where the body puts it; NaN where it was not used
    worst_time : s, marker clock
    landmark : bony landmark that each was drawn to, "" for none
    probability : (M,) per cent that it sits there, NaN where there is none
    beside : (M,) mm from there, NaN where there is none
    """

    labels: Sequence[str]
    measured: np.ndarray
    gaps: np.ndarray
    longest_gap: np.ndarray
    group: np.ndarray
    bone: Sequence[str]
    mean: np.ndarray
    p95: np.ndarray
    worst: np.ndarray
    worst_time: np.ndarray
    landmark: Sequence[str]
    probability: np.ndarray
    beside: np.ndarray
