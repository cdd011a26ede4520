"""The stages of a solve, as data: what each is computed from, with which settings, and what it leaves."""

from __future__ import annotations

import numpy as np

from markerscope.solver.angles.angles import AngleSettings
from markerscope.solver.body.model import EMBEDDED
from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.known.neutral import Neutral, NeutralSettings
from markerscope.solver.fit.pull.results import said as said_pull
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.standard_errors.settings import ErrorSettings
from markerscope.solver.fit.surface import SurfaceDistance
from markerscope.solver.pipeline import cleaning, fitting, inputs
from markerscope.solver.pipeline.cleaning import CleaningSettings
from markerscope.solver.pipeline.inputs import LandmarkSettings, MarkerSettings, PriorSettings, SyncSettings
from markerscope.solver.pipeline.stage import NoSettings, Stage
from markerscope.solver.sync.offset import Sync

SOURCES = (
    "marker_file",
    "video_file",
    "prior_file",
    "camera_file",
    "body_file",
    "weights_file",
    "neutral_file",
    "known_file",
)
"""The files a session is made from, by the names ``session.toml`` has for them."""
POSED_BY = {"video_file", "prior_file", "known_file"}
"""Of these a session has at least one: where poses come from."""


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


def said_segmentation(found: Segmentation) -> str:
    """How many groups."""
    return f"{found.count} groups of markers that move together"


def said_localization(found: Localization) -> str:
    """How many ways there are."""
    return f"{len(found.start)} ways to put the markers on the body"


def said_orientation(ranked: Orientation) -> str:
    """The best answer, and how far the next is behind."""
    best = ranked.candidates[0]
    margin = (
        "no other answer" if ranked.runner_up < 0 else f"next different answer costs {ranked.margin:.2f} times as much"
    )
    return f"{best.part}; {margin}"


def said_fit(motion: FittedMotion) -> str:
    """How near the markers are."""
    residual = 1000 * np.nanmedian(motion.residual)
    said = f"{len(motion.time)} frames, markers {residual:.1f} mm from their places (median)"
    if motion.settled is not None:
        which = "all" if motion.settled.all() else f"{motion.settled.sum()} of them"
        said = f"{said}, {which} iterated to {motion.settled_deg:g} degrees"
    return said if motion.pull is None else f"{said}; {said_pull(motion.pull)}"


def _said_surface(found: SurfaceDistance) -> str:
    return f"markers {1000 * found.mean:.1f} mm from the skin (m2s)"


def _said_check(found: Verdict) -> str:
    kinds = ", ".join(doubt.kind for doubt in found.doubts)
    return f"confidence {found.confidence:.2f}; {f'in doubt: {kinds}' if kinds else 'no rule speaks against it'}"


def said_neutral(neutral: Neutral) -> str:
    """What angles are counted from."""
    if neutral.zero == "recorded":
        return "none: angles are counted from the convention's zero"
    count, expected = neutral.matched
    if not expected:
        return neutral.where
    return f"{neutral.where}, {count} of {expected} markers, {1000 * neutral.residual:.1f} mm from their places"


def _said_angles(angles: JointAngles) -> str:
    said = f"{len(angles.names)} angles ({angles.title})"
    return f"{said}; {angles.hint}" if angles.hint else said


def _said_errors(errors: AngleErrors | None) -> str:
    if errors is None:
        return "none by this method"
    level, shape = (float(np.nanmedian(part)) for part in (errors.level, errors.shape))
    return f"median over angles and frames: level {level:.1f} degrees, shape {shape:.1f} degrees"


FITTED_TO = (*fitting.FittedTo.__annotations__,)
"""What every stage of the fit looks at."""
BODY = (EMBEDDED,)
"""Read by every stage that sees a body: a user's own, too, takes its landmarks from the embedded one."""

GRAPH = (
    Stage("markers", 1, MarkerSettings, ("marker_file",), inputs.read_markers, Markers, _said_markers, cost=0.5),
    Stage(
        "clean", 3, CleaningSettings, ("markers",), cleaning.clean_markers, Cleaned, cleaning.said_cleaning, cost=0.5
    ),
    Stage(
        "landmarks",
        1,
        LandmarkSettings,
        ("video_file",),
        inputs.watch_video,
        Landmarks | None,
        _said_landmarks,
        cost=16,
    ),
    Stage(
        "prior",
        2,
        PriorSettings,
        ("prior_file", "landmarks"),
        inputs.pose_prior,
        PosePrior,
        cost=2,
        shipped=BODY,
        one_of=("video_file", "prior_file"),
    ),
    Stage(
        "sync",
        1,
        SyncSettings,
        ("clean", "landmarks", "prior"),
        inputs.synchronise,
        Sync,
        _said_sync,
        cost=1,
        shipped=BODY,
    ),
    Stage("segment", 1, SegmentSettings, ("clean",), fitting.group_markers, Segmentation, said_segmentation, cost=0.3),
    Stage(
        "localize",
        4,
        LocalizeSettings,
        (*FITTED_TO, "segment", "camera_file"),
        fitting.place_markers,
        Localization,
        said_localization,
        cost=2,
        shipped=BODY,
    ),
    Stage(
        "orient",
        7,
        OrientSettings,
        (*FITTED_TO, "localize", "camera_file"),
        fitting.rank_placements,
        Orientation,
        said_orientation,
        cost=5,
        shipped=BODY,
    ),
    Stage(
        "fit",
        7,
        FitSettings,
        (*FITTED_TO, "localize", "orient", "known_file"),
        fitting.fit_every_frame,
        FittedMotion,
        said_fit,
        cost=2,
        shipped=BODY,
    ),
    Stage(
        "neutral",
        1,
        NeutralSettings,
        ("fit", "neutral_file", "body_file"),
        fitting.find_neutral,
        Neutral,
        said_neutral,
        cost=0.2,
        shipped=BODY,
    ),
    Stage(
        "angles",
        5,
        AngleSettings,
        ("fit", "neutral", "body_file"),
        fitting.read_angles,
        JointAngles,
        _said_angles,
        cost=0.1,
        shipped=BODY,
    ),
    Stage(
        "errors",
        1,
        ErrorSettings,
        (*FITTED_TO, "localize", "orient", "fit", "neutral", "angles"),
        fitting.estimate_errors,
        AngleErrors | None,
        _said_errors,
        cost=2,
        shipped=BODY,
    ),
    Stage(
        "surface",
        1,
        NoSettings,
        ("fit", "clean", "body_file"),
        fitting.measure_surface,
        SurfaceDistance,
        _said_surface,
        cost=2,
        shipped=BODY,
    ),
    Stage(
        "check",
        2,
        NoSettings,
        ("clean", "prior", "sync", "segment", "localize", "orient", "fit", "surface"),
        fitting.check_result,
        Verdict,
        _said_check,
        cost=0.1,
    ),
)
"""Every stage of the default method."""
