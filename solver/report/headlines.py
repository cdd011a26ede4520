"""The figures that sum up a solve: on top of the report, and above the stages in the window."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.pull.results import EARNED, LandmarkPull
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.fit.surface import SurfaceDistance
from markerscope.solver.report.report_data import Headline
from markerscope.solver.sync.offset import Sync

TIE = 1.15
"""Where the next different answer costs less than this many times as much, the two are close to a tie."""


def headlines(
    sync: Sync | None,
    ranked: Orientation,
    motion: FittedMotion,
    surface: SurfaceDistance,
    check: Verdict,
    pinned: int | None = None,
) -> tuple[Headline, ...]:
    """The figures, the part of the body first.

    Parameters
    ----------
    sync : None where there was no video to bring onto the markers' clock
    pinned : row of the candidate that was pinned by hand, None where the best was taken
    """
    margin = f"next answer costs {ranked.margin:.2f} times" if np.isfinite(ranked.margin) else "no other answer found"
    if pinned is not None:
        margin = f"of the part: pinned by hand; {margin}"
    camera = motion.camera
    rows = [
        Headline("Part", ranked.candidates[motion.chosen].part, said_pinned(pinned) or "the best answer"),
        Headline("Confidence", f"{100 * check.confidence:.0f} %", margin),
        Headline("Marker residual", f"{1000 * np.nanmedian(motion.residual):.1f} mm", "median distance from its place"),
        Headline("Marker to skin", f"{1000 * surface.mean:.1f} mm", "mean; a marker's centre stands some 9.5 mm off"),
    ]
    if sync is not None:
        note = f"added to the video's time; confidence {sync.confidence:.2f}"
        rows.append(Headline("Sync offset", f"{sync.offset:+.3f} s", note))
    if np.isfinite(camera.reprojection_px):
        rows.append(
            Headline("Reprojection", f"{camera.reprojection_px:.0f} px", "median distance of the video's landmarks")
        )
    if motion.pull is not None:
        rows.append(_landmarks(motion.pull))
    return tuple(rows)


def said_pinned(pinned: int | None) -> str:
    """What a result stands on that was pinned by hand; empty where nothing was."""
    return "" if pinned is None else f"stands on candidate {candidate_number(pinned)}, pinned by hand"


def _landmarks(pull: LandmarkPull) -> Headline:
    value = f"{pull.hits} markers" if pull.state in ("earned", "by hand") else pull.state
    note = "drawn to the landmarks that they sit on"
    if np.isfinite(pull.log_ratio):
        note += f"; log likelihood ratio {pull.log_ratio:.1f}, needs {EARNED:.1f}"
    return Headline("Bony landmarks", value, note)
