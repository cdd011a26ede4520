"""Markers that fit no place on the body: somebody else's, or reflections."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence, named, plural

FAR_M = 0.10
SKIN_M = 0.12
SUSPECT_M = 0.02
"""A marker this far from its place is on the wrong bone in four of five cases."""


def typical(residual: np.ndarray) -> np.ndarray:
    """(M,) m, median over time of each marker's residual (T, M); NaN for those never seen."""
    seen = np.isfinite(residual).any(axis=0)
    found = np.full(residual.shape[1], np.nan)
    found[seen] = np.nanmedian(residual[:, seen], axis=0)
    return found


def suspects(residual: np.ndarray) -> np.ndarray:
    """Columns of the markers whose median residual is over 20 mm."""
    with np.errstate(invalid="ignore"):
        return np.flatnonzero(typical(residual) > SUSPECT_M)


def far(seen: Evidence) -> Doubt | None:
    """Say which markers fit no place: those that were left out for it, and those that stayed."""
    with np.errstate(invalid="ignore"):
        stayed = np.flatnonzero((seen.joint >= 0) & ((typical(seen.residual) > FAR_M) | (seen.skin > SKIN_M)))
    if not len(stayed) and not len(seen.far):
        return None
    parts = []
    if len(seen.far):
        parts.append(
            f"{plural(len(seen.far), 'marker')} fit no place on the body within {1000 * FAR_M:.0f} mm and were left "
            f"out as nobody's ({named(seen.labels, seen.far)})"
        )
    if len(stayed):
        parts.append(f"{plural(len(stayed), 'marker')} are far from the body ({named(seen.labels, stayed)})")
    return Doubt(
        "far markers",
        f"{'; '.join(parts)}: they may be another person's, a thing's or reflections; if they are the person's, check "
        "the video, the offset and the candidates.",
        tuple(int(m) for m in (*seen.far, *stayed)),
        float(len(seen.far) + len(stayed)),
        0.0,
    )
