"""The video's errors as unknowns: its bias is found where markers see it, and its worth is read off the trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.bundle import Phase, descend, start_state
from markerscope.solver.fit.confidence import movement_deg, stillness
from markerscope.solver.fit.localize import Hypothesis
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import FREE, State, Weights
from markerscope.solver.fit.trust import believed, trusted
from tests.fit.conftest import drawn_vertices, simulate

BIASED = ("left_knee", "right_elbow", "spine2", "left_shoulder")


def solved(free_body: Body, bias_deg: float, seed: int) -> tuple[Problem, State, Weights, np.ndarray]:
    """A scene with a known bias, solved from its true vertices without landmarks; the bias, (K, 3) rad."""
    scene = simulate(free_body, seed, frames=30, markers=60)
    rng = np.random.default_rng(seed)
    bias = np.radians(bias_deg) * rng.normal(size=(24, 3)) / np.sqrt(3)
    bias[[0, *(j for j in range(24) if j not in FREE)]] = 0
    prior = scene.pose.rotations @ np.swapaxes(exp_so3(bias), -1, -2)
    prior = prior @ exp_so3(np.radians(3) * rng.normal(size=prior.shape[:3]) / np.sqrt(3))
    prior[:, 0] = scene.camera.R_lab_cam.T @ prior[:, 0]
    blind = np.full_like(scene.seen.image, np.nan)
    problem = Problem(free_body, replace(scene.seen, prior=prior, image=blind), scene.landmarks)
    weights = Weights(free_shape=False, anatomical=0.01, prior_deg=6.0, bias_deg=30.0)
    vertices = drawn_vertices(free_body, scene.bones, seed)
    guess = Hypothesis(
        vertices, scene.camera.R_lab_cam, scene.pose.trans + free_body.joints(scene.pose.betas)[0], 0, "", 0
    )
    state, surface = start_state(problem, guess, weights)
    state = replace(state, pose=replace(state.pose, betas=scene.pose.betas, trans=scene.pose.trans))
    phases = (Phase(0.02, 0.1, 10, free_shape=False), Phase(0.01, 0.04, 8, free_placement=True, free_shape=False))
    state, _, _ = descend(problem, state, surface, phases, weights)
    return problem, state, weights, bias[FREE]


def _vertices(body: Body, bones: np.ndarray, seed: int) -> np.ndarray:
    """The vertices that ``simulate`` draws for the same seed and number of markers."""
    rng = np.random.default_rng(seed)
    for _ in range(12):
        rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 4)
    rng.uniform(0, 6)
    rng.normal(0, 0.7, body.shape_count)
    index = np.flatnonzero(body.marker_mask)
    vertices = rng.choice(index, len(bones), replace=False)
    assert np.array_equal(body.weights[vertices].argmax(1), bones)
    return vertices


@pytest.mark.parametrize("seed", [1, 3])
def test_a_bias_that_markers_see_is_found(free_body: Body, seed: int) -> None:
    _, state, _, bias = solved(free_body, 15.0, seed)
    rows = [int(np.flatnonzero(INDEX[name] == FREE)[0]) for name in BIASED]
    error = np.degrees(np.linalg.norm(log_so3(np.swapaxes(exp_so3(bias), -1, -2) @ state.bias), axis=-1))[rows]
    size = np.degrees(np.linalg.norm(bias, axis=-1))[rows]
    assert np.median(error) < 0.4 * np.median(size), f"{error} degrees off, of {size}"


def test_a_good_video_is_trusted_and_a_poor_one_is_not(free_body: Body) -> None:
    spreads = []
    for bias_deg in (1.0, 12.0, 30.0):
        problem, state, weights, _ = solved(free_body, bias_deg, 3)
        spreads.append(trusted(problem.seen, state, believed(weights)).bias_deg)
    assert spreads[0] < 5 < spreads[1] < spreads[2], f"spread of the bias {spreads} for videos off by 1, 12, 30 degrees"


def test_a_video_without_marked_joints_keeps_what_is_believed(free_body: Body) -> None:
    problem, state, weights, _ = solved(free_body, 5.0, 4)
    nobody = replace(state, placement=replace(state.placement, weights=np.eye(24)[np.zeros(60, int)]))
    assert trusted(problem.seen, nobody, weights) == weights


def turning(joint: str, degrees: float) -> np.ndarray:
    rotations = np.tile(np.eye(3), (50, 24, 1, 1))
    rotations[:, INDEX[joint], :, :] = exp_so3(np.radians(np.linspace(0, degrees, 50))[:, None] * [1.0, 0, 0])
    return rotations


def test_movement_is_judged_where_the_markers_are() -> None:
    leg = np.array([INDEX["left_hip"], INDEX["left_knee"]])
    assert stillness(turning("right_elbow", 90), leg), "the arm says nothing of a leg"
    assert not stillness(turning("left_knee", 60), leg)
    assert not stillness(turning("left_knee", 60), leg[:1]), "one bone alone says it by a rule of its own"
    knee_alone = np.array([INDEX[name] for name in ("left_hip", "left_knee", "left_ankle", "left_foot")])
    assert not stillness(turning("left_knee", 108), knee_alone), "of a leg one joint that bends is enough"
    assert stillness(turning("left_knee", 108), np.arange(22)), "of a whole body it is not"
    # 5th to 95th percentile of an even sweep
    assert movement_deg(turning("left_knee", 60), [INDEX["left_knee"]]) == pytest.approx(54, abs=0.5)


def test_the_spreads_are_those_of_the_joints_that_two_markers_or_more_show(free_body: Body) -> None:
    """Root mean squares over the marked joints and two more as they were believed, by hand; of one axis of three."""
    scene = simulate(free_body, 3, frames=6, markers=8)
    on = [0, 0, *(INDEX[name] for name in ("left_knee", "left_knee", "neck", "neck", "head", "right_knee"))]
    bias, wander = np.zeros((24, 3)), np.zeros((6, 24, 3))
    for name, turned, wandered in (("left_knee", 10, 6), ("neck", 20, 12), ("head", 70, 50), ("pelvis", 60, 40)):
        bias[INDEX[name], 1] = np.radians(turned)
        wander[:, INDEX[name], 1] = np.radians(wandered) * np.array([1, -1, 1, -1, 1, -1])
    truth = scene.pose.rotations
    prior = truth @ np.swapaxes(exp_so3(wander), -1, -2) @ np.swapaxes(exp_so3(bias), -1, -2)
    prior[:, 0] = scene.camera.R_lab_cam.T @ prior[:, 0]
    seen = replace(scene.seen, prior=prior, tracked=np.array([True] * 5 + [False]))
    seen.prior[5] = np.eye(3)
    guess = Hypothesis(np.zeros(8, int), scene.camera.R_lab_cam, scene.pose.trans, 0, "", 0)
    state, _ = start_state(Problem(free_body, seen, scene.landmarks), guess, Weights())
    state = replace(
        state, pose=scene.pose, camera=scene.camera, bias=exp_so3(bias)[FREE],
        placement=replace(state.placement, weights=np.eye(24)[on]),
    )  # fmt: skip
    found = trusted(seen, state, believed(Weights()))
    assert found.bias_deg == pytest.approx(np.sqrt((2 * 8**2 + (10**2 + 20**2) / 3) / 4))
    assert found.prior_deg == pytest.approx(np.sqrt((2 * 12**2 + (6**2 + 12**2) / 3) / 4))
    perfect = replace(state, bias=np.tile(np.eye(3), (len(FREE), 1, 1)))
    sure = replace(believed(Weights()), bias_deg=0.1)
    assert trusted(seen, perfect, sure).bias_deg == 2.0, "no video is trusted to less than 2 degrees"
