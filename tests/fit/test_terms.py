"""A term of the energy is added from outside, in one place, and is minimised with the others wherever the fit looks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.converge import settle
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import POSE_SIZE, State, Surface, Weights
from markerscope.solver.fit.terms.term import Estimate, add_points
from tests.fit.conftest import Scene, drawn_vertices, simulate

FRAMES = 6
KINDS = ["markers", "image", "prior", "anatomical", "shape", "placement"]


@dataclass(frozen=True, eq=False)
class Floor:
    """Points of the body stay above the floor, which may be at another height (N,) in every frame."""

    points: Points
    height: np.ndarray
    spread_m: float
    name: str = "floor"

    def of_frames(self, frames: np.ndarray | slice) -> Floor:
        return replace(self, height=self.height[frames])

    def energy(self, at: Estimate) -> float:
        return float((self._below(at) ** 2).sum()) / self.spread_m**2 / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        below = self._below(at)[..., None]
        upwards = (below < 0)[..., None] * np.array([0, 0, 1.0]) / self.spread_m
        add_points(sums, at, self.points, upwards, below / self.spread_m)

    def _below(self, at: Estimate) -> np.ndarray:
        placed = place_points(self.points, at.links, at.state.pose.betas)[..., 2]
        return np.minimum(placed - self.height[:, None], 0)


def feet(body: Body) -> Points:
    """A heel and a toe of each foot: the lowest and the foremost vertices."""
    at = body.template[:, 1].argsort()[:40]
    return Points.of_vertices(body, at[:: len(at) // 4])


def at_truth(body: Body) -> tuple[Scene, State, Surface]:
    scene = simulate(body, 3, frames=FRAMES, markers=30)
    skin = Skin(body, scene.pose.betas)
    placement, surface = skin.on_vertices(drawn_vertices(body, scene.bones, 3), 0.0095)
    return scene, State(scene.pose, placement, scene.camera), surface


def lowest(body: Body, pose: Pose) -> np.ndarray:
    """(N,) m, the lowest of the feet in every frame."""
    placed = place_points(feet(body), forward(body, pose), pose.betas)
    return np.asarray(placed[..., 2].min(axis=1))


def test_a_fit_without_further_evidence_lists_its_terms_by_name(free_body: Body) -> None:
    scene, state, surface = at_truth(free_body)
    problem = Problem(free_body, scene.seen, scene.landmarks)
    found = problem.energies(state, Weights(), surface)
    assert list(found.by_term) == KINDS == [term.name for term in problem.terms]
    assert found.total == pytest.approx(sum(found[name] for name in KINDS))
    assert all(found[name] > 0 for name in KINDS)


def test_a_floor_acts_on_the_descent_and_on_every_frame(free_body: Body) -> None:
    scene, state, surface = at_truth(free_body)
    floor = Floor(feet(free_body), lowest(free_body, scene.pose) + 0.02, 0.001)
    bare, weights = scene.seen, Weights()
    seen = replace(bare, further=(floor,))
    costs = [Problem(free_body, s, scene.landmarks).energies(state, weights, surface) for s in (bare, seen)]
    assert costs[1]["floor"] > 100 and list(costs[1].by_term) == [*KINDS, "floor"]
    assert costs[1].total == pytest.approx(costs[0].total + costs[1]["floor"])

    def below(given: State | Pose) -> float:
        pose = given.pose if isinstance(given, State) else given
        return float((floor.height - lowest(free_body, pose)).max())

    fitted = [
        descend(Problem(free_body, s, scene.landmarks), state, surface, (Phase(0.01, 0.04, 6),), weights)[0]
        for s in (bare, seen)
    ]
    assert below(fitted[0]) > 0.015 and below(fitted[1]) < 0.003
    # Frames are solved in another order and fewer at a time, each with what the floor was there.
    order = np.array([4, 1, 5])
    settled = settle(free_body, seen.at(order), scene.landmarks, state, surface, weights, state.pose.at(order))
    deep = lowest(free_body, settled.pose) - floor.height[order]
    assert deep.min() > -0.003, deep


def test_the_slope_of_points_of_the_body_is_the_finite_difference_of_their_cost(free_body: Body) -> None:
    scene, state, surface = at_truth(free_body)
    floor = Floor(feet(free_body), lowest(free_body, scene.pose) + 0.2, 0.05)
    with_floor = Problem(free_body, replace(scene.seen, further=(floor,)), scene.landmarks)
    without = Problem(free_body, scene.seen, scene.landmarks)
    weights = Weights()
    one, other = (problem.linearised(state, weights, surface) for problem in (with_floor, without))
    by_frame, shared = one.g_f - other.g_f, one.g_s - other.g_s
    rng = np.random.default_rng(0)
    for _ in range(3):
        turn, shape = rng.normal(0, 1, (FRAMES, POSE_SIZE)), np.zeros_like(shared)
        shape[with_floor.unknowns.shape] = rng.normal(0, 1, with_floor.unknowns.shape.stop)
        ahead, back = (
            with_floor.energies(with_floor._moved(state, s * turn, s * shape), weights, surface)["floor"]
            for s in (1e-5, -1e-5)
        )
        expected = FRAMES * (ahead - back) / 2e-5 / 2
        assert (by_frame * turn).sum() + shared @ shape == pytest.approx(expected, rel=1e-4)


def test_terms_of_one_name_are_listed_as_one(free_body: Body) -> None:
    scene, state, surface = at_truth(free_body)
    floor = Floor(feet(free_body), lowest(free_body, scene.pose) + 0.02, 0.001)
    once, twice = (
        Problem(free_body, replace(scene.seen, further=(floor,) * n), scene.landmarks).energies(
            state, Weights(), surface
        )
        for n in (1, 2)
    )
    assert twice["floor"] == pytest.approx(2 * once["floor"])
