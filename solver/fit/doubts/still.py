"""Markers that stand while the others move: on a chair, a step, a plate, the floor."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence, named, plural

STILL_M = 0.001
"""A marker on a person strays further than this, if only by breathing and balance."""
_OTHERS_MOVE_M = 0.01


def still_markers(positions: np.ndarray) -> np.ndarray:
    """Columns of the markers that stay where they are although most of the others do not.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    """
    seen = np.isfinite(positions).all(axis=2)
    often = seen.sum(axis=0) >= 3
    count = np.maximum(seen.sum(axis=0), 1)[:, None]
    held = np.where(seen[..., None], positions, 0.0)
    middle = held.sum(axis=0) / count
    variance = np.where(seen[..., None], (held - middle) ** 2, 0.0).sum(axis=0) / count
    stray = np.sqrt(variance.sum(axis=1))
    still = often & (stray < STILL_M)
    others = often & ~still
    if not still.any() or not others.any() or np.median(stray[others]) < _OTHERS_MOVE_M:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(still)


def still(seen: Evidence) -> Doubt | None:
    """Say which markers stood still and were left out."""
    if not len(seen.still):
        return None
    return Doubt(
        "still markers",
        f"{plural(len(seen.still), 'marker')} did not move by {1000 * STILL_M:.0f} mm while the others did, so "
        f"{'it was' if len(seen.still) == 1 else 'they were'} taken to sit on a thing and left out "
        f"({named(seen.labels, seen.still)}): check that no marker of the person is among them.",
        tuple(int(m) for m in seen.still),
        float(len(seen.still)),
        0.0,
    )
