"""Standard errors against finite differences, against the scatter of repeated solves, and for what they should tell."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from markerscope.solver.angles.angles import AngleSettings, Convention, joint_angles, read_angles
from markerscope.solver.angles.slopes import angle_slopes
from markerscope.solver.body.anatomy import SEGMENT_JOINT, segment_frames
from markerscope.solver.body.model import Body
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.converge import settle
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.results import FittedMotion, Solution
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.standard_errors import propagate
from markerscope.solver.fit.standard_errors.calibrated import FACTORS, factors
from markerscope.solver.fit.standard_errors.frames import definition_spread, frames_and_slopes
from markerscope.solver.fit.state import Observations, State
from tests.fit.conftest import drawn_vertices, simulate

FRAMES = 12


def solved(
    body: Body, seed: int = 3, noise: float = 0.002, frames: int = FRAMES, still: bool = False, legs: bool = False
) -> tuple[Observations, Points, FittedMotion, Pose]:
    """Markers of known places about a known pose, each frame settled: what is seen, the motion, and the true poses."""
    scene = simulate(body, seed, frames=FRAMES, markers=40)
    rng = np.random.default_rng(seed)
    take = np.zeros(frames, int) if still else np.arange(frames) % FRAMES
    pose, skin = scene.pose.at(take), Skin(body, scene.pose.betas)
    vertices = drawn_vertices(body, scene.bones, seed)
    if legs:
        bones = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("hip", "knee", "ankle")]
        vertices = rng.choice(skin.index[np.isin(body.weights[skin.index].argmax(axis=1), bones)], 30, replace=False)
    placement, surface = skin.on_vertices(vertices, 0.0095)
    markers = place_points(placement, forward(body, pose), pose.betas)
    markers = markers + rng.normal(0, noise, markers.shape)
    none = np.zeros((frames, 0))
    seen = Observations(
        markers, scene.seen.prior[take], np.ones(frames, bool), none[..., None].repeat(2, -1), none, (0, 0)
    )
    points, weights = Points.none(body.shape_count), FitSettings().weights()
    state = State(pose, placement, scene.camera)
    found = settle(body, seen, points, state, surface, weights, pose)
    camera = scene.camera
    result = CameraResult(
        camera.R_lab_cam, camera.centre - camera.R_lab_cam @ camera.shift, camera.focal, (720, 960), np.nan
    )
    used = np.arange(len(vertices))
    sites = (body.weights[vertices].argmax(axis=1), vertices)
    motion = motion_from(body, markers, np.arange(frames) / 30, found, used, placement, sites, camera=result)
    solution = Solution(np.arange(min(frames, FRAMES)), placement, surface, state.bias, weights)
    return seen, points, replace(motion, solution=solution), pose


def errors_of(body: Body, seen: Observations, points: Points, motion: FittedMotion, **more: object) -> AngleErrors:
    return propagate.standard_errors(body, seen, points, motion, AngleSettings(), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("convention", get_args(Convention))
def test_the_slopes_of_angles_are_those_of_their_reading(convention: Convention) -> None:
    rng, settings = np.random.default_rng(4), AngleSettings(convention)
    segments = {
        name: np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]).T @ exp_so3(rng.normal(0, 0.12, (6, 3)))
        for name in SEGMENT_JOINT
    }
    slopes, near, far = angle_slopes(segments, settings)
    before, step = read_angles(np.arange(6.0), segments, settings), 1e-5
    for segment in SEGMENT_JOINT:
        for axis in range(3):
            turned = {**segments, segment: exp_so3(step * np.eye(3)[axis]) @ segments[segment]}
            after = read_angles(np.arange(6.0), turned, settings)
            change = np.radians(after.degrees - before.degrees) / step
            for i, name in enumerate(before.names):
                expected = slopes[:, i, axis] * ((far[i] == segment) - float(near[i] == segment))
                good = ~(before.singular | after.singular)[:, i]
                off = 1e-3 * max(1.0, float(np.abs(expected).max()))
                assert np.allclose(change[good, i], expected[good], atol=off), name


def test_frames_turn_with_the_shape_as_finite_differences_say(free_body: Body) -> None:
    rng = np.random.default_rng(2)
    betas = rng.normal(0, 0.5, free_body.shape_count)
    for convention in ("opensim", "isb"):
        found = frames_and_slopes(free_body, betas, AngleSettings(convention))
        for k in (0, free_body.shape_count - 1):
            step = 1e-5 * np.eye(free_body.shape_count)[k]
            ahead, behind = (
                frames_and_slopes(free_body, betas + d, AngleSettings(convention)).frames for d in (step, -step)
            )
            for name, slope in found.by_shape.items():
                turn = log_so3(ahead[name] @ behind[name].T) / 2e-5
                assert np.allclose(turn, slope[:, k], atol=1e-5), name


def test_the_definitions_that_ship_differ_by_what_the_table_says(free_body: Body) -> None:
    none = np.zeros(free_body.shape_count)
    usual = {"pelvis": "spines", "thorax": "isb", "upper_arm": "epicondyles", "forearm": "wrist"}
    pairs = {
        "pelvis": ("upright", "spines"),
        "thorax": ("model", "isb"),
        "upper_arm": ("model", "epicondyles"),
        "forearm": ("wrist", "ulna"),
    }
    for part, both in pairs.items():
        one, other = (
            segment_frames(free_body.landmarks(none), free_body.joints(none), **{**usual, part: way})  # type: ignore[arg-type]
            for way in both
        )
        name = part if part in one else f"right_{part}"
        half = np.abs(np.degrees(log_so3(one[name].T @ other[name]))) / 2
        told = definition_spread()[part]
        assert (told >= half - 0.06).all() and told[half.argmax()] == pytest.approx(half.max(), abs=0.06)


def test_a_pose_solved_again_and_again_scatters_as_the_shape_error_says(free_body: Body) -> None:
    seen, points, motion, _ = solved(free_body, noise=0.003, frames=150, still=True)
    bars = errors_of(free_body, seen, points, motion)
    body = free_body.landmarks(motion.betas), free_body.joints(motion.betas)
    angles = joint_angles(motion.time, motion.rotations, *body, AngleSettings())
    held = np.arange(len(angles.names))[[n.startswith(("hip", "knee", "lumbar")) for n in angles.names]]
    scatter = angles.degrees[:, held].std(axis=0)
    told = np.sqrt((bars.shape[:, held] ** 2).mean(axis=0))
    told /= factors("markers", bars.video_deg, bars.marker_mm)[0]
    # The pose of the video is the same in every frame here, so that what moves is the noise of the markers alone.
    assert (scatter < 1.15 * told).all() and np.median(told / scatter) < 1.8
    assert bars.marker_mm == pytest.approx(3.0, rel=0.35)


def test_more_noise_makes_wider_bars(free_body: Body) -> None:
    quiet, loud = (errors_of(free_body, *solved(free_body, noise=noise)[:3]) for noise in (0.001, 0.008))
    assert loud.marker_mm > 2.5 * quiet.marker_mm
    assert np.nanmedian(loud.shape) > 1.3 * np.nanmedian(quiet.shape)
    assert np.nanmedian(loud.level) > np.nanmedian(quiet.level)


def test_what_no_marker_shows_is_said_to_be_unsure(free_body: Body) -> None:
    seen, points, motion, _ = solved(free_body, legs=True)
    bars = errors_of(free_body, seen, points, motion)
    mean = {name: bars.mean_of(name) for name in bars.names}
    for side in "rl":
        knee, elbow = mean[f"knee_angle_{side}"], mean[f"elbow_flex_{side}"]
        assert np.hypot(elbow["shape"], elbow["level"]) > 1.5 * np.hypot(knee["shape"], knee["level"])


def test_a_neutral_pose_takes_the_level_off(free_body: Body) -> None:
    seen, points, motion, _ = solved(free_body)
    plain = errors_of(free_body, seen, points, motion)
    frame = 4
    zero = errors_of(free_body, seen, points, motion, neutral=motion.rotations[frame])
    # In the neutral frame itself nothing of the level is left but what its own noise leaves.
    most = max(level / shape for shape, level in FACTORS.values())
    assert (zero.level[frame] <= 1.02 * most * plain.shape[frame]).all()
    assert np.nanmedian(zero.level) < 0.75 * np.nanmedian(plain.level)
    assert np.median(zero.definition) < 0.75 * np.median(plain.definition)


def test_what_is_not_defined_has_no_error(free_body: Body) -> None:
    seen, points, motion, _ = solved(free_body)
    names = errors_of(free_body, seen, points, motion).names
    singular = np.zeros((len(motion.time), len(names)), bool)
    singular[3:5, 2] = True
    bars = errors_of(free_body, seen, points, motion, singular=singular)
    assert (np.isnan(bars.total) == singular).all() and np.isfinite(bars.definition).all()
