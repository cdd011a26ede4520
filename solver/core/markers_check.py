"""Whether a recording holds enough for a solve."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers

FEWEST_MARKERS = 3
"""Markers seen together that fix the place and turn of a body."""
FEWEST_FRAMES = 10
"""Frames with so many markers; fewer show no motion to group markers by."""


def require_solvable(markers: Markers) -> None:
    """Refuse a recording that no solve can do anything with.

    Raises
    ------
    InputError : no data at all, fewer than 3 markers, or fewer than 10 frames that show 3 markers at once
    """
    where = markers.source or None
    present = markers.present
    if not present.any():
        raise InputError(
            "holds no marker position: every sample is lost", where, "export the trial with its trajectories"
        )
    seen = int(present.any(axis=0).sum())
    if seen < FEWEST_MARKERS:
        what = f"holds {_count(seen, 'marker')} with data where a solve needs at least {FEWEST_MARKERS}"
        raise InputError(what, where, "record with more markers on the body")
    if len(present) < FEWEST_FRAMES:
        what = f"holds {_count(len(present), 'frame')} where a solve needs at least {FEWEST_FRAMES}"
        raise InputError(what, where, "give a trial in which the subject moves")
    together = int((present.sum(axis=1) >= FEWEST_MARKERS).sum())
    if together < FEWEST_FRAMES:
        what = (
            f"shows {FEWEST_MARKERS} markers at once in {_count(together, 'frame')} "
            f"where a solve needs at least {FEWEST_FRAMES}"
        )
        raise InputError(what, where, "choose another range or fill the gaps")
    if np.ptp(markers.positions[present], axis=0).max() < 1e-6:
        raise InputError("has all its markers in one place", where, "check the export")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
