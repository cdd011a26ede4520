"""The stages that fit the body and read it off: pure functions of what the stages before them found."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypedDict, Unpack, cast

import numpy as np

from markerscope.solver.angles.angles import AngleSettings, Convention
from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.known.neutral import Neutral, NeutralSettings
from markerscope.solver.fit.published.results import PaperLocalization
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.standard_errors.settings import ErrorSettings
from markerscope.solver.fit.surface import SurfaceDistance
from markerscope.solver.pipeline.stage import NoSettings
from markerscope.solver.sync.offset import Sync

if TYPE_CHECKING:
    from markerscope.solver.body.model import Body
    from markerscope.solver.fit.kinematics import Points
    from markerscope.solver.fit.state import Observations


class FittedTo(TypedDict):
    """What every stage of the fit looks at."""

    clean: Cleaned
    prior: PosePrior
    landmarks: Landmarks | None
    sync: Sync
    body_file: Path | None


def group_markers(settings: SegmentSettings, progress: Progress, *, clean: Cleaned) -> Segmentation:
    """Markers that move together."""
    from markerscope.solver.clustering.segment import segment

    return segment(clean.markers, settings, progress)


def scene(**given: Unpack[FittedTo]) -> tuple[Body, Observations, Points]:
    """The body with free bone lengths, what was observed on the markers' clock, and the landmarks' body points."""
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.observe import observe

    body, sync, markers = load_body(given["body_file"]), given["sync"], given["clean"].measured
    seen, points = observe(markers, given["prior"], given["landmarks"], body, sync.offset, sync.rate_ratio)
    return body, seen, points


def _camera(path: Path | None, image_size: tuple[int, int]) -> CameraResult | None:
    """The camera of another trial, as it sees this video."""
    from markerscope.solver.io.camera import read_camera, resized

    return None if path is None else resized(read_camera(path), image_size, path)


def place_markers(
    settings: LocalizeSettings,
    progress: Progress,
    *,
    segment: Segmentation,
    camera_file: Path | None,
    **given: Unpack[FittedTo],
) -> Localization:
    """Hypotheses of where on the body the markers sit."""
    from markerscope.solver.fit import method

    body, seen, _ = scene(**given)
    left_out = segment.clusters < 0
    camera = _camera(camera_file, seen.image_size)
    return method.localize(body, seen, left_out, settings, camera)


def rank_placements(
    settings: OrientSettings,
    progress: Progress,
    *,
    localize: Localization,
    camera_file: Path | None,
    **given: Unpack[FittedTo],
) -> Orientation:
    """The hypotheses fitted and ranked."""
    from markerscope.solver.fit import method

    body, seen, points = scene(**given)
    camera = _camera(camera_file, seen.image_size)
    return method.orient(body, seen, points, localize, settings, camera, progress)


def fit_every_frame(
    settings: FitSettings,
    progress: Progress,
    *,
    localize: Localization,
    orient: Orientation,
    known_file: Path | None,
    **given: Unpack[FittedTo],
) -> FittedMotion:
    """The chosen answer carried to every frame; of a known person, with the shape and the places known of them."""
    from markerscope.solver.fit import method
    from markerscope.solver.fit.known.hold import held_to
    from markerscope.solver.fit.known.person_file import read_person

    body, seen, points = scene(**given)
    time = given["clean"].markers.time
    hold = None if known_file is None else held_to(body, read_person(known_file, body))
    return method.fit(body, seen, points, localize, orient, time, settings, progress, hold)


def find_neutral(
    settings: NeutralSettings,
    progress: Progress,
    *,
    fit: FittedMotion,
    neutral_file: Path | None,
    body_file: Path | None,
) -> Neutral:
    """The pose that angles are counted from, if the user named one."""
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.known import neutral
    from markerscope.solver.io import load_markers

    if neutral_file is not None:
        markers = load_markers(neutral_file, up=settings.up, units=settings.units)
        return neutral.neutral_file(load_body(body_file), fit, markers, settings)
    if settings.start is None and settings.stop is None:
        return Neutral()
    return neutral.neutral_span(fit, settings)


def read_angles(
    settings: AngleSettings, progress: Progress, *, fit: FittedMotion, neutral: Neutral, body_file: Path | None
) -> JointAngles:
    """Joint angles of the fitted body, relative to the neutral pose where there is one."""
    from markerscope.solver.angles.angles import joint_angles, relative_to
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.known.neutral import facing

    body = load_body(body_file)
    shaped = body.landmarks(fit.betas), body.joints(fit.betas)
    angles = joint_angles(fit.time, fit.rotations, *shaped, settings)
    if neutral.zero == "recorded":
        return angles
    zero = joint_angles(fit.time[:1], facing(neutral, fit), *shaped, settings)
    return relative_to(angles, zero, neutral.where, neutral.same_lab_heading)


def estimate_errors(
    settings: ErrorSettings,
    progress: Progress,
    *,
    localize: Localization | PaperLocalization,
    orient: Orientation,
    fit: FittedMotion,
    neutral: Neutral,
    angles: JointAngles,
    **given: Unpack[FittedTo],
) -> AngleErrors | None:
    """How far off each angle may be; None where the method leaves nothing to tell it from."""
    from markerscope.solver.fit.method import in_use
    from markerscope.solver.fit.standard_errors.propagate import standard_errors

    if fit.solution is None or not isinstance(localize, Localization):
        return None
    body, seen, points = scene(**given)
    used = in_use(seen, localize, orient)
    convention = AngleSettings(cast(Convention, angles.convention))
    return standard_errors(body, used, points, fit, convention, neutral.rotations, angles.singular, progress)


def measure_surface(
    settings: NoSettings, progress: Progress, *, fit: FittedMotion, clean: Cleaned, body_file: Path | None
) -> SurfaceDistance:
    """How far the markers are from the fitted skin."""
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.surface import surface_distance

    return surface_distance(load_body(body_file), fit, clean.measured.positions, progress)


def check_result(
    settings: NoSettings,
    progress: Progress,
    *,
    clean: Cleaned,
    prior: PosePrior,
    sync: Sync,
    segment: Segmentation,
    localize: Localization | PaperLocalization,
    orient: Orientation,
    fit: FittedMotion,
    surface: SurfaceDistance,
) -> Verdict:
    """What speaks against the result, by every rule there is."""
    from markerscope.solver.fit.doubts.doubt import Evidence
    from markerscope.solver.fit.doubts.rigid import greatest_distance
    from markerscope.solver.fit.doubts.rules import verdict
    from markerscope.solver.fit.observe import on_clock
    from markerscope.solver.sync.offset import lead, rival

    video, tracked = on_clock(prior, fit.time, sync.offset, sync.rate_ratio)
    still, cloud, taken = np.zeros(0, dtype=int), np.zeros(0, dtype=int), 0
    if isinstance(localize, Localization):  # the published method leaves nothing out
        still, cloud, taken = localize.still, localize.cloud, localize.taken
    evidence = Evidence(
        labels=clean.markers.labels,
        joint=fit.marker_joint,
        residual=fit.residual,
        skin=surface.per_marker,
        m2s=surface.mean,
        affinity=segment.affinity,
        rotations=fit.rotations,
        video=video,
        tracked=tracked,
        reprojection=fit.camera.reprojection_px,
        image_size=fit.camera.image_size,
        sync_confidence=sync.confidence,
        sync_lead=lead(sync),
        sync_rival=rival(sync),
        still=still,
        cloud=cloud,
        taken=taken,
        far=orient.far,
        mirror=orient.mirror,
        span=greatest_distance(fit.placed[len(fit.time) // 2]),
        second=fit.second,
    )
    return verdict(evidence, fit.confidence)
