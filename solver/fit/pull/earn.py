"""The pull earned and carried out: on the winner alone, between the ranking and the solve of every frame."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull import mixture
from markerscope.solver.fit.pull.results import EARNED, LandmarkPull, nothing_drawn
from markerscope.solver.fit.pull.targets import Targets, skin_area, targets_of
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.state import Observations, State, Surface, Weights

SPREADS = (0.025, 0.018, 0.012)
"""m, of hands and of what the fit misses: less as the fit nears the landmarks. The first one judges the layout."""
_ROUNDS = 2
_PHASE = Phase(0.01, 0.04, 3, free_placement=True)
KAPPA = 6.0
"""A marker on its landmark for certain counts as this many sightings of it there, in all frames together."""
_FAR_M = 0.016
"""A layout whose hits lie further beside the landmarks than this, along each direction, was not palpated there."""
_BELIEVED_HITS = 4.0
"""What is believed of the spread counts as much as so many hits."""
_NAMED = 0.05
"""The least probability that is worth a name."""


@dataclass(frozen=True)
class Drawn:
    """The keyframes' fit after the pull, or as it was, what became of the markers (U), and the energy's last pull."""

    state: State
    surface: Surface
    pull: LandmarkPull
    by: Pull | None = None


def draw(
    body: Body,
    seen: Observations,
    landmarks: Points,
    state: State,
    surface: Surface,
    weights: Weights,
    fixed: np.ndarray,
    allowed: np.ndarray,
) -> Drawn:
    """Draw the markers to the landmarks that they probably sit on, if their places say that any do.

    Expectation maximisation: which marker sits on which landmark, then poses, shape and places given that.

    Parameters
    ----------
    seen : the keyframes' markers that the fit uses, and the video there
    landmarks : the video's, as points of the body
    state, surface, weights : the keyframes' fit
    fixed, allowed : (U, L) pairs that are so by hand, and those that can be
    """
    targets, before = _distances(body, state, weights, allowed)
    free = ~fixed.any(axis=1)
    given = mixture.densities(before, SPREADS[0], skin_area(body))[free].sum(axis=1)
    log_ratio, share = mixture.likelihood_ratio(given)
    earned = log_ratio > EARNED
    if not (earned or fixed.any()):
        return Drawn(state, surface, nothing_drawn("not earned", log_ratio, len(before)))
    share = share if earned else 0.0
    now, skin, distance, believed = state, surface, before, SPREADS[0]
    chance, pull = np.zeros_like(before), None
    for least in SPREADS:
        for _ in range(_ROUNDS):
            spread = max(least, believed)
            given = mixture.densities(distance, spread, skin_area(body))
            chance = np.where(fixed, 1.0, mixture.expectation(np.where(fixed, 0.0, given), share))
            share = mixture.share_of(chance[free]) if earned else 0.0
            pull = Pull.of(chance, KAPPA / spread**2, targets)
            problem = Problem(body, replace(seen, further=(*seen.further, pull)), landmarks)
            now, skin, _ = descend(problem, now, skin, (_PHASE,), weights)
            targets, distance = _distances(body, now, weights, allowed)
            believed = mixture.spread_of(chance, distance, SPREADS[-1], _BELIEVED_HITS)
    if earned and believed > _FAR_M:
        if not fixed.any():
            return Drawn(state, surface, nothing_drawn("given up", log_ratio, len(before), believed))
        return draw(body, seen, landmarks, state, surface, weights, fixed, fixed)
    found = _said(targets, chance, before, distance)
    pulled = LandmarkPull("earned" if earned else "by hand", log_ratio, *found, spread=believed)
    return Drawn(now, skin, pulled, pull)


def _distances(body: Body, state: State, weights: Weights, allowed: np.ndarray) -> tuple[Targets, np.ndarray]:
    """The landmarks of the state's body, and (U, L) m of each marker from each, infinite where a pair cannot be."""
    betas = state.pose.betas
    targets = targets_of(body, betas, weights.offset)
    gap = state.placement.shaped(betas)[:, None] - targets.shaped(betas)
    return targets, np.where(allowed, np.linalg.norm(gap, axis=2), np.inf)


def _said(
    targets: Targets, chance: np.ndarray, before: np.ndarray, after: np.ndarray
) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, np.ndarray]:
    """Of each marker: its likeliest landmark, with what probability, and its distance (m) from there then and now."""
    every, best = np.arange(len(chance)), chance.argmax(axis=1)
    probability = chance[every, best]
    named = probability >= _NAMED
    names = tuple(targets.names[i] if known else "" for i, known in zip(best, named, strict=True))
    then, now = (np.where(named, distance[every, best], np.nan) for distance in (before, after))
    return names, np.where(named, probability, 0.0), then, now
