"""The slope of the normal equations is half the finite difference of the cost, for every kind of unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.fit.bundle import locate_camera, start_state
from markerscope.solver.fit.kinematics import Pose, forward, place_points
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import FREE, State, Surface, Weights
from tests.fit.conftest import Scene, simulate


def _problem(body: Body) -> tuple[Problem, State, Surface, Weights]:
    from markerscope.solver.fit.localize import Hypothesis

    scene: Scene = simulate(body, 5, frames=4, markers=7)
    problem = Problem(body, scene.seen, scene.landmarks)
    weights = Weights(shape=0.3)
    rng = np.random.default_rng(0)
    vertex = rng.choice(np.flatnonzero(body.marker_mask), 7)
    guess = Hypothesis(vertex, scene.camera.R_lab_cam, scene.pose.trans + body.joint_template[0], 0.0, "", 0.0)
    state, surface = start_state(problem, guess, weights)
    moved = Pose(state.pose.rotations, state.pose.trans, rng.normal(0, 0.5, body.shape_count))
    # Off every guess, so that no prior's slope is zero.
    camera = replace(state.camera, focal=1.15 * state.camera.focal, shift=1.1 * state.camera.shift + 0.05)
    bias = exp_so3(rng.normal(0, 0.1, state.bias.shape[:2]))
    bias[0] = np.eye(3)
    return problem, replace(state, pose=moved, camera=camera, bias=bias), surface, weights


def _shifted(problem: Problem, state: State, frame: int | None, column: int, step: float) -> State:
    by_frame = np.zeros((len(problem.target), 3 * len(FREE) + 3))
    shared = np.zeros(problem.unknowns.size)
    if frame is None:
        shared[column] = step
    else:
        by_frame[frame, column] = step
    return problem._moved(state, by_frame, shared)


def test_slope_is_the_finite_difference_of_the_cost(free_body: Body) -> None:
    problem, state, surface, weights = _problem(free_body)
    sums = problem.linearised(state, weights, surface)
    frames, step = len(problem.target), 1e-6

    def slope(frame: int | None, column: int) -> float:
        costs = [
            problem.energies(_shifted(problem, state, frame, column, sign * step), weights, surface).total
            for sign in (1, -1)
        ]
        return frames * (costs[0] - costs[1]) / (2 * step) / 2

    rng = np.random.default_rng(1)
    for column in rng.choice(3 * len(FREE) + 3, 20, replace=False):
        expected, found = slope(2, int(column)), sums.g_f[2, column]
        assert abs(expected - found) < 1e-3 + 1e-4 * abs(expected), f"pose column {column}: {found} for {expected}"
    places = range(problem.unknowns.placement.start, problem.unknowns.size)
    for column in places:
        expected, found = slope(None, column), sums.g_s[column]
        assert abs(expected - found) < 1e-3 + 1e-4 * abs(expected), f"place column {column}: {found} for {expected}"
    # A marker's height over the skin is linearised with the skin held, so shape columns leave that term out.
    blind = replace(weights, offset_spread=1e6)
    sums = problem.linearised(state, blind, surface)
    weights = blind
    for column in range(problem.unknowns.size):
        expected, found = slope(None, column), sums.g_s[column]
        assert abs(expected - found) < 1e-3 + 1e-4 * abs(expected), f"shared column {column}: {found} for {expected}"


def test_the_step_lowers_the_cost(free_body: Body) -> None:
    problem, state, surface, weights = _problem(free_body)
    before = problem.energies(state, weights, surface).total
    after = problem.energies(problem.step(state, weights, surface, 1e-2), weights, surface).total
    assert after < before, f"{after} after a step from {before}"


def test_a_camera_that_looks_the_right_way_is_placed_by_its_landmarks(free_body: Body) -> None:
    """Without noise and with the true focal length, exactly; nothing else fixes how far away it stands."""
    scene = simulate(free_body, 5, frames=4, markers=7)
    places = place_points(scene.landmarks, forward(free_body, scene.pose), scene.pose.betas)
    image = scene.camera.project(places, (720, 960))
    image[1, 3] = np.nan
    problem = Problem(free_body, replace(scene.seen, image=image), scene.landmarks)
    weights = Weights(focal_guess=scene.camera.focal / 960)
    found = locate_camera(problem, scene.pose, scene.camera.R_lab_cam, weights)
    assert found.focal == pytest.approx(scene.camera.focal)
    np.testing.assert_allclose(found.project(places, (720, 960)), scene.camera.project(places, (720, 960)), atol=1e-6)
    position = lambda camera: camera.centre - camera.R_lab_cam @ camera.shift  # noqa: E731
    np.testing.assert_allclose(position(found), position(scene.camera), atol=1e-8)


def test_camera_projects_as_a_pinhole() -> None:
    from markerscope.solver.fit.state import Camera

    turn = exp_so3(np.array([0.2, -0.3, 0.5]))
    camera = Camera(turn, np.array([0.1, 0.2, 3.0]), np.array([1.0, 2, 3]), 800.0)
    point = np.array([1.3, 2.2, 2.9])
    local = turn.T @ (point - [1, 2, 3]) + [0.1, 0.2, 3.0]
    assert np.allclose(camera.project(point[None], (640, 480))[0], 800 * local[:2] / local[2] + [320, 240])
    assert np.allclose(camera.to_camera(point), local)


def test_what_is_held_stays_and_what_is_free_moves(free_body: Body) -> None:
    problem, state, surface, weights = _problem(free_body)
    parts = {
        "free_shape": lambda one: one.pose.betas,
        "free_camera": lambda one: np.append(one.camera.shift, one.camera.focal),
        "free_placement": lambda one: one.placement.rest,
        "free_bias": lambda one: one.bias,
    }
    for name in parts:
        held = problem.step(state, replace(weights, **{name: False}), surface, 1e-3)
        for other, of_other in parts.items():
            assert np.array_equal(of_other(held), of_other(state)) == (name == other), f"{other} with {name} off"
    free = problem.step(state, weights, surface, 1e-3)
    np.testing.assert_array_equal(free.bias[0], state.bias[0], "the root turns with the camera")
    np.testing.assert_allclose(free.camera.R_lab_cam @ free.camera.R_lab_cam.T, np.eye(3), atol=1e-12)
    assert np.abs(free.camera.R_lab_cam - state.camera.R_lab_cam).max() > 1e-4


def test_no_step_goes_further_than_it_can_be_trusted(free_body: Body) -> None:
    problem, state, _, _ = _problem(free_body)
    far = problem._moved(state, np.full((4, 3 * len(FREE) + 3), 9.0), np.full(problem.unknowns.size, 9.0))
    turned = log_so3(np.swapaxes(state.pose.rotations, -1, -2) @ far.pose.rotations)[:, FREE]
    np.testing.assert_allclose(turned, 0.5, atol=1e-9)
    np.testing.assert_allclose(far.pose.trans - state.pose.trans, 0.5)
    np.testing.assert_allclose(far.pose.betas - state.pose.betas, 1.0)
    np.testing.assert_allclose(far.placement.rest - state.placement.rest, 0.05)
    assert far.camera.focal == pytest.approx(state.camera.focal * np.exp(0.2))


def test_the_energies_are_the_sums_that_their_names_say(free_body: Body) -> None:
    problem, state, surface, weights = _problem(free_body)
    cost = problem.energies(state, weights, surface)
    height = ((state.placement.shaped(state.pose.betas) - surface.point) * surface.normal).sum(axis=1) - weights.offset
    assert cost["placement"] == pytest.approx((height**2).sum() / weights.offset_spread**2 / 4)
    assert cost["shape"] == pytest.approx(weights.shape * (state.pose.betas**2).sum())
    assert cost.total == pytest.approx(
        cost["markers"] + cost["prior"] + cost["anatomical"] + cost["image"] + cost["shape"] + cost["placement"]
    )
    guess = replace(state, camera=replace(state.camera, focal=weights.focal_guess * 960))
    zoom = problem.energies(state, replace(weights, focal_spread=0.1), surface)["image"]
    less = problem.energies(state, replace(weights, focal_spread=1e6), surface)["image"]
    expected = (np.log(state.camera.focal / guess.camera.focal) / 0.1) ** 2 / 4
    assert zoom - less == pytest.approx(expected, rel=1e-6)


def test_a_video_that_lost_the_person_counts_less(free_body: Body) -> None:
    """Its poses are bridged there: they weigh 0.15 of the others."""
    problem, state, surface, weights = _problem(free_body)
    turned = state.pose.rotations @ exp_so3(np.array([0.1, 0.05, -0.2]))
    pose = replace(state.pose, rotations=turned)
    state = replace(state, pose=pose, bias=np.tile(np.eye(3), (len(FREE), 1, 1)))
    lost = Problem(free_body, replace(problem.seen, tracked=np.zeros(4, dtype=bool)), problem.landmarks)
    seen, filled = (one.energies(state, weights, surface) for one in (problem, lost))
    assert seen["prior"] > 1
    assert filled["prior"] == pytest.approx(0.15 * seen["prior"])
    assert filled["image"] == 0, "nor are its landmarks believed"


def test_what_is_said_of_the_landmarks_is_the_median_over_those_in_sight(free_body: Body) -> None:
    problem, state, _, _ = _problem(free_body)
    places = place_points(problem.landmarks, forward(free_body, state.pose), state.pose.betas)
    image = state.camera.project(places, (720, 960))
    off = np.random.default_rng(0).normal(0, 9, image.shape)
    off[0, :4] = 1e4
    off[2] *= 30
    missing = np.zeros(image.shape[:2], dtype=bool)
    missing[1, 5:] = missing[3, ::2] = True
    image = np.where(missing[..., None], np.nan, image + off)
    tracked = np.array([True, True, False, True])
    seen = Problem(free_body, replace(problem.seen, image=image, tracked=tracked), problem.landmarks)
    there = ~missing & tracked[:, None]
    assert seen.reprojection(state) == pytest.approx(np.median(np.linalg.norm(off, axis=2)[there]))
    extent = [np.linalg.norm(np.nanmax(image[f], 0) - np.nanmin(image[f], 0)) for f in (0, 1, 3)]
    assert seen.person == pytest.approx(np.median(extent))
    nobody = Problem(free_body, replace(problem.seen, image=np.full_like(image, np.nan)), problem.landmarks)
    assert nobody.person == 50
    assert np.isnan(nobody.reprojection(state))
