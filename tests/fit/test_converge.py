"""Every frame is iterated until its pose stands still, wherever it started and whatever it was solved together with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

import markerscope.solver.fit.converge as converge
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.fit.converge import FINAL, TOLERANCE_DEG, Settled, settle
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Pose
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.refine import every_frame
from markerscope.solver.fit.state import FREE, State, Surface, Weights
from tests.fit.conftest import Scene, drawn_vertices, simulate

FREE_OF_VIDEO = Weights(prior_deg=36.0, root_deg=50.0, image=0.05)
"""Loosely held joints: what makes plain steps slow."""


@pytest.fixture(scope="module")
def trial(free_body) -> tuple[Scene, State, Surface]:  # type: ignore[no-untyped-def]
    """A scene whose markers sit some 20 mm off where the fit has them, so that the robust kernels bite."""
    scene = simulate(free_body, 1, frames=40, markers=60)
    skin = Skin(free_body, scene.pose.betas)
    placement, surface = skin.on_vertices(drawn_vertices(free_body, scene.bones, 1), 0.0095)
    off = np.random.default_rng(4).normal(0, 0.012, placement.rest.shape)
    placement = replace(placement, rest=placement.rest + off)
    prior = scene.seen.prior.copy()
    hands = np.setdiff1d(np.arange(24), FREE)  # which no fit turns
    prior[:, hands] = scene.pose.rotations[:, hands]
    scene = replace(scene, seen=replace(scene.seen, prior=prior))
    return scene, State(scene.pose, placement, scene.camera), surface


def apart_deg(first: Pose, second: Pose) -> np.ndarray:
    """(T,) degrees, the largest difference of a joint that a fit turns."""
    turn = log_so3(np.swapaxes(first.rotations[:, FREE], -1, -2) @ second.rotations[:, FREE])
    return np.degrees(np.linalg.norm(turn, axis=-1)).max(axis=1)


def disturbed(pose: Pose, degrees: float) -> Pose:
    """Every joint that a fit turns, turned at random."""
    rotations = pose.rotations.copy()
    turns = np.random.default_rng(0).normal(0, np.radians(degrees) / np.sqrt(3), (len(rotations), len(FREE), 3))
    rotations[:, FREE] = rotations[:, FREE] @ exp_so3(turns)
    return replace(pose, rotations=rotations)


@pytest.fixture(scope="module")
def answer(trial) -> Pose:  # type: ignore[no-untyped-def]
    """Where plain Gauss-Newton steps end up: 60 of them on all frames together."""
    scene, state, surface = trial
    problem = Problem(scene.body, scene.seen, scene.landmarks)
    held = replace(FREE_OF_VIDEO, marker=FINAL[0], marker_kernel=FINAL[1])
    pose = state.pose
    for _ in range(60):
        pose = problem.turned(pose, problem.frame_step(replace(state, pose=pose), held, surface, 1e-4))
    return pose


def test_every_frame_ends_within_a_tenth_of_a_degree_of_the_end(trial, answer: Pose) -> None:  # type: ignore[no-untyped-def]
    scene, state, surface = trial
    start = disturbed(scene.pose, 6)
    found = settle(scene.body, scene.seen, scene.landmarks, state, surface, FREE_OF_VIDEO, start)
    assert found.settled.all() and not found.notes()
    assert apart_deg(found.pose, start).max() > 3
    off = apart_deg(found.pose, answer)
    assert off.max() < 0.1, f"{off.max():.2f} degrees from where the iteration ends"


def test_every_frame_of_a_recording_ends_there_from_a_few_keyframes(trial, answer: Pose) -> None:  # type: ignore[no-untyped-def]
    scene, state, surface = trial
    key = np.array([0, 20, 39])
    fitted = replace(state, pose=scene.pose.at(key))
    found = every_frame(scene.body, scene.seen, scene.landmarks, key, fitted, surface, FREE_OF_VIDEO)
    assert found.settled.all()
    off = apart_deg(found.pose, answer)
    assert off.max() < 0.1, f"{off.max():.2f} degrees from where the iteration ends"


def test_a_frame_does_not_depend_on_which_others_it_is_solved_beside(trial, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    """The person's height in the image, which scales what a landmark counts, is the whole recording's."""
    scene, state, surface = trial
    image = scene.seen.image.copy()
    image[20:] = image[20:].mean(axis=1, keepdims=True) + 0.3 * (image[20:] - image[20:].mean(axis=1, keepdims=True))
    seen = replace(scene.seen, image=image)
    found = []
    for size in (40, 7):
        monkeypatch.setattr(converge, "_CHUNK", size)
        found.append(settle(scene.body, seen, scene.landmarks, state, surface, FREE_OF_VIDEO, scene.pose).pose)
    assert apart_deg(*found).max() < 1e-6


def test_frames_that_have_settled_cost_no_more(trial, answer: Pose, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    scene, state, surface = trial
    rotations = answer.rotations.copy()
    rotations[5] = disturbed(answer, 15).rotations[5]
    solved: list[int] = []
    plain = Problem.frame_step

    def counted(self: Problem, *given: object) -> np.ndarray:
        solved.append(len(self.target))
        return plain(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(Problem, "frame_step", counted)
    start = replace(answer, rotations=rotations)
    found = settle(scene.body, scene.seen, scene.landmarks, state, surface, FREE_OF_VIDEO, start)
    assert found.settled.all()
    assert solved[0] == 40 and set(solved[1:]) == {1} and len(solved) > 3, solved


def test_frames_that_do_not_settle_are_said(trial, monkeypatch: pytest.MonkeyPatch) -> None:  # type: ignore[no-untyped-def]
    scene, state, surface = trial
    monkeypatch.setattr(converge, "MOST_STEPS", 2)
    start = disturbed(scene.pose, 6)
    found = settle(scene.body, scene.seen, scene.landmarks, state, surface, FREE_OF_VIDEO, start)
    assert not found.settled.any()
    (note,) = found.notes()
    assert note.startswith(f"40 of 40 frames have not settled to {TOLERANCE_DEG:g} degrees in 2 steps")
    motion = _motion(scene, state, found)
    assert motion.warnings == (note,) and motion.settled is not None and not motion.settled.any()


def test_the_result_carries_the_tolerance(trial) -> None:  # type: ignore[no-untyped-def]
    scene, state, _ = trial
    motion = _motion(scene, state, Settled(scene.pose, np.ones(40, bool)))
    assert motion.settled_deg == TOLERANCE_DEG == 0.05 and motion.warnings == ()
    assert np.isnan(_motion(scene, state, scene.pose).settled_deg), "a pose that was not iterated so says so"


def _motion(scene: Scene, state: State, pose: Pose | Settled):  # type: ignore[no-untyped-def]
    used = np.arange(scene.seen.markers.shape[1])
    camera = CameraResult(np.eye(3), np.zeros(3), 1.0, (0, 0), float("nan"))
    time = np.arange(40) / 10
    sites = (scene.bones, scene.bones)
    return motion_from(scene.body, scene.seen.markers, time, pose, used, state.placement, sites, camera=camera)


def test_steps_to_and_fro_are_damped(monkeypatch: pytest.MonkeyPatch, trial) -> None:  # type: ignore[no-untyped-def]
    """A step that overshoots by as much as it was off would never come to rest; halved, it does."""
    scene, state, surface = trial
    goal = scene.pose

    def overshooting(self: Problem, state: State, *given: object) -> np.ndarray:
        turn = log_so3(np.swapaxes(state.pose.rotations[:, :1], -1, -2) @ goal.rotations[: len(state.pose.trans), :1])
        out = np.zeros((len(turn), 69))
        out[:, :3] = 2 * turn[:, 0]
        return out

    monkeypatch.setattr(Problem, "frame_step", overshooting)
    monkeypatch.setattr(converge, "_extrapolated", lambda plain, *before: plain)
    rotations = goal.rotations.copy()
    rotations[:, 0] = rotations[:, 0] @ exp_so3(np.tile([0.0, 0.05, 0], (40, 1)))
    start = replace(goal, rotations=rotations)
    found = settle(scene.body, scene.seen, scene.landmarks, state, surface, FREE_OF_VIDEO, start)
    assert found.settled.all() and apart_deg(found.pose, goal).max() < 0.1


@pytest.fixture(autouse=True)
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(converge, "spread", lambda work, items: [work(item) for item in items])
    yield
