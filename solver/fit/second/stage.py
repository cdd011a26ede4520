"""The search for further minima as a step of a solve: limb by limb, then the whole with the better ones taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import reattach
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.second.limb import Limb
from markerscope.solver.fit.second.results import LIMBS, LimbAnswer
from markerscope.solver.fit.second.search import Minima, minima
from markerscope.solver.fit.state import Observations, State, Surface, Weights

LEAST_M, LEAST_DEG = 0.015, 10.0
"""An answer is another one from here on: this far a joint, or this much a bone."""
MOST_EXCESS = 1.0
"""An answer that costs more than this per frame beside the first is none."""
_LOWER = 0.02
"""What costs less by more than this per frame is taken."""
_STEPS, _ENOUGH, _STIFF = 12, 1e-3, 1e3
_FRAMES = 8
_FEWEST = 3
_STEEPNESS = 1.6
"""Of an excess of e per frame the first is held to be right by 1 / (1 + exp(-1.6 e)): a tie is 0.5."""


@dataclass(frozen=True)
class Searched:
    """The keyframes' fit after the search, and the further answers that remain."""

    state: State
    surface: Surface
    others: tuple[LimbAnswer, ...]


def search_limbs(
    body: Body,
    seen: Observations,
    landmarks: Points,
    state: State,
    surface: Surface,
    weights: Weights,
    pull: Pull | None,
    wanted: Sequence[str] = (),
) -> Searched:
    """Look for further minima of each limb that carries markers; take those that cost less, tell of those near by.

    Parameters
    ----------
    seen : the keyframes
    landmarks : the video's, as points of the body
    state, surface, weights : the keyframes' fit
    pull : what drew markers to landmarks in it
    wanted : limbs whose second answer is to be taken though it costs more
    """
    known = seen if pull is None else replace(seen, further=(*seen.further, pull))
    problem = Problem(body, known, landmarks)
    some = np.unique(np.linspace(0, len(seen.markers) - 1, _FRAMES).round().astype(int))
    skin = Skin(body, state.pose.betas)
    told: list[LimbAnswer] = []
    lower: list[tuple[Limb, Minima, int]] = []
    asked: list[tuple[Limb, Minima, int]] = []
    for name, bones in LIMBS.items():
        at = replace(state, pose=state.pose.at(some))
        limb = Limb(body, seen.at(some), at, weights, pull, bones, skin, len(seen.markers) / len(some))
        if limb.marked < _FEWEST:
            continue
        found = minima(limb)
        best = int(found.cost.argmin())
        if found.cost[best] < found.cost[0] - _LOWER:
            lower.append((limb, found, best))
        row, other = nearest_other(name, limb, found, best)
        if other is not None:
            taken = name in wanted
            told.append(replace(other, chosen=taken))
            if taken:
                asked.append((limb, found, row))
    if lower:
        now, now_surface, cost = settled(problem, *_taken(state, lower, skin), weights)
        if cost < problem.energies(state, weights, surface).total:
            state, surface = now, now_surface
    if asked:
        held = replace(weights, free_shape=False, free_camera=False)
        state, surface, _ = settled(problem, *_taken(state, asked, skin), held)
    return Searched(state, surface, tuple(told))


def settled(problem: Problem, state: State, surface: Surface, weights: Weights) -> tuple[State, Surface, float]:
    """Gauss-Newton to the end, and what it costs there.

    A step counts as taken with the skin that each marker rides on after it: where bones meet that changes from vertex
    to vertex, and with it the cost.
    """
    damping, cost = 1e-3, problem.energies(state, weights, surface).total
    for _ in range(_STEPS):
        trial, skin = reattach(problem.body, problem.step(state, weights, surface, damping))
        new = problem.energies(trial, weights, skin).total
        if new >= cost:
            damping *= 10
            if damping > _STIFF:
                break
            continue
        gain, state, surface, cost, damping = (cost - new) / cost, trial, skin, new, max(damping * 0.3, 1e-6)
        if gain < _ENOUGH:
            break
    return state, surface, cost


def nearest_other(name: str, limb: Limb, found: Minima, best: int) -> tuple[int, LimbAnswer | None]:
    """The cheapest answer that is another than the best, if it costs little enough, and its row."""
    joints = limb.joints(found.guesses)
    apart = np.linalg.norm(joints - joints[best], axis=3).mean(axis=1)
    turn = found.turn_deg if best == 0 else limb.turned_apart(found.guesses, best)
    other = (apart.max(axis=1) >= LEAST_M) | (turn.max(axis=1) >= LEAST_DEG)
    excess = np.where(other, found.cost - found.cost[best], np.inf)
    row = int(excess.argmin())
    if not excess[row] <= MOST_EXCESS:
        return -1, None
    return row, LimbAnswer(
        limb=name,
        joint=int(limb.bones[apart[row].argmax()]),
        apart=float(apart[row].max()),
        bone=int(limb.bones[turn[row].argmax()]),
        turn_deg=float(turn[row].max()),
        excess=float(excess[row]),
        confidence=float(1 / (1 + np.exp(-_STEEPNESS * excess[row]))),
    )


def _taken(state: State, limbs: Sequence[tuple[Limb, Minima, int]], skin: Skin) -> tuple[State, Surface]:
    """The state with the given minimum of each of some limbs."""
    rotations, placed = state.pose.rotations.copy(), state.placement.shaped(state.pose.betas)
    for limb, found, row in limbs:
        turn = found.guesses.turn[row]
        above = np.concatenate([np.eye(3)[None], turn[:-1]])
        rotations[:, limb.bones] = np.swapaxes(above, -1, -2) @ rotations[:, limb.bones] @ turn
        placed[limb.markers] = found.guesses.place[row]
    placement, surface = skin.attach(placed)
    return replace(state, pose=replace(state.pose, rotations=rotations), placement=placement), surface
