"""One row a marker: when it was seen, where it was put, how well it is explained."""

from __future__ import annotations

import numpy as np

from markerscope.app.views.colours import bone_name
from markerscope.app.views.tracks import MEASURED, MarkerTracks
from markerscope.solver.clustering.segment import Segmentation
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.results import FittedMotion
from markerscope.widgets.tables.marker_data import MarkerRows


def marker_table(
    tracks: MarkerTracks,
    segmentation: Segmentation | None = None,
    motion: FittedMotion | None = None,
    verdict: Verdict | None = None,
) -> MarkerRows:
    """The markers of a session as far as they are known; those that the rules doubt are marked beside their bone."""
    width = tracks.state.shape[1]
    measured = tracks.state == MEASURED
    gaps, longest = gap_lengths(~measured)
    nothing = np.full(width, -1)
    joints = nothing if motion is None else motion.marker_joint
    drawn = None if motion is None else motion.pull
    named = ("",) * width if drawn is None else drawn.landmark
    chance, beside = (np.full(width, np.nan),) * 2 if drawn is None else (100 * drawn.probability, 1000 * drawn.after)
    mean, p95, worst, frame = _residuals(np.full((1, width), np.nan) if motion is None else motion.residual)
    return MarkerRows(
        labels=tracks.markers.labels,
        measured=100 * measured.mean(axis=0),
        gaps=gaps,
        longest_gap=longest / tracks.markers.rate,
        group=1 + (nothing if segmentation is None else segmentation.clusters),
        bone=_bones(joints, verdict),
        mean=mean,
        p95=p95,
        worst=worst,
        worst_time=np.where(frame < 0, np.nan, tracks.markers.first_time + frame / tracks.markers.rate),
        landmark=tuple(name.replace("_", " ") for name in named),
        probability=np.where([bool(name) for name in named], chance, np.nan),
        beside=beside,
    )


def _bones(joints: np.ndarray, verdict: Verdict | None) -> tuple[str, ...]:
    names = [bone_name(int(j)) for j in joints]
    if verdict is not None and max((*verdict.nobody, *verdict.suspect), default=-1) < len(names):
        for m in verdict.suspect:
            names[m] += " (doubtful)"
        for m in verdict.nobody:
            names[m] = "nobody's"
    return tuple(names)


def gap_lengths(lost: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How many stretches of True each column (T, M) has, and how many frames the longest lasts: (M,) each."""
    width = lost.shape[1]
    edge = np.zeros((1, width), dtype=np.int8)
    change = np.diff(np.concatenate([edge, lost.astype(np.int8), edge]), axis=0).T
    column, start = np.nonzero(change == 1)
    _, stop = np.nonzero(change == -1)
    longest = np.zeros(width, dtype=np.int64)
    np.maximum.at(longest, column, stop - start)
    return np.bincount(column, minlength=width), longest


def _residuals(residual: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean, 95th percentile and worst, mm, and the frame of the worst (-1 without any) of each column (T, M) m."""
    width = residual.shape[1]
    mean, p95, worst = (np.full(width, np.nan) for _ in range(3))
    frame = np.full(width, -1)
    for m in range(width):
        column = residual[:, m]
        when = np.flatnonzero(np.isfinite(column))
        if len(when):
            known = 1000 * column[when]
            top = int(known.argmax())
            mean[m], worst[m], frame[m] = known.mean(), known[top], when[top]
            p95[m] = _p95(known)
    return mean, p95, worst, frame


def _p95(values: np.ndarray) -> float:
    """As ``np.percentile`` has it, by one partial sort."""
    place = 0.95 * (len(values) - 1)
    low = int(place)
    high = min(low + 1, len(values) - 1)
    ranked = np.partition(values, (low, high))
    return float(ranked[low] + (place - low) * (ranked[high] - ranked[low]))
