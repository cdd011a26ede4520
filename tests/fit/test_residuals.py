"""Evidence that is not there must not count: lost markers, landmarks out of sight; and each cost in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.anatomical import mean_pose
from markerscope.solver.fit.bundle import reattach
from markerscope.solver.fit.kinematics import Points, forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import FREE, Camera, State, Surface, Weights
from markerscope.solver.fit.terms.image import focal_residual, image_residual
from markerscope.solver.fit.terms.markers import marker_residual
from markerscope.solver.fit.terms.posture import habit_residual
from markerscope.solver.fit.terms.video_pose import video_residual
from tests.fit.conftest import Scene, simulate

MARKERS = 12


def at_truth(body: Body) -> tuple[Scene, State, Surface, Weights]:
    """A scene and its true state, set so that a place on the body, that of marker 0, passes the lab's origin."""
    scene = simulate(body, 7, frames=5, markers=MARKERS)
    links = forward(body, scene.pose)
    skin = Skin(body, scene.pose.betas)
    vertices = np.random.default_rng(3).choice(skin.index, MARKERS, replace=False)
    placement, surface = skin.on_vertices(vertices, 0.0095)
    where = place_points(placement, links, scene.pose.betas)
    shift = where[2, 0]
    pose = replace(scene.pose, trans=scene.pose.trans - shift)
    camera = replace(scene.camera, centre=scene.camera.centre - shift)
    noise = np.random.default_rng(4).normal(0, 0.006, where.shape)
    seen = replace(scene.seen, markers=where - shift + noise)
    return replace(scene, seen=seen, pose=pose, camera=camera), State(pose, placement, camera), surface, Weights()


def test_a_lost_marker_changes_neither_cost_nor_step(free_body: Body) -> None:
    scene, state, surface, weights = at_truth(free_body)
    others = np.arange(1, MARKERS)
    lost = scene.seen.markers.copy()
    lost[:, 0] = np.nan
    where = place_points(state.placement, forward(free_body, state.pose), state.pose.betas)
    assert np.linalg.norm(where[2, 0]) < 1e-9, "a lost sample that was taken for the origin would be within reach"

    with_lost = Problem(free_body, replace(scene.seen, markers=lost), scene.landmarks)
    without = Problem(free_body, replace(scene.seen, markers=scene.seen.markers[:, others]), scene.landmarks)
    fewer = replace(state, placement=state.placement.take(others))
    less = Surface(surface.point[others], surface.normal[others])
    costs = with_lost.energies(state, weights, surface), without.energies(fewer, weights, less)
    assert costs[0]["markers"] == pytest.approx(costs[1]["markers"], rel=1e-12)
    assert costs[0].total == pytest.approx(costs[1].total, rel=1e-12), "its place is at the usual height"

    moved = with_lost.step(state, weights, surface, 1e-3), without.step(fewer, weights, less, 1e-3)
    assert np.abs(moved[1].pose.trans - state.pose.trans).max() > 1e-4, "there is something to be done"
    np.testing.assert_allclose(moved[0].pose.trans, moved[1].pose.trans, atol=2e-6)
    np.testing.assert_allclose(moved[0].pose.rotations, moved[1].pose.rotations, atol=2e-5)
    np.testing.assert_allclose(moved[0].pose.betas, moved[1].pose.betas, atol=2e-4)
    np.testing.assert_allclose(moved[0].placement.rest[0], state.placement.rest[0], atol=1e-6)


def test_a_landmark_out_of_sight_counts_as_one_that_is_not_there(free_body: Body) -> None:
    scene, state, surface, weights = at_truth(free_body)
    hidden = np.arange(scene.seen.image.shape[1]) % 3 == 0
    image, absent = scene.seen.image.copy(), scene.seen.image.copy()
    image[:, hidden] += 40.0  # wrong, and said to be out of sight
    absent[:, hidden] = np.nan
    sight = np.where(hidden, 0.0, 1.0) * np.ones(image.shape[:2])
    person = Problem(free_body, scene.seen, scene.landmarks).person
    problems = []
    for pixels, visible in ((image, sight), (absent, sight), (image, np.ones_like(sight))):
        # The extent would be measured over whatever landmarks there are.
        seen = replace(scene.seen, image=pixels, visibility=visible)
        problems.append(Problem(free_body, seen, scene.landmarks, person))
    unseen, none, believed = (problem.energies(state, weights, surface)["image"] for problem in problems)
    assert unseen == pytest.approx(none, rel=1e-12)
    assert believed > 1.5 * unseen
    steps = [problem.step(state, weights, surface, 1e-3) for problem in problems]
    np.testing.assert_allclose(steps[0].camera.shift, steps[1].camera.shift, atol=1e-6)
    np.testing.assert_allclose(steps[0].pose.rotations, steps[1].pose.rotations, atol=2e-5)
    assert np.abs(steps[2].camera.shift - steps[0].camera.shift).max() > 1e-3


def test_a_marker_costs_what_geman_and_mcclure_say() -> None:
    """k^2 / s^2 of x / (1 + x) for x = (d / k)^2; its slope over the residual is the weight."""
    weights = Weights(marker=0.01, marker_kernel=0.03)
    where = np.array([[[0.03, 0, 0], [0, 0.01, 0], [0, 0, 3.0], [5.0, 5, 5]]])
    target, present = np.zeros((1, 4, 3)), np.array([[True, True, True, False]])
    residual, weight, cost = marker_residual(where, target, present, weights)
    np.testing.assert_array_equal(residual, where)
    np.testing.assert_allclose(cost[0], [9 * 0.5, 9 * (1 / 9) / (10 / 9), 9 * (1 - 1e-4), 0.0], rtol=1e-4)
    step = np.array([1e-7, 0, 0])
    risen = marker_residual(where + step, target, present, weights)[2][0, 0]
    fallen = marker_residual(where - step, target, present, weights)[2][0, 0]
    assert weight[0, 0] * 0.03 == pytest.approx((risen - fallen) / 4e-7, rel=1e-5)
    assert weight[0, 3] == 0


def test_a_landmark_costs_by_its_share_of_the_persons_height_and_by_its_visibility() -> None:
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 800.0)
    local = np.array([[[0.5, 0.0, 4.0], [0.0, -0.25, 2.0], [0.0, 0.0, -1.0]]])
    weights = Weights(image=0.025, image_kernel=3.0)
    pixels = np.array([[[320 + 100 + 10.0, 240], [320, 240 - 100.0], [320, 240]]])
    residual, weight, cost = image_residual(
        local, camera, pixels, np.array([[1.0, 0.5, 1.0]]), 400.0, (640, 480), weights
    )
    np.testing.assert_allclose(residual, [[[-10, 0], [0, 0], [0, 0]]], atol=1e-9)
    # 10 px of a spread of 10: 1 / (1 + 1/9), and its weight is 1 / 10^2 by the square of the same
    np.testing.assert_allclose(cost, [[0.9, 0, 0]])
    np.testing.assert_allclose(weight, [[0.81e-2, 0.5e-2, 1e-2]])


def test_markers_let_go_of_their_skin_and_set_on_it_again_stay_where_they_are(free_body: Body) -> None:
    _, state, _, _ = at_truth(free_body)
    again, surface = reattach(free_body, state)
    betas = state.pose.betas
    np.testing.assert_allclose(again.placement.shaped(betas), state.placement.shaped(betas), atol=1e-12)
    height = np.einsum("mk,mk->m", again.placement.shaped(betas) - surface.point, surface.normal)
    assert np.median(np.abs(height - 0.0095)) < 0.002
    assert isinstance(again.placement, Points)
    np.testing.assert_allclose(again.placement.weights.sum(axis=1), 1)


def test_a_joint_costs_what_cauchy_says_of_its_turn_from_the_video_less_the_bias(free_body: Body) -> None:
    """k log(1 + a^2 / k) / s^2 for a turn a, s the spread and k = (3 s)^2; the root has a spread of its own."""
    scene, state, _, weights = at_truth(free_body)
    turned, biased, root = np.radians([30.0, 10.0, 40.0])
    prior = scene.pose.rotations.copy()
    prior[:, INDEX["left_knee"]] @= exp_so3(np.array([-turned, 0, 0]))
    prior[:, 0] = state.camera.R_lab_cam.T @ prior[:, 0] @ exp_so3(np.array([0, 0, -root]))
    bias = state.bias.copy()
    bias[list(FREE).index(INDEX["left_knee"])] = exp_so3(np.array([biased, 0, 0]))
    residual, weight, cost = video_residual(prior, scene.seen.tracked, replace(state, bias=bias), weights)
    expected = np.zeros(len(FREE))
    for name, angle, spread_deg in (("left_knee", turned - biased, 18.0), ("pelvis", root, 25.0)):
        at = list(FREE).index(INDEX[name])
        spread = np.radians(spread_deg)
        assert np.linalg.norm(residual[0, at]) == pytest.approx(angle)
        expected[at] = 9 * np.log1p((angle / spread) ** 2 / 9)
        assert weight[0, at] == pytest.approx(1 / spread**2 / (1 + (angle / spread) ** 2 / 9))
    np.testing.assert_allclose(cost[0], expected, atol=1e-12)


def test_a_pose_costs_by_how_far_it_is_from_the_relaxed_one_axis_by_axis(free_body: Body) -> None:
    _, state, _, weights = at_truth(free_body)
    relaxed = np.repeat(mean_pose()[None], 5, axis=0)
    rotations = relaxed.copy()
    rotations[:, INDEX["left_knee"]] @= exp_so3(np.radians([30.0, 0, 0]))
    rotations[:, INDEX["right_knee"]] @= exp_so3(np.radians([0, 30.0, 0]))
    _, weight, cost = habit_residual(replace(state, pose=replace(state.pose, rotations=rotations)), weights)
    left, right = (list(FREE).index(INDEX[f"{side}_knee"]) for side in ("left", "right"))
    assert cost[0, left].sum() == pytest.approx(0.3 * (30 / 60) ** 2)
    assert cost[0, right].sum() == pytest.approx(0.3 * (30 / 10) ** 2)
    assert cost[0].sum() == pytest.approx(cost[0, [left, right]].sum())
    assert weight[left, 0] == pytest.approx(0.3 / np.radians(60) ** 2)


def test_points_nearer_than_the_lens_can_see_are_projected_from_there() -> None:
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 100.0)
    local = np.array([[[0.1, 0, 0.4], [0.1, 0, 0.1], [0.1, 0, -3.0]]])
    nothing, seen = np.zeros((1, 3, 2)), np.ones((1, 3))
    residual, _, _ = image_residual(local, camera, nothing, seen, 400.0, (0, 0), Weights())
    np.testing.assert_allclose(residual[0, :, 0], [25, 50, 50])


def test_the_focal_length_is_told_by_its_logarithm() -> None:
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 0.85 * 1280 * np.e)
    assert focal_residual(camera, (720, 1280), Weights()) == pytest.approx(1.0)
