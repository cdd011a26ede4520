"""Markers that do not lie on the body that was fitted to them."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

SKIN_MM = 40.0
PLACE_MM = 30.0
"""A right answer leaves markers within a few millimetres of their places; beyond this it is no longer a body."""
_ADVICE = "check units, vertical axis, and that all markers are one person's and the video is of the same movement"


def off_the_skin(seen: Evidence) -> Doubt | None:
    """Say that the markers do not lie on the skin."""
    value = 1000 * seen.m2s
    if not value > SKIN_MM:
        return None
    return Doubt(
        "markers off the skin",
        f"The markers are {value:.0f} mm from the skin on average, where some 10 mm are usual: {_ADVICE}.",
        value=value,
        limit=SKIN_MM,
    )


def off_their_places(seen: Evidence) -> Doubt | None:
    """Say that the markers are not where the body puts them."""
    known = seen.residual[np.isfinite(seen.residual)]
    value = 1000 * float(np.median(known)) if len(known) else float("nan")
    if value <= PLACE_MM:
        return None
    return Doubt(
        "markers off their places",
        f"The markers are {value:.0f} mm from where the body puts them (median): this is no fit to rely on; {_ADVICE}.",
        value=value,
        limit=PLACE_MM,
    )
