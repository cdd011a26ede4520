"""What of the results deserves a look, in words, with the place to look at."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.fit.doubts.doubt import CAP, Doubt, named, plural
from markerscope.solver.fit.doubts.far import SUSPECT_M
from markerscope.solver.fit.doubts.misfit import PLACE_MM
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.report.headlines import TIE, said_pinned
from markerscope.solver.sync.offset import Sync

TRACKED = 0.9
"""A video that shows the person in less than this share of the frames watched is worth a look."""
SYNC_CONFIDENCE = 0.5
"""An offset that is less sure is said to be open by the synchronisation itself."""
RESIDUAL_M = 0.015
"""Half of what is said to be no fit to rely on; right answers stay within a few millimetres."""

PLACES: Mapping[str, tuple[str, str]] = {
    "several clouds": ("localize", "markers"),
    "still markers": ("localize", "markers"),
    "far markers": ("fit", "markers"),
    "one rigid group": ("segment", "affinity"),
    "markers off the skin": ("fit", "markers"),
    "markers off their places": ("fit", "markers"),
    "mirrored video": ("landmarks", "video"),
    "off the picture": ("fit", "video"),
    "another movement": ("sync", "timelines"),
    "turning camera": ("landmarks", "video"),
    "lone limb": ("orient", "candidates"),
}
"""Of each kind of doubt: the stage it speaks against, and the panel that shows it."""


@dataclass(frozen=True)
class Concern:
    """Something to check.

    Attributes
    ----------
    stage : whose result it speaks against
    text : the reason, in words
    panel : where it is seen
    markers : columns of those it is about
    time : s, when it is at its worst; None where it is at no time in particular
    candidate : row of the candidate to compare with
    """

    stage: str
    text: str
    panel: str = ""
    markers: tuple[int, ...] = ()
    time: float | None = None
    candidate: int | None = None

    @property
    def short(self) -> str:
        """What is wrong, without what to do about it."""
        return f"{self.text.split(': ')[0].rstrip('.')}."


def concerns(results: Mapping[str, Any], pinned: int | None = None) -> tuple[Concern, ...]:
    """What is to check of some stages' results, in the order of the stages.

    Parameters
    ----------
    results : in force, by the names of their stages; what is not there yet says nothing
    pinned : row of the candidate that was pinned by hand, None where the best is taken
    """
    landmarks, sync, ranked = results.get("landmarks"), results.get("sync"), results.get("orient")
    motion, check, markers = results.get("fit"), results.get("check"), results.get("markers")
    found: list[Concern] = []
    if landmarks is not None:
        found += _of_landmarks(landmarks, sync)
    if sync is not None:
        found += _of_sync(sync)
    if ranked is not None:
        found += _of_ranking(ranked)
    if motion is not None:
        found += _of_fit(motion, markers, pinned, () if ranked is None else ranked.warnings)
    if check is not None:
        found += _of_check(check, motion)
    labels = () if markers is None else tuple(markers.labels)
    return tuple(_once(_with_names(concern, labels) for concern in found))


def _of_landmarks(landmarks: Landmarks, sync: Sync | None) -> Iterable[Concern]:
    share = float(landmarks.tracked.mean()) if len(landmarks.tracked) else 0.0
    if share >= TRACKED:
        return
    lost = np.flatnonzero(~landmarks.tracked)
    when = None
    if sync is not None and len(lost):
        when = float(sync.marker_time(landmarks.time[lost[len(lost) // 2]]))
    yield Concern(
        "landmarks", f"The person is tracked in only {100 * share:.0f} % of the frames watched.", "video", time=when
    )


def _of_sync(sync: Sync) -> Iterable[Concern]:
    said = False
    for note in sync.notes:
        said = True
        yield Concern("sync", note, "timelines")
    if sync.confidence < SYNC_CONFIDENCE and not said:
        yield Concern("sync", f"The offset is not sure (confidence {sync.confidence:.2f}).", "timelines")


def _of_ranking(ranked: Orientation) -> Iterable[Concern]:
    other = ranked.runner_up if ranked.runner_up >= 0 else None
    if ranked.margin < TIE:
        yield Concern(
            "orient",
            f"The next different answer costs only {ranked.margin:.2f} times as much: close to a tie.",
            "candidates",
            candidate=other,
        )
    for warning in ranked.warnings:
        yield Concern("orient", warning, "candidates", candidate=other)


def _of_fit(
    motion: FittedMotion, markers: Markers | None, pinned: int | None, said: tuple[str, ...]
) -> Iterable[Concern]:
    if pinned is not None:
        words = said_pinned(pinned)
        yield Concern("fit", f"{words[:1].upper()}{words[1:]}.", "candidates", candidate=pinned)
    known = motion.residual[np.isfinite(motion.residual)]
    middle = float(np.median(known)) if len(known) else float("nan")
    if RESIDUAL_M < middle <= PLACE_MM / 1000:  # beyond it a doubt says so
        text = f"The markers are {1000 * middle:.1f} mm from their places (median); a few millimetres are usual."
        yield Concern("fit", text, "markers", time=_worst(motion, range(motion.residual.shape[1])))
    for warning in motion.warnings:
        if warning not in said:
            yield Concern("fit", warning, "markers")


def _of_check(check: Verdict, motion: FittedMotion | None) -> Iterable[Concern]:
    for doubt in check.doubts:
        stage, panel = place_of(doubt)
        yield Concern(stage, doubt.sentence, panel, doubt.markers)
    if check.suspect:
        text = (
            f"{plural(len(check.suspect), 'marker')} stay over {1000 * SUSPECT_M:.0f} mm from their places: most such "
            "sit on another bone than they were given to."
        )
        when = None if motion is None else _worst(motion, check.suspect)
        yield Concern("fit", text, "markers", check.suspect, when)
    if check.confidence <= CAP:
        yield Concern("check", f"The confidence in the answer as a whole is {check.confidence:.2f}.", "hypotheses")


def place_of(doubt: Doubt) -> tuple[str, str]:
    """The stage that a doubt speaks against, and the panel that shows it."""
    return PLACES.get(doubt.kind, ("check", "hypotheses"))


def _with_names(concern: Concern, labels: tuple[str, ...]) -> Concern:
    """With the names of the markers that it is about, where its sentence does not have them."""
    known = [m for m in concern.markers if m < len(labels)]
    if not known or labels[known[0]] in concern.text:
        return concern
    return replace(concern, text=f"{concern.text.rstrip('.')} ({named(labels, known)}).")


def _worst(motion: FittedMotion, columns: Iterable[int]) -> float | None:
    """When some markers are furthest from their places, s."""
    own = motion.residual[:, [*columns]]
    if not np.isfinite(own).any():
        return None
    return float(motion.time[int(np.nanargmax(np.nan_to_num(own, nan=-1.0).max(axis=1)))])


def _once(found: Iterable[Concern]) -> Iterable[Concern]:
    """Those that were not said of the same stage before."""
    known: set[tuple[str, str]] = set()
    for concern in found:
        if (concern.stage, concern.text) not in known:
            known.add((concern.stage, concern.text))
            yield concern
