"""From keyframes to every frame: what is carried over exactly, what a result says of its markers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Pose, forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.refine import carried_over, every_frame, set_on_markers
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights
from tests.fit.conftest import Scene, simulate

FRAMES = 24


def exact(body: Body, frames: int = FRAMES) -> tuple[Scene, State, Surface]:
    """Markers without noise on known places, and a video whose joints are each off by the same turn all the time."""
    scene = simulate(body, 9, frames=frames, markers=40)
    skin = Skin(body, scene.pose.betas)
    vertices = np.random.default_rng(0).choice(skin.index, 40, replace=False)
    placement, surface = skin.on_vertices(vertices, 0.0095)
    where = place_points(placement, forward(body, scene.pose), scene.pose.betas)
    wrong = exp_so3(np.random.default_rng(1).normal(0, 0.15, (24, 3)))
    prior = scene.pose.rotations @ np.swapaxes(wrong, -1, -2)
    prior[:, 0] = scene.camera.R_lab_cam.T @ prior[:, 0]
    none = np.full_like(scene.seen.image, np.nan)
    seen = replace(scene.seen, markers=where, prior=prior, image=none)
    return replace(scene, seen=seen), State(scene.pose, placement, scene.camera), surface


def at_keyframes(state: State, keyframes: np.ndarray) -> State:
    return replace(state, pose=state.pose.at(keyframes))


def off_deg(found: Pose, truth: Pose) -> np.ndarray:
    return np.degrees(np.linalg.norm(log_so3(np.swapaxes(truth.rotations, -1, -2) @ found.rotations), axis=-1))


def test_a_video_that_is_always_wrong_alike_is_put_right_in_every_frame(free_body: Body) -> None:
    """The keyframes tell how wrong it is; between them the video's movement is kept, root and limbs alike."""
    scene, state, _ = exact(free_body)
    keyframes = np.array([0, 7, 20])
    found = carried_over(free_body, scene.seen, keyframes, at_keyframes(state, keyframes))
    assert off_deg(found, scene.pose).max() < 1e-5
    np.testing.assert_allclose(found.trans, scene.pose.trans, atol=1e-9)


def test_bodies_are_set_on_the_markers_that_are_seen(free_body: Body) -> None:
    scene, state, _ = exact(free_body)
    shift = np.random.default_rng(2).normal(0, 0.3, (FRAMES, 3))
    moved = replace(scene.pose, trans=scene.pose.trans + shift)
    markers = scene.seen.markers.copy()
    markers[np.random.default_rng(3).random(markers.shape[:2]) < 0.4] = np.nan
    markers[5] = np.nan
    found = set_on_markers(free_body, replace(scene.seen, markers=markers), state.placement, moved)
    there = np.arange(FRAMES) != 5
    np.testing.assert_allclose(found.trans[there], scene.pose.trans[there], atol=1e-7)
    np.testing.assert_allclose(found.trans[5], moved.trans[5], atol=1e-12, err_msg="nothing says where it was")


def test_every_frame_is_solved_those_after_the_first_chunk_too(free_body: Body) -> None:
    scene, state, surface = exact(free_body, frames=140)
    rng = np.random.default_rng(4)
    jitter = exp_so3(np.radians(6) * rng.normal(size=(140, 24, 3)) / np.sqrt(3))
    jitter[:, [INDEX[f"{s}_hand"] for s in ("left", "right")]] = np.eye(3)
    seen = replace(scene.seen, prior=scene.pose.rotations @ jitter)
    seen.prior[:, 0] = scene.camera.R_lab_cam.T @ seen.prior[:, 0]
    keyframes = np.arange(0, 140, 20)
    weights = Weights(prior_deg=20.0, anatomical=0.003)
    fitted = at_keyframes(state, keyframes)
    found = every_frame(free_body, seen, scene.landmarks, keyframes, fitted, surface, weights).pose
    assert len(found.trans) == 140
    where = place_points(state.placement, forward(free_body, found), found.betas)
    off = 1000 * np.linalg.norm(where - seen.markers, axis=2)
    assert np.median(off, axis=1).max() < 5, f"{np.median(off, axis=1).max():.1f} mm"
    begun = carried_over(free_body, seen, keyframes, at_keyframes(state, keyframes))
    legs = [INDEX[f"{s}_{j}"] for s in ("left", "right") for j in ("hip", "knee")]
    before, after = (off_deg(pose, scene.pose)[:, legs].mean() for pose in (begun, found))
    assert after < 0.6 * before, f"{before:.2f} degrees before, {after:.2f} after"


def test_a_result_says_where_each_marker_in_use_was_and_nothing_of_the_others(free_body: Body) -> None:
    scene, state, _ = exact(free_body)
    used = np.array([5, 1, 30])
    markers = np.full((FRAMES, 43, 3), np.nan)
    markers[:, :40] = scene.seen.markers
    markers[:, 5] += [0.003, 0.0, 0.004]
    markers[4, 1] = np.nan
    sites = np.array([INDEX["left_knee"], INDEX["neck"], 0]), np.array([700, 800, 900])
    nowhere = CameraResult(np.eye(3), np.zeros(3), 900.0, (0, 0), float("nan"))
    motion = motion_from(
        free_body, markers, np.arange(FRAMES) / 30, scene.pose, used, state.placement.take(used), sites, camera=nowhere
    )
    others = np.setdiff1d(np.arange(43), used)
    assert motion.marker_joint[used].tolist() == sites[0].tolist()
    assert motion.marker_vertex[used].tolist() == sites[1].tolist()
    assert (motion.marker_joint[others] == -1).all()
    assert (motion.marker_vertex[others] == -1).all()
    assert np.isnan(motion.placed[:, others]).all()
    assert np.isnan(motion.residual[:, others]).all()
    np.testing.assert_allclose(motion.residual[:, 5], 0.005, atol=1e-9)
    assert np.isnan(motion.residual[4, 1])
    np.testing.assert_allclose(np.delete(motion.residual[:, 1], 4), 0, atol=1e-9)
    np.testing.assert_allclose(motion.joints, scene.joints, atol=1e-12)


def test_a_camera_puts_points_before_it_where_a_pinhole_does_and_none_behind_it_at_infinity() -> None:
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 100.0)
    behind = camera.project(np.array([[0.1, 0, -1.0], [0.1, 0, 1.0]]), (640, 480))
    np.testing.assert_allclose(behind, [[320 + 100 * 0.1 / 0.05, 240], [330, 240]])


def test_some_frames_of_what_was_seen_are_all_of_it_at_these(free_body: Body) -> None:
    scene, _, _ = exact(free_body)
    some = scene.seen.at(np.array([3, 1]))
    assert isinstance(some, Observations)
    for name in ("markers", "prior", "tracked", "image", "visibility"):
        np.testing.assert_array_equal(getattr(some, name), getattr(scene.seen, name)[[3, 1]])
    np.testing.assert_allclose(scene.seen.lab_centre, scene.seen.markers.reshape(-1, 3).mean(axis=0))
    assert some.image_size == scene.seen.image_size
    assert pytest.approx(float(np.trace(scene.camera.R_lab_cam @ scene.camera.R_lab_cam.T))) == 3
