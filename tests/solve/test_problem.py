"""The slope of the normal equations is half the finite difference of the cost, for every kind of unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solver.body.model import Body
from solver.rotations import exp_so3
from solver.solve.bundle import start_state
from solver.solve.kinematics import Pose
from solver.solve.problem import Problem
from solver.solve.state import FREE, State, Surface, Weights
from tests.solve.conftest import Scene, simulate


def _problem(body: Body) -> tuple[Problem, State, Surface, Weights]:
    from solver.localize import Hypothesis

    scene: Scene = simulate(body, 5, frames=4, markers=7)
    problem = Problem(body, scene.seen, scene.landmarks)
    weights = Weights(shape=0.3)
    rng = np.random.default_rng(0)
    vertex = rng.choice(np.flatnonzero(body.marker_mask), 7)
    guess = Hypothesis(vertex, scene.camera.R_lab_cam, scene.pose.trans + body.joint_template[0], 0.0, "", 0.0)
    state, surface = start_state(problem, guess, weights)
    moved = Pose(state.pose.rotations, state.pose.trans, rng.normal(0, 0.5, body.shape_count))
    return problem, replace(state, pose=moved), surface, weights


def _shifted(problem: Problem, state: State, frame: int | None, column: int, step: float) -> State:
    by_frame = np.zeros((len(problem.target), 3 * len(FREE) + 3))
    shared = np.zeros(problem.placement_at.stop)
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
    # A marker's height over the skin is linearised with the skin held, so shape columns leave that term out.
    blind = replace(weights, offset_spread=1e6)
    sums = problem.linearised(state, blind, surface)
    weights = blind
    for column in range(problem.placement_at.stop):
        expected, found = slope(None, column), sums.g_s[column]
        assert abs(expected - found) < 1e-3 + 1e-4 * abs(expected), f"shared column {column}: {found} for {expected}"


def test_the_step_lowers_the_cost(free_body: Body) -> None:
    problem, state, surface, weights = _problem(free_body)
    before = problem.energies(state, weights, surface).total
    after = problem.energies(problem.step(state, weights, surface, 1e-2), weights, surface).total
    assert after < before, f"{after} after a step from {before}"


def test_camera_projects_as_a_pinhole() -> None:
    from solver.solve.state import Camera

    turn = exp_so3(np.array([0.2, -0.3, 0.5]))
    camera = Camera(turn, np.array([0.1, 0.2, 3.0]), np.array([1.0, 2, 3]), 800.0)
    point = np.array([1.3, 2.2, 2.9])
    local = turn.T @ (point - [1, 2, 3]) + [0.1, 0.2, 3.0]
    assert np.allclose(camera.project(point[None], (640, 480))[0], 800 * local[:2] / local[2] + [320, 240])
    assert np.allclose(camera.to_camera(point), local)
