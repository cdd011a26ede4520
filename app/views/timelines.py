"""What runs along the session's clock: presence, video, residuals of every fit, and how the two clocks lie."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from markerscope.app.models.display import Statistic
from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.clocks import on_clock, over_markers
from markerscope.app.views.tracks import FILLED, MEASURED, OUTLIER, MarkerTracks, pooled
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.sync.offset import Sync
from markerscope.widgets import palette
from markerscope.widgets.plots.rows import Curve, CurveRow, OffsetRow, PresenceRow, StateRow

CLEANING = "Cleaning"
"""Name of the row of what was cut and filled."""
TRACKED, UNSEEN = 0, 1
"""States of a video frame; where both fall on one pixel, the loss shows."""
_SAID = {"mean": "mean", "median": "median", "p95": "95th percentile", "worst": "worst"}
_MOTION_SAMPLES = 6000


def presence_row(
    tracks: MarkerTracks, order: np.ndarray | None = None, colours: np.ndarray | None = None
) -> PresenceRow:
    """A strip for every marker, in every frame.

    Parameters
    ----------
    order : markers from top to bottom; as in the file where not given
    colours : (M, 3) uint8 of the markers
    """
    order = np.arange(tracks.state.shape[1]) if order is None else order
    state = tracks.state[:, order]
    filled, outlier = state == FILLED, state == OUTLIER
    return PresenceRow(
        "Markers",
        tracks.markers.time,
        state == MEASURED,
        filled if filled.any() else None,
        outlier if outlier.any() else None,
        None if colours is None else colours[order],
        tuple(tracks.markers.labels[m] for m in order),
        "When each marker was measured, in the colour of its group; a gap is where it was lost.",
        order,
    )


def overview(tracks: MarkerTracks, most: int = 1000) -> Curve:
    """Share of the markers, per cent, that were measured throughout each of at most ``most`` bins."""
    state = pooled(tracks.state, most)
    starts = np.arange(len(state)) * len(tracks.state) // len(state)
    time = tracks.markers.first_time + starts / tracks.markers.rate
    return Curve("markers measured", 100 * (state == MEASURED).mean(axis=1), np.array(palette.GOOD), time)


def strip_order(clusters: np.ndarray) -> np.ndarray:
    """(M,) markers cluster by cluster, those of none last; within a cluster as in the file."""
    return np.argsort(np.where(clusters < 0, clusters.max(initial=0) + 1, clusters), kind="stable")


def video_row(watched: Landmarks | PosePrior, sync: Sync) -> StateRow:
    """Where the video shows the person, on the markers' clock."""
    return StateRow(
        "Video",
        sync.marker_time(watched.time),
        np.where(watched.tracked, TRACKED, UNSEEN).astype(np.uint8),
        np.array([palette.GOOD, palette.GAP], dtype=np.uint8),
        ("person tracked", "person lost"),
        "Frames of the video in which the person was found, on the markers' clock.",
    )


class Residuals(Protocol):
    """How far something is from the markers: ``time`` (T,) s, ``residual`` (T, M) m."""

    @property
    def time(self) -> np.ndarray:
        """(T,) s."""

    @property
    def residual(self) -> np.ndarray:
        """(T, M) m, NaN where there is none."""


def residual_row(
    fits: Mapping[str, Residuals],
    time: np.ndarray,
    statistic: Statistic = "mean",
    markers: np.ndarray | None = None,
    ranks: Mapping[str, int] | None = None,
    also: Sequence[Curve] = (),
    *,
    own: str | None = None,
    old: bool = False,
) -> CurveRow:
    """Distance of the markers from their places over time, a curve for each fit, mm.

    Parameters
    ----------
    fits : by label
    time : (T,) s, the clock to lay them on; frames that a fit does not have are NaN
    statistic : over the markers of each frame
    markers : those that count; all where not given
    ranks : number of each fit's colour, so that it keeps it while others come and go
    also : further curves, mm
    own : label of the one that the scene shows; the others are compared with it
    old : whether that is out of date
    """
    curves = []
    for i, (label, motion) in enumerate(fits.items()):
        residual = motion.residual if markers is None else motion.residual[:, markers]
        values = 1000 * on_clock(time, motion.time, over_markers(residual, statistic))
        rank = i if ranks is None else ranks[label]
        curves.append(
            Curve(label, values, palette.categorical(rank + 1)[rank], dashed=label != own, old=label == own and old)
        )
    curves += also
    whose = "all markers" if markers is None else f"{len(markers)} selected marker{'s' if len(markers) != 1 else ''}"
    return CurveRow(
        "Residual",
        time,
        tuple(curves),
        "mm",
        help=f"How far the markers are from where the body puts them: {_SAID[statistic]} over {whose}.",
    )


def candidate_curve(
    track: BodyTrack,
    markers: Markers,
    label: str,
    colour: np.ndarray,
    statistic: Statistic = "mean",
    chosen: np.ndarray | None = None,
) -> Curve:
    """Distance of the markers from their places on a ghost, at its keyframes, mm; the label says the mean.

    Parameters
    ----------
    chosen : the markers that count; all where not given
    """
    frames = np.round((track.times - markers.first_time) * markers.rate).astype(int)
    inside = (frames >= 0) & (frames < len(markers.positions))
    times, frames = track.times[inside], frames[inside]
    kept = np.ones(len(track.markers), bool) if chosen is None else np.isin(track.markers, chosen)
    places = track.places_over(times) if len(times) else np.zeros((0, len(track.markers), 3))
    away = np.linalg.norm(places - markers.positions[frames][:, track.markers], axis=2)[:, kept]
    values = 1000 * over_markers(away, statistic)
    if np.isfinite(values).any():
        label = f"{label}, {np.nanmean(values):.0f} mm"  # it may be far beyond the fits
    return Curve(label, values, colour, times, dashed=True, framed=False)


def cleaning_row(tracks: MarkerTracks) -> StateRow | None:
    """Where anything was cut or filled, of any marker; None where nothing was."""
    filled, cut = ((tracks.state == state).any(axis=1) for state in (FILLED, OUTLIER))
    if not (filled.any() or cut.any()):
        return None
    return StateRow(
        CLEANING,
        tracks.markers.time,
        np.where(cut, 2, filled.astype(np.uint8)).astype(np.uint8),
        np.array([palette.GAP, palette.DOUBTFUL, palette.OUTLIER], dtype=np.uint8),
        ("as measured", "filled", "outlier cut"),
        "Frames in which a sample of any marker was taken out, or a gap was filled. A click selects these markers.",
    )


def mended_at(tracks: MarkerTracks, time: float) -> np.ndarray:
    """The markers that were cut, or else filled, in the frame nearest to a time, s."""
    state = tracks.state[tracks.nearest(time)]
    cut = np.flatnonzero(state == OUTLIER)
    return cut if len(cut) else np.flatnonzero(state == FILLED)


def offset_row(sync: Sync, markers: Markers, watched: Landmarks | PosePrior, found: Sync | None = None) -> OffsetRow:
    """The video's span along the markers' clock, with how much either moves, for the eye to match.

    Parameters
    ----------
    found : an earlier result that looked for the offset, where the one in use was given
    """
    automatic = next((known.offset for known in (sync, found) if known is not None and known.method != "given"), None)
    moving = None if isinstance(watched, PosePrior) else video_motion(watched)
    return OffsetRow(
        "Sync offset",
        float(watched.time[0]),
        float(watched.time[-1]),
        sync.offset,
        automatic,
        sync.rate_ratio,
        marker_motion(markers),
        moving,
        "Drag the video along the markers' clock: marker time = video time times the rate ratio, plus the offset, s.",
    )


def marker_motion(markers: Markers) -> Curve:
    """Median speed of the markers, m/s, between frames at most some 40 ms apart."""
    count = len(markers.positions)
    step = max(1, count // _MOTION_SAMPLES, round(0.03 * markers.rate))
    positions, time = markers.positions[::step], markers.time[::step]
    speed = np.linalg.norm(np.diff(positions, axis=0), axis=2) * markers.rate / step
    return Curve("markers", over_markers(speed, "median"), np.array(palette.LEFT), 0.5 * (time[1:] + time[:-1]))


def video_motion(landmarks: Landmarks) -> Curve:
    """Median speed of the landmarks over the picture, in heights of the person a second."""
    speed = np.linalg.norm(np.diff(landmarks.image, axis=0), axis=2) / np.diff(landmarks.time)[:, None]
    seen = landmarks.image[landmarks.tracked]
    height = float(np.median(np.ptp(seen[..., 1], axis=1))) if len(seen) else 1.0
    time = 0.5 * (landmarks.time[1:] + landmarks.time[:-1])
    return Curve("video", over_markers(speed / max(height, 1.0), "median"), np.array(palette.RIGHT), time)
