"""How far curves are from those of controls: z-scores, gait variable scores and the gait profile score.

The gait variable score is the RMS difference of a curve from the controls' mean over the cycle; the gait profile score
is the RMS of nine of them for each side, and of fifteen for both (Baker et al. 2009, 2012).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from markerscope.solver.cycles.curve import CutCurve, Summary
from markerscope.solver.cycles.cycle import POINTS

PROFILE = (
    "pelvic_tilt",
    "pelvic_obliquity",
    "pelvic_rotation",
    "hip_flexion",
    "hip_adduction",
    "hip_rotation",
    "knee_flexion",
    "ankle_dorsiflexion",
    "foot_progression",
)
"""The nine curves of the gait profile score; the pelvis counts once, of the left cycles, where both sides are taken."""


@dataclass(frozen=True, eq=False)
class Band:
    """Controls of one quantity: (101,) mean and SD, and how many they are of (0: not said)."""

    mean: np.ndarray
    sd: np.ndarray
    count: int = 0


Bands = Mapping[tuple[str, str], Band]
"""By quantity and side; side "" serves both."""


def band_for(bands: Bands, name: str, side: str) -> Band | None:
    """The band of a quantity and side, else of both sides together."""
    return bands.get((name, side)) or bands.get((name, ""))


def bands_of(curves: Sequence[CutCurve], people: Mapping[str, str]) -> dict[tuple[str, str], Band]:
    """Bands of one's own controls, left and right together: each person's mean first, then over people.

    Parameters
    ----------
    curves : of all controls' trials
    people : whose each trial is, by its name
    """
    means: dict[str, dict[tuple[str, str], list[np.ndarray]]] = {}
    for curve in curves:
        for values, trial in zip(curve.values, curve.trials):
            means.setdefault(curve.name, {}).setdefault((people[trial], curve.side), []).append(values)
    out = {}
    for name, by_person in means.items():
        sides: dict[str, list[np.ndarray]] = {}
        for (person, _), rows in by_person.items():
            sides.setdefault(person, []).append(_mean(np.array(rows)))
        each = np.array([_mean(np.array(rows)) for rows in sides.values()])
        sd = each.std(axis=0, ddof=1) if len(each) > 1 else np.full(POINTS, np.nan)
        out[name, ""] = Band(_mean(each), sd, len(each))
    return out


def z_scores(summary: Summary, band: Band) -> np.ndarray:
    """(101,) SDs of the controls that a mean curve is away from theirs; NaN where they do not spread."""
    spread = np.where(band.sd > 1e-9, band.sd, np.nan)
    return np.asarray((summary.mean - band.mean) / spread)


def variable_score(values: np.ndarray, band: Band) -> float:
    """Gait variable score: RMS difference of a curve (101,) from the controls' mean; NaN where under 90 % are known."""
    off = values - band.mean
    known = np.isfinite(off)
    return float(np.sqrt(np.mean(off[known] ** 2))) if known.mean() > 0.9 else float("nan")


@dataclass(frozen=True)
class Profile:
    """Scores against controls.

    Attributes
    ----------
    variables : gait variable scores by quantity and side, degrees
    left, right, both : gait profile scores, degrees; NaN where one of their curves is missing
    missing : curves without which a profile score cannot be had
    """

    variables: Mapping[tuple[str, str], float]
    left: float
    right: float
    both: float
    missing: tuple[str, ...]


def profile_of(curves: Sequence[CutCurve], bands: Bands) -> Profile:
    """Scores of the mean curves of each side."""
    found = {}
    for curve in curves:
        band = band_for(bands, curve.name, curve.side)
        if band is not None and curve.unit == "degrees":
            found[curve.name, curve.side] = variable_score(curve.summary.mean, band)
    nine = {side: [found.get((name, side), np.nan) for name in PROFILE] for side in ("left", "right")}
    pelvis = sum(name.startswith("pelvic") for name in PROFILE)
    missing = tuple(
        f"{name}, {side}"
        for side in ("left", "right")
        for name in PROFILE
        if not np.isfinite(found.get((name, side), np.nan))
    )
    left, right = (float(np.sqrt(np.mean(np.square(nine[side])))) for side in ("left", "right"))
    both = float(np.sqrt(np.mean(np.square([*nine["left"], *nine["right"][pelvis:]]))))
    return Profile(found, left, right, both, missing)


def _mean(values: np.ndarray) -> np.ndarray:
    from markerscope.solver.core.metrics import nanmean_along

    return nanmean_along(values, 0)
