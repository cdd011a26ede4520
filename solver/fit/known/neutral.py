"""The neutral pose that joint angles are counted from, where the user names one.

It is read off a span of the trial itself, or off a static trial of the same person: a file of its own, without labels
and without a video, whose markers are matched to the solved body.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import exp_so3, mean_rotation
from markerscope.solver.fit.results import FittedMotion

Zero = Literal["recorded", "neutral"]

_STILL_M = 0.02
"""How far markers may stray from their mean (nine in ten of them): swaying while standing is some millimetres."""
_LEAST_S = 0.1
_USUAL_S = 1.0
_FITS_M = 0.015
_LEAST_SHARE = 0.6
_CLEAR = 1.5


@dataclass(frozen=True)
class NeutralSettings:
    """Which pose the angles are counted from; without a span and without a file, the convention's own zero.

    Attributes
    ----------
    start, stop : s, the span of the neutral pose: of the trial, or of the neutral file where there is one; None leaves
        that end open, and both for a file mean its stillest second
    up : vertical axis of the neutral file, None as it says, else guessed
    units : length unit of the neutral file, likewise
    """

    start: float | None = None
    stop: float | None = None
    up: Literal["x", "y", "z"] | None = None
    units: Literal["m", "cm", "mm"] | None = None


@dataclass(frozen=True)
class Neutral:
    """A neutral pose.

    Attributes
    ----------
    zero : "recorded" where there is none: angles are as the convention counts them
    rotations : (24, 3, 3) mean pose, root in the internal lab frame, others relative to the parent
    where : what it was read off, in words
    same_lab_heading : whether the person's heading in it is one of the trial's (a static trial may face anywhere)
    matched : how many markers of the neutral file were matched, of how many that the body carries; (0, 0) for a span
    residual : m, median distance of the matched markers from their places; NaN for a span
    notes : what to know about it, one sentence each
    """

    zero: Zero = "recorded"
    rotations: np.ndarray | None = None
    where: str = ""
    same_lab_heading: bool = True
    matched: tuple[int, int] = (0, 0)
    residual: float = float("nan")
    notes: tuple[str, ...] = ()


def neutral_span(motion: FittedMotion, settings: NeutralSettings) -> Neutral:
    """The mean pose over a span of the trial.

    Raises
    ------
    InputError : the span is not in the trial, is too short, or the person moves in it
    """
    time = motion.time
    start = time[0] if settings.start is None else settings.start
    stop = time[-1] if settings.stop is None else settings.stop
    where = f"{start:g} to {stop:g} s of the trial"
    slack = 0.5 * float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not (time[0] - slack <= start < stop <= time[-1] + slack):
        raise InputError(
            f"the span {start:g} to {stop:g} s is not inside the trial",
            "the neutral pose",
            f"choose one between {time[0]:g} and {time[-1]:g} s",
        )
    inside = np.flatnonzero((time >= start - slack) & (time <= stop + slack))
    if len(inside) < 2 or stop - start < _LEAST_S - slack:
        raise InputError(f"{where} is too short", "the neutral pose", f"give at least {_LEAST_S:g} s")
    pose = mean_rotation(motion.rotations[inside])
    moved = _moved(motion.placed[inside][:, motion.marker_joint >= 0])
    if not moved <= _STILL_M:
        raise InputError(
            f"the person moves in {where} (markers by {1000 * moved:.0f} mm)",
            "the neutral pose",
            f"choose a span in which markers stay within {1000 * _STILL_M:.0f} mm",
        )
    return Neutral("neutral", pose, where)


def neutral_file(body: Body, motion: FittedMotion, markers: Markers, settings: NeutralSettings) -> Neutral:
    """The pose of the person in a static trial: unlabelled, no video, standing anywhere in any heading.

    Parameters
    ----------
    body, motion : the solved trial of the same person with the same markers
    markers : the static trial; markers may be missing in it, and others be there

    Raises
    ------
    InputError : the person moves in it, or its markers do not fit the body of the trial
    """
    from markerscope.solver.fit.known.body import known_body
    from markerscope.solver.fit.known.find import find

    standing = _stillest(markers, settings)
    known = known_body(body, motion)
    found = find(body, known, np.nanmean(standing.positions, axis=0))
    count, used = int((found.match >= 0).sum()), len(found.match)
    expected = min(used, int(np.isfinite(standing.positions).all(axis=2).any(axis=0).sum()))
    residual = float(np.nanmedian(found.residual)) if count else float("inf")
    if count < _LEAST_SHARE * used or residual > _FITS_M:
        fit = f"{count} of the trial's {used} markers, {1000 * residual:.0f} mm from their places" if count else "none"
        raise InputError(
            f"its markers do not fit the person of the trial ({fit})",
            markers.source,
            "give a static trial of the same person with the same markers, or a span of the trial (--neutral A:B)",
        )
    notes = []
    if found.next_cost < _CLEAR * found.cost:
        notes.append(
            "The neutral trial fits in a second way nearly as well "
            f"({1000 * found.next_cost:.0f} against {1000 * found.cost:.0f} mm a marker): look at the pose it gave."
        )
    if count < expected:
        notes.append(f"{expected - count} of the markers in the neutral trial were not matched to the trial's.")
    where = f"{standing.time[0]:g} to {standing.time[-1]:g} s of {_name(markers.source)}"
    return Neutral("neutral", found.rotations, where, False, (count, used), residual, tuple(notes))


def facing(neutral: Neutral, motion: FittedMotion) -> np.ndarray:
    """(1, 24, 3, 3) the neutral pose; one that may face anywhere is turned to face as the trial does on the whole."""
    if neutral.rotations is None:
        raise ValueError("there is no neutral pose")
    pose = neutral.rotations[None].copy()
    if not neutral.same_lab_heading:
        ahead = motion.rotations[:, 0, :2, 2].mean(axis=0)
        angle = np.arctan2(ahead[1], ahead[0]) - np.arctan2(pose[0, 0, 1, 2], pose[0, 0, 0, 2])
        pose[:, 0] = exp_so3(np.array([0.0, 0.0, angle])) @ pose[:, 0]
    return pose


def _name(source: str) -> str:
    return source.replace("\\", "/").rsplit("/", 1)[-1] or "the neutral file"


def _stillest(markers: Markers, settings: NeutralSettings) -> Markers:
    """The span asked for, or the second in which the markers move least.

    Raises
    ------
    InputError : the person moves in it
    """
    if settings.start is not None or settings.stop is not None:
        chosen = markers.between(settings.start, settings.stop)
    else:
        count = min(len(markers.positions), max(2, round(_USUAL_S * markers.rate)))
        firsts = np.unique(np.linspace(0, len(markers.positions) - count, 40).astype(int))
        spans = [markers.select(slice(int(first), int(first) + count)) for first in firsts]
        chosen = min(spans, key=lambda span: _moved(span.positions))
    moved = _moved(chosen.positions)
    if not moved <= _STILL_M:
        what = "no marker is seen throughout" if not np.isfinite(moved) else f"markers move by {1000 * moved:.0f} mm"
        raise InputError(
            f"the person does not stand still between {chosen.time[0]:g} and {chosen.time[-1]:g} s ({what})",
            markers.source,
            f"give a static trial, or name a span of it in which markers stay within {1000 * _STILL_M:.0f} mm",
        )
    return chosen


def _moved(positions: np.ndarray) -> float:
    """m, how far nine in ten of the markers (T, M, 3) stay from their mean; infinite if none is seen half the time."""
    seen = np.isfinite(positions).all(axis=2).mean(axis=0) >= 0.5
    if not seen.any():
        return float("inf")
    off = positions[:, seen] - np.nanmean(positions[:, seen], axis=0)
    return float(np.percentile(np.sqrt(np.nanmean((off**2).sum(axis=2), axis=0)), 90))
