"""One rigid group of markers, or one bone: nothing in it tells one bone from another."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

RIGID_M = 0.008
"""Distances on one bone vary by less than this, skin and all."""
LONGEST_BONE_M = 0.5
"""A thigh of a tall person. What moves as one piece and is longer, a limb held still, no single bone can carry."""


def greatest_distance(points: np.ndarray) -> float:
    """m, between any two of some points (M, 3) m, NaN = not there; NaN where none is."""
    there = points[np.isfinite(points).all(axis=1)]
    if not len(there):
        return float("nan")
    return float(np.linalg.norm(there[:, None] - there[None], axis=2).max())


def one_group(seen: Evidence) -> Doubt | None:
    """Say that all markers in use move as one piece."""
    used = np.flatnonzero(seen.joint >= 0)
    if not len(used):
        return None
    with np.errstate(invalid="ignore"):
        most = float(np.nanmax(seen.affinity[np.ix_(used, used)], initial=0.0))
    alone = len(set(seen.joint[used].tolist())) == 1
    if not alone and (most >= RIGID_M or seen.span > LONGEST_BONE_M):
        return None
    if most >= RIGID_M:
        return Doubt(
            "one rigid group",
            f"All {len(used)} markers were given to one bone, and no joint tells which bone that is: check part and "
            "side, pin the right candidate, or record a marker on a second bone.",
            value=1.0,
            limit=2.0,
        )
    return Doubt(
        "one rigid group",
        f"All {len(used)} markers move as one piece (their distances vary by {1000 * most:.1f} mm at most), so any "
        "bone may carry them: check part and side, pin the right candidate, or record a marker on a second bone.",
        value=1000 * most,
        limit=1000 * RIGID_M,
    )
