"""The stages that read what the user gives: markers, video, poses, and how their clocks stand to each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress
from markerscope.solver.sync.offset import Sync

_MOSTLY = 0.9
"""A video that shows the person for less of the markers' time than this share is worth a word."""
_SAME_LENGTH_S = 0.5


@dataclass(frozen=True)
class MarkerSettings:
    """How the marker file is read; None means as the file says, else guessed and said.

    Attributes
    ----------
    up : vertical axis of the file
    units : length unit of the file
    subject : whose markers, where there are several people's
    rate : Hz, frames a second
    start, stop : s in the file's clock, the range to solve
    """

    up: Literal["x", "y", "z"] | None = None
    units: Literal["m", "cm", "mm"] | None = None
    subject: str | None = None
    rate: float | None = None
    start: float | None = None
    stop: float | None = None


@dataclass(frozen=True)
class LandmarkSettings:
    """How the video is watched.

    Attributes
    ----------
    rate : Hz, about how many frames a second the network looks at
    mend_flips : put exchanged left and right landmarks back
    """

    rate: float = 30.0
    mend_flips: bool = True

    def __post_init__(self) -> None:
        """Refuse what no video can be watched at."""
        _positive(rate=self.rate)


@dataclass(frozen=True)
class PriorSettings:
    """How a pose prior of another program is read.

    Attributes
    ----------
    rate : Hz of its frames, where its file does not say; None takes the video's, where there is one
    """

    rate: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no clock runs at."""
        _positive(rate=self.rate)


@dataclass(frozen=True)
class SyncSettings:
    """How the video's clock is brought onto the markers': marker time = rate_ratio * video time + offset.

    Attributes
    ----------
    offset : s; None finds it from the motion
    rate_ratio : None takes 1, unless the motion clearly says otherwise
    search_s : how far to look to either side of zero; None goes by the lengths of the recordings
    """

    offset: float | None = None
    rate_ratio: float | None = None
    search_s: float | None = None

    def __post_init__(self) -> None:
        """Refuse what no clock runs at."""
        _positive(rate_ratio=self.rate_ratio, search_s=self.search_s)
        if self.offset is not None and not np.isfinite(self.offset):
            raise ValueError(f"offset is {self.offset}, which is not a time")


def _positive(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not 0 < value < np.inf:
            raise ValueError(f"{name} is {value:g} and has to be above 0")


def read_markers(settings: MarkerSettings, progress: Progress, *, marker_file: Path) -> Markers:
    """The marker file, or its range, if a solve can do something with it."""
    from markerscope.solver.core.markers_check import require_solvable
    from markerscope.solver.io import load_markers

    markers = load_markers(
        marker_file, up=settings.up, units=settings.units, subject=settings.subject, rate=settings.rate
    )
    markers = markers.between(settings.start, settings.stop)
    require_solvable(markers)
    return markers


def watch_video(settings: LandmarkSettings, progress: Progress, *, video_file: Path | None) -> Landmarks | None:
    """The person's landmarks, left and right put in order; None without a video."""
    if video_file is None:
        return None
    from markerscope.solver.video.blazepose import track_pose
    from markerscope.solver.video.flips import mend_flips

    landmarks = track_pose(video_file, rate=settings.rate, progress=progress)
    return mend_flips(landmarks)[0] if settings.mend_flips else landmarks


def pose_prior(
    settings: PriorSettings, progress: Progress, *, prior_file: Path | None, landmarks: Landmarks | None
) -> PosePrior:
    """Body poses: another program's, where the user has them, else lifted from the landmarks."""
    if prior_file is None:
        from markerscope.solver.body.model import Body
        from markerscope.solver.fit.lift import lift

        if landmarks is None:
            raise InputError("there is neither a video nor a pose prior", remedy="give one of them")

        # The embedded body's landmarks are the ones the network was matched to; rotations serve any body.
        return lift(landmarks, Body.load(), progress)
    from markerscope.solver.io.priors import load_prior

    video_rate = None if landmarks is None else _video_rate(landmarks)
    prior = load_prior(prior_file, fps=settings.rate or video_rate)
    if landmarks is None:
        return prior
    lengths = prior.time[-1] - prior.time[0], landmarks.time[-1] - landmarks.time[0]
    if abs(lengths[0] - lengths[1]) <= _SAME_LENGTH_S:
        return prior
    note = (
        f"The pose prior lasts {lengths[0]:.2f} s and the video {lengths[1]:.2f} s; "
        "their first frames are taken to be the same."
    )
    return replace(prior, notes=(*prior.notes, note))


def _video_rate(landmarks: Landmarks) -> float | None:
    """Hz of the video's frames, of which some may have been skipped."""
    if len(landmarks.time) < 2:
        return None
    return float((landmarks.frame[-1] - landmarks.frame[0]) / (landmarks.time[-1] - landmarks.time[0]))


def synchronise(
    settings: SyncSettings, progress: Progress, *, clean: Cleaned, landmarks: Landmarks | None, prior: PosePrior
) -> Sync:
    """The clock of the video on the clock of the markers: as given, else found from the motion."""
    markers = clean.markers
    found = _given_offset(settings) or _found_offset(settings, clean.measured, landmarks, prior)
    in_sight = _in_sight(prior, found, markers)
    if not in_sight:
        start, stop = found.marker_time(prior.time[[0, -1]])
        raise InputError(
            f"shows the person at no time of the markers: it runs from {start:.2f} to {stop:.2f} s of their clock, "
            f"the markers from {markers.time[0]:.2f} to {markers.time[-1]:.2f} s",
            prior.source,
            "check that both are of the same trial, and the offset",
        )
    if in_sight > _MOSTLY:
        return found
    note = (
        f"The video shows the person for only {100 * in_sight:.0f} % of the markers' time; "
        "beyond it, the pose rests on the markers alone."
    )
    return replace(found, notes=(*found.notes, note))


def _given_offset(settings: SyncSettings) -> Sync | None:
    if settings.offset is None:
        return None
    lags, score = np.array([settings.offset]), np.array([np.nan])
    return Sync(settings.offset, settings.rate_ratio or 1.0, 1.0, lags, score, method="given")


def _found_offset(settings: SyncSettings, markers: Markers, landmarks: Landmarks | None, prior: PosePrior) -> Sync:
    from markerscope.solver.sync.offset import find_offset

    watched = landmarks
    if watched is None:
        from markerscope.solver.body.model import Body
        from markerscope.solver.fit.shadow import landmarks_of_prior

        watched = landmarks_of_prior(prior, Body.load())
    window = None if settings.search_s is None else (-settings.search_s, settings.search_s)
    if settings.rate_ratio is None:
        return find_offset(watched, markers, search=window)
    watched = replace(watched, time=watched.time * settings.rate_ratio)
    found = find_offset(watched, markers, search=window)
    # A ratio that was given stays: where another fits better, the two agree in the middle of the video.
    middle = 0.5 * (watched.time[0] + watched.time[-1])
    return replace(found, rate_ratio=settings.rate_ratio, offset=found.offset + (found.rate_ratio - 1) * middle)


def _in_sight(prior: PosePrior, sync: Sync, markers: Markers) -> float:
    """Share of the markers' frames in which the video shows the person."""
    times = sync.marker_time(prior.time)
    inside = (markers.time >= times[0]) & (markers.time <= times[-1])
    nearest = np.clip(np.searchsorted(times, markers.time), 0, len(times) - 1)
    return float(np.mean(inside & prior.tracked[nearest]))
