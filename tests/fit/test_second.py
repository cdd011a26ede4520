"""Second answers for a limb: their cost is that of the whole fit, its slopes are right, and planted ones are left."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.doubts.rules import verdict
from markerscope.solver.fit.doubts.second import second_answers
from markerscope.solver.fit.kinematics import forward
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.targets import targets_of
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.second.limb import Limb
from markerscope.solver.fit.second.results import LIMBS
from markerscope.solver.fit.second.search import minima
from markerscope.solver.fit.second.stage import MOST_EXCESS, _taken, nearest_other, search_limbs
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.state import State, Surface, Weights
from tests.fit.conftest import Scene, drawn_vertices, simulate
from tests.fit.test_doubts import sound

FRAMES = 8
WEIGHTS = Weights()


@dataclass(frozen=True)
class Right:
    """A scene without a video's landmarks, and a fit of it that is the truth itself."""

    scene: Scene
    state: State
    surface: Surface

    @property
    def around(self) -> tuple[Body, object, object]:
        return self.scene.body, self.scene.seen, self.scene.landmarks

    def limb(self, name: str, pull: Pull | None = None) -> Limb:
        skin = Skin(self.scene.body, self.state.pose.betas)
        return Limb(self.scene.body, self.scene.seen, self.state, WEIGHTS, pull, LIMBS[name], skin)


def right(body: Body, seed: int) -> Right:
    scene = simulate(body, seed, frames=FRAMES, markers=30)
    scene = replace(scene, seen=replace(scene.seen, image=np.full_like(scene.seen.image, np.nan)))
    skin = Skin(body, scene.pose.betas)
    on, _ = skin.on_vertices(drawn_vertices(body, scene.bones, seed), 0.0095)
    placement, surface = skin.attach(on.shaped(scene.pose.betas))
    return Right(scene, State(scene.pose, placement, scene.camera), surface)


def pulled(one: Right) -> Pull:
    """Every third marker drawn to some landmark."""
    targets = targets_of(one.scene.body, one.state.pose.betas, 0.0095)
    marker = np.arange(0, 30, 3)
    return Pull(marker, np.arange(len(marker)), np.full(len(marker), 2e4), targets)


@pytest.mark.parametrize("name", LIMBS)
def test_a_limbs_cost_is_what_the_whole_fit_costs_more_or_less(free_body: Body, name: str) -> None:
    """Bones turned at random, with the pull: the difference is that of the whole problem's energies."""
    one = right(free_body, 4)
    pull = pulled(one)
    limb, skin = one.limb(name, pull), Skin(free_body, one.state.pose.betas)
    rng = np.random.default_rng(2)
    turn = exp_so3(rng.normal(0, 0.15, (3, 3, 3)))
    guesses = limb.placed_again(limb.at(np.concatenate([np.eye(3) + np.zeros((1, 3, 3, 3)), turn])))
    cost = limb.linearised(guesses, WEIGHTS.marker, WEIGHTS.marker_kernel, slopes=False)[0] / FRAMES
    problem = Problem(free_body, replace(one.scene.seen, further=(pull,)), one.scene.landmarks)  # type: ignore[arg-type]
    found = replace(minima_like(limb, guesses), cost=cost)
    totals = []
    for row in range(4):
        state, surface = _taken(one.state, [(limb, found, row)], skin)
        totals.append(problem.energies(state, WEIGHTS, surface).total)
    assert cost[1:] - cost[0] == pytest.approx(np.array(totals)[1:] - totals[0], rel=1e-3, abs=2e-3)


def minima_like(limb: Limb, guesses: object) -> object:
    """Guesses as a search would leave them."""
    from markerscope.solver.fit.second.search import Minima

    return Minima(guesses, np.zeros(4), np.zeros((4, 3)), np.zeros((4, 3)))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["left_leg", "right_arm"])
def test_slopes_are_those_of_the_cost(free_body: Body, name: str) -> None:
    one = right(free_body, 4)
    limb = one.limb(name, pulled(one))
    rng = np.random.default_rng(3)
    start = limb.at(exp_so3(rng.normal(0, 0.1, (1, 3, 3))))
    limb.weights = replace(WEIGHTS, offset_spread=1e3)  # the skin under a marker changes with the marker
    slope = limb.linearised(start, 0.01, 0.04)[2][0]
    size = len(slope)

    def cost(step: np.ndarray) -> float:
        moved = limb.moved(start, step[None])
        held = replace(moved, weights=start.weights)
        return float(limb.linearised(held, 0.01, 0.04, slopes=False)[0][0])

    steps = np.eye(size) * 1e-5
    measured = np.array([(cost(step) - cost(-step)) / 2e-5 for step in steps]) / 2
    assert np.abs(slope - measured).max() < 1e-3 * np.abs(measured).max()


@pytest.mark.parametrize(("seed", "name"), [(4, "left_leg"), (17, "right_leg"), (0, "right_leg")])
def test_a_fit_that_ended_in_a_dearer_minimum_is_taken_out_of_it(free_body: Body, seed: int, name: str) -> None:
    """The minimum is a real one: a descent of the limb from it stays there, over 40 mm off."""
    one = right(free_body, seed)
    limb = one.limb(name)
    found = minima(limb)
    row = int(np.where(found.apart.max(axis=1) > 0.04, found.cost, np.inf).argmin())
    assert found.apart[row].max() > 0.04 and found.cost[row] > found.cost[0] + 1
    state, surface = _taken(one.state, [(limb, found, row)], Skin(free_body, one.state.pose.betas))
    wrong = replace(one, state=state, surface=surface)
    stays, _ = wrong.limb(name).descend(wrong.limb(name).at(np.eye(3) + np.zeros((1, 3, 3, 3))), 0.01, 0.04, 30)
    off = np.linalg.norm(wrong.limb(name).joints(stays) - limb.joints(found.guesses)[:1], axis=3).mean(axis=1).max()
    assert off > 0.03, "what was planted is no minimum"
    searched = search_limbs(*one.around, state, surface, WEIGHTS, None)  # type: ignore[arg-type]
    joints = forward(free_body, searched.state.pose).place[:, LIMBS[name]]
    truth = forward(free_body, one.state.pose).place[:, LIMBS[name]]
    assert np.linalg.norm(joints - truth, axis=2).mean(axis=0).max() < 0.02
    problem = Problem(*one.around)  # type: ignore[arg-type]
    cost = problem.energies(searched.state, WEIGHTS, searched.surface).total
    assert cost < problem.energies(state, WEIGHTS, surface).total


def test_an_answer_that_costs_hardly_more_is_told_and_can_be_taken(free_body: Body) -> None:
    one = right(free_body, 13)
    searched = search_limbs(*one.around, one.state, one.surface, WEIGHTS, None)  # type: ignore[arg-type]
    assert searched.others
    other = searched.others[0]
    assert other.excess <= MOST_EXCESS and 0.5 <= other.confidence < 0.84 and other.apart > 0.015
    assert f"{1000 * other.apart:.0f} mm away" in other.sentence and f"second = ['{other.limb}']" in other.sentence
    taken = search_limbs(*one.around, one.state, one.surface, WEIGHTS, None, [other.limb])  # type: ignore[arg-type]
    first, second = (forward(free_body, found.state.pose).place[:, other.joint] for found in (searched, taken))
    assert np.linalg.norm(first - second, axis=1).mean() > 0.7 * other.apart
    assert taken.others[0].chosen and "by hand" in taken.others[0].sentence
    near, surer = replace(other, confidence=0.59), replace(other, confidence=0.61)
    (doubt,) = second_answers(sound(second=(near, surer)))
    assert doubt.kind == "second answer" and doubt.sentence == near.sentence
    assert second_answers(sound(second=(replace(surer, chosen=True),))), "what was chosen by hand is said"
    whole = verdict(sound(), 0.97).confidence
    assert verdict(sound(second=(near,)), 0.97).confidence == whole, "of one limb, not of the whole"


def test_what_is_near_the_answer_or_dear_is_no_other(free_body: Body) -> None:
    limb = right(free_body, 13).limb("left_leg")
    found = minima(limb)
    best = int(found.cost.argmin())
    dear = np.where(np.arange(len(found.cost)) == best, found.cost, found.cost[best] + MOST_EXCESS + 0.1)
    assert nearest_other("left_leg", limb, replace(found, cost=dear), best)[1] is None
    alone = replace(
        found,
        guesses=found.guesses.take(np.array([best])),
        cost=found.cost[[best]],
        apart=found.apart[[best]],
        turn_deg=found.turn_deg[[best]],
    )
    assert nearest_other("left_leg", limb, alone, 0)[1] is None


def test_only_limbs_have_second_answers() -> None:
    with pytest.raises(InputError, match="tail"):
        FitSettings(second=("tail",))
