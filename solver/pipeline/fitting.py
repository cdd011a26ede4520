"""The stages that fit the body and read it off: pure functions of what the stages before them found."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.angles.angles import AngleSettings
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.progress import Progress
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.known.neutral import Neutral, NeutralSettings
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.surface import SurfaceDistance
from markerscope.solver.pipeline.cleaning import measured
from markerscope.solver.pipeline.stage import NoSettings

if TYPE_CHECKING:
    from markerscope.solver.body.model import Body
    from markerscope.solver.fit.kinematics import Points
    from markerscope.solver.fit.state import Observations


def group_markers(given: Mapping[str, Any], settings: SegmentSettings, progress: Progress) -> Segmentation:
    """Markers that move together."""
    from markerscope.solver.clustering.segment import segment

    return segment(given["clean"].markers, settings, progress)


def scene(given: Mapping[str, Any]) -> tuple[Body, Observations, Points]:
    """The body with free bone lengths, what was observed on the markers' clock, and the landmarks' body points."""
    from markerscope.solver.fit.observe import observe

    body, sync, markers = _body(given), given["sync"], measured(given["clean"])
    seen, points = observe(markers, given["prior"], given["landmarks"], body, sync.offset, sync.rate_ratio)
    return body, seen, points


def _camera(path: Path | None, image_size: tuple[int, int]) -> CameraResult | None:
    """The camera of another trial, as it sees this video."""
    from markerscope.solver.io.camera import read_camera, resized

    return None if path is None else resized(read_camera(path), image_size, path)


def place_markers(given: Mapping[str, Any], settings: LocalizeSettings, progress: Progress) -> Localization:
    """Hypotheses of where on the body the markers sit."""
    from markerscope.solver.fit.method import localize

    body, seen, _ = scene(given)
    left_out = given["segment"].clusters < 0
    camera = _camera(given["camera_file"], seen.image_size)
    return localize(body, seen, left_out, settings, camera)


def rank_placements(given: Mapping[str, Any], settings: OrientSettings, progress: Progress) -> Orientation:
    """The hypotheses fitted and ranked."""
    from markerscope.solver.fit.method import orient

    body, seen, points = scene(given)
    camera = _camera(given["camera_file"], seen.image_size)
    return orient(body, seen, points, given["localize"], settings, camera, progress)


def fit_every_frame(given: Mapping[str, Any], settings: FitSettings, progress: Progress) -> FittedMotion:
    """The chosen answer carried to every frame."""
    from markerscope.solver.fit.method import fit

    body, seen, points = scene(given)
    time = given["clean"].markers.time
    return fit(body, seen, points, given["localize"], given["orient"], time, settings, progress)


def _body(given: Mapping[str, Any]) -> Body:
    """The body with free bone lengths."""
    from markerscope.solver.body.bones import with_bone_lengths
    from markerscope.solver.body.model import Body

    return with_bone_lengths(Body.load(given["body_file"]))


def find_neutral(given: Mapping[str, Any], settings: NeutralSettings, progress: Progress) -> Neutral:
    """The pose that angles are counted from, if the user named one."""
    from markerscope.solver.fit.known.neutral import neutral_file, neutral_span
    from markerscope.solver.io import load_markers

    path, motion = given["neutral_file"], given["fit"]
    if path is not None:
        markers = load_markers(path, up=settings.up, units=settings.units)
        return neutral_file(_body(given), motion, markers, settings)
    if settings.start is None and settings.stop is None:
        return Neutral()
    return neutral_span(motion, settings)


def read_angles(given: Mapping[str, Any], settings: AngleSettings, progress: Progress) -> JointAngles:
    """Joint angles of the fitted body, relative to the neutral pose where there is one."""
    from markerscope.solver.angles.angles import joint_angles, relative_to
    from markerscope.solver.fit.known.neutral import facing

    body, motion, neutral = _body(given), given["fit"], given["neutral"]
    shaped = body.landmarks(motion.betas), body.joints(motion.betas)
    angles = joint_angles(motion.time, motion.rotations, *shaped, settings)
    if neutral.zero == "recorded":
        return angles
    zero = joint_angles(motion.time[:1], facing(neutral, motion), *shaped, settings)
    return relative_to(angles, zero, neutral.where, neutral.same_lab_heading)


def measure_surface(given: Mapping[str, Any], settings: NoSettings, progress: Progress) -> SurfaceDistance:
    """How far the markers are from the fitted skin."""
    from markerscope.solver.fit.surface import surface_distance

    return surface_distance(_body(given), given["fit"], measured(given["clean"]).positions, progress)


def check_result(given: Mapping[str, Any], settings: NoSettings, progress: Progress) -> Verdict:
    """What speaks against the result, by every rule there is."""
    from markerscope.solver.fit.doubts.doubt import Evidence
    from markerscope.solver.fit.doubts.rigid import greatest_distance
    from markerscope.solver.fit.doubts.rules import verdict
    from markerscope.solver.fit.observe import on_clock
    from markerscope.solver.sync.offset import lead

    motion, surface, sync, found = given["fit"], given["surface"], given["sync"], given["localize"]
    ranked: Orientation = given["orient"]
    video, tracked = on_clock(given["prior"], motion.time, sync.offset, sync.rate_ratio)
    nothing = np.zeros(0, dtype=int)
    evidence = Evidence(
        labels=given["clean"].markers.labels,
        joint=motion.marker_joint,
        residual=motion.residual,
        skin=surface.per_marker,
        m2s=surface.mean,
        affinity=given["segment"].affinity,
        rotations=motion.rotations,
        video=video,
        tracked=tracked,
        reprojection=motion.camera.reprojection_px,
        image_size=motion.camera.image_size,
        sync_confidence=sync.confidence,
        sync_lead=lead(sync),
        still=getattr(found, "still", nothing),  # the published method leaves nothing out
        cloud=getattr(found, "cloud", nothing),
        taken=getattr(found, "taken", 0),
        far=ranked.far,
        mirror=ranked.mirror,
        span=greatest_distance(motion.placed[len(motion.time) // 2]),
    )
    return verdict(evidence, motion.confidence)
