"""The stages of a solve, as data: what each is computed from, with which settings, and what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from solver.angles import AngleSettings, JointAngles
from solver.markers import Markers
from solver.pipeline.stage import NoSettings, Stage
from solver.prior import PosePrior
from solver.progress import Progress
from solver.segment import Segmentation, SegmentSettings
from solver.solve.method import FitSettings, LocalizeSettings, OrientSettings
from solver.solve.results import CameraResult, FittedMotion, Localization, Orientation
from solver.surface import SurfaceDistance
from solver.sync import Sync
from solver.video.landmarks import Landmarks

SOURCES = ("marker_file", "video_file", "prior_file", "camera_file", "body_file")
"""The files a session is made from, by the names ``session.toml`` has for them."""


@dataclass(frozen=True)
class MarkerSettings:
    """How the marker file is read; None means as the file says, else guessed and said.

    Attributes
    ----------
    up : vertical axis of the file
    units : length unit of the file
    subject : whose markers, where there are several people's
    rate : Hz
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


@dataclass(frozen=True)
class PriorSettings:
    """How a pose prior of another program is read.

    Attributes
    ----------
    rate : Hz of its frames, where its file does not say
    """

    rate: float | None = None


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


def _markers(given: Mapping[str, Any], settings: MarkerSettings, progress: Progress) -> Markers:
    from solver.io import load_markers
    from solver.markers_check import require_solvable

    markers = load_markers(
        given["marker_file"], up=settings.up, units=settings.units, subject=settings.subject, rate=settings.rate
    )
    markers = markers.between(settings.start, settings.stop)
    require_solvable(markers)
    return markers


def _landmarks(given: Mapping[str, Any], settings: LandmarkSettings, progress: Progress) -> Landmarks | None:
    if given["video_file"] is None:
        return None
    from solver.video.blazepose import track_pose
    from solver.video.flips import mend_flips

    landmarks = track_pose(given["video_file"], rate=settings.rate, progress=progress)
    return mend_flips(landmarks)[0] if settings.mend_flips else landmarks


def _prior(given: Mapping[str, Any], settings: PriorSettings, progress: Progress) -> PosePrior:
    if given["prior_file"] is not None:
        from solver.io.priors import load_prior

        return load_prior(given["prior_file"], fps=settings.rate)
    from solver.body.model import Body
    from solver.video.lift import lift

    # The embedded body's landmarks are the ones the network was matched to; rotations serve any body.
    return lift(given["landmarks"], Body.load(), progress)


def _sync(given: Mapping[str, Any], settings: SyncSettings, progress: Progress) -> Sync:
    from solver.sync import find_offset

    if settings.offset is not None:
        lags, score = np.array([settings.offset]), np.array([np.nan])
        return Sync(settings.offset, settings.rate_ratio or 1.0, 1.0, lags, score, method="given")
    watched = given["landmarks"]
    if watched is None:
        from solver.body.model import Body
        from solver.video.shadow import landmarks_of_prior

        watched = landmarks_of_prior(given["prior"], Body.load())
    if settings.rate_ratio is not None:
        watched = replace(watched, time=watched.time * settings.rate_ratio)
    window = None if settings.search_s is None else (-settings.search_s, settings.search_s)
    found = find_offset(watched, given["markers"], search=window)
    return found if settings.rate_ratio is None else replace(found, rate_ratio=found.rate_ratio * settings.rate_ratio)


def _segment(given: Mapping[str, Any], settings: SegmentSettings, progress: Progress) -> Segmentation:
    from solver.segment import segment

    return segment(given["markers"], settings, progress)


def _scene(given: Mapping[str, Any]) -> tuple[Any, Any, Any]:
    """The body with free bone lengths, what was observed on the markers' clock, and the landmarks' body points."""
    from solver.body.bones import with_bone_lengths
    from solver.body.model import Body
    from solver.solve.observe import observe

    body = with_bone_lengths(Body.load(given["body_file"]))
    sync: Sync = given["sync"]
    prior: PosePrior = given["prior"]
    seen, points = observe(given["markers"], prior, given["landmarks"], body, sync.offset, sync.rate_ratio)
    return body, seen, points


def _camera(path: Path | None) -> CameraResult | None:
    from solver.io.camera import read_camera

    return None if path is None else read_camera(path)


def _localize(given: Mapping[str, Any], settings: LocalizeSettings, progress: Progress) -> Localization:
    from solver.solve.method import localize

    body, seen, _ = _scene(given)
    left_out = given["segment"].clusters < 0
    return localize(body, seen, left_out, settings, _camera(given["camera_file"]))


def _orient(given: Mapping[str, Any], settings: OrientSettings, progress: Progress) -> Orientation:
    from solver.solve.method import orient

    body, seen, points = _scene(given)
    return orient(body, seen, points, given["localize"], settings, _camera(given["camera_file"]), progress)


def _fit(given: Mapping[str, Any], settings: FitSettings, progress: Progress) -> FittedMotion:
    from solver.solve.method import fit

    body, seen, points = _scene(given)
    return fit(
        body,
        seen,
        points,
        given["localize"],
        given["orient"],
        given["markers"].time,
        settings,
        progress,
    )


def _angles(given: Mapping[str, Any], settings: AngleSettings, progress: Progress) -> JointAngles:
    from solver.angles import joint_angles
    from solver.body.bones import with_bone_lengths
    from solver.body.model import Body

    body, motion = with_bone_lengths(Body.load(given["body_file"])), given["fit"]
    return joint_angles(
        motion.time, motion.rotations, body.landmarks(motion.betas), body.joints(motion.betas), settings
    )


def _surface(given: Mapping[str, Any], settings: NoSettings, progress: Progress) -> SurfaceDistance:
    from solver.body.bones import with_bone_lengths
    from solver.body.model import Body
    from solver.surface import surface_distance

    body, motion = with_bone_lengths(Body.load(given["body_file"])), given["fit"]
    return surface_distance(body, motion, given["markers"].positions, progress)


def _said_markers(markers: Markers) -> str:
    lost = 1 - markers.present.mean()
    seconds = len(markers.positions) / markers.rate
    return f"{len(markers.labels)} markers, {seconds:.2f} s at {markers.rate:g} Hz, {100 * lost:.1f} % lost"


def _said_landmarks(landmarks: Landmarks | None) -> str:
    if landmarks is None:
        return "no video"
    return f"person tracked in {landmarks.tracked.sum()} of {len(landmarks.tracked)} frames watched"


def _said_sync(sync: Sync) -> str:
    ratio = f", rate ratio {sync.rate_ratio:.5f}" if sync.rate_ratio != 1 else ""
    return f"marker time = video time {sync.offset:+.3f} s{ratio} ({sync.method}, confidence {sync.confidence:.2f})"


def _said_orientation(ranked: Orientation) -> str:
    best = ranked.candidates[0]
    margin = (
        "no other answer" if ranked.runner_up < 0 else f"next different answer costs {ranked.margin:.2f} times as much"
    )
    return f"{best.part}; {margin}; confidence {ranked.confidence:.2f}"


def _said_fit(motion: FittedMotion) -> str:
    residual = 1000 * np.nanmedian(motion.residual)
    return f"{len(motion.time)} frames, markers {residual:.1f} mm from their places (median)"


GRAPH = (
    Stage("markers", 1, MarkerSettings, ("marker_file",), _markers, Markers, _said_markers, 0.5),
    Stage("landmarks", 1, LandmarkSettings, ("video_file",), _landmarks, Landmarks | None, _said_landmarks, 16),
    Stage("prior", 1, PriorSettings, ("prior_file", "landmarks"), _prior, PosePrior, cost=2),
    Stage("sync", 1, SyncSettings, ("markers", "landmarks", "prior"), _sync, Sync, _said_sync, 1),
    Stage(
        "segment",
        1,
        SegmentSettings,
        ("markers",),
        _segment,
        Segmentation,
        lambda found: f"{found.count} clusters",
        0.3,
    ),
    Stage(
        "localize",
        1,
        LocalizeSettings,
        ("markers", "segment", "prior", "landmarks", "sync", "camera_file", "body_file"),
        _localize,
        Localization,
        lambda found: f"{len(found.start)} hypotheses",
        1,
    ),
    Stage(
        "orient",
        1,
        OrientSettings,
        ("markers", "localize", "prior", "landmarks", "sync", "camera_file", "body_file"),
        _orient,
        Orientation,
        _said_orientation,
        3,
    ),
    Stage(
        "fit",
        1,
        FitSettings,
        ("markers", "localize", "orient", "prior", "landmarks", "sync", "body_file"),
        _fit,
        FittedMotion,
        _said_fit,
        3,
    ),
    Stage(
        "angles", 1, AngleSettings, ("fit", "body_file"), _angles, JointAngles, lambda a: f"{len(a.names)} angles", 0.2
    ),
    Stage(
        "surface",
        1,
        NoSettings,
        ("fit", "markers", "body_file"),
        _surface,
        SurfaceDistance,
        lambda found: f"m2s {1000 * found.mean:.1f} mm",
        1,
    ),
)
"""Every stage of the default method."""
