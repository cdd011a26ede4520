"""A trial with a video of its own, held to what is known of the person from all trials."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.fit.known.track import surface_of
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import State, Surface, Weights

_REACH_M = 0.05
"""A marker that the trial has further from every known place keeps the place that the trial gives it."""
_AGAIN = Phase(0.01, 0.04, 6)

Hold = Callable[[Problem, State, Surface, Weights], tuple[State, Surface]]


def held_to(body: Body, known: KnownBody) -> Hold:
    """What puts the known shape and places into a fit of some keyframes, and lets its poses and camera follow."""

    def hold(problem: Problem, state: State, surface: Surface, weights: Weights) -> tuple[State, Surface]:
        own, theirs = state.placement.shaped(known.betas), known.placement.shaped(known.betas)
        place = matched(own, theirs)
        told = place >= 0
        given = known.placement.take(np.clip(place, 0, None))
        placement = Points(
            *(
                np.where(told.reshape(-1, *[1] * (old.ndim - 1)), new, old)
                for old, new in (
                    (state.placement.rest, given.rest),
                    (state.placement.dirs, given.dirs),
                    (state.placement.weights, given.weights),
                )
            )
        )
        start = replace(state, placement=placement, pose=replace(state.pose, betas=known.betas))
        skin = surface_of(body, placement, known.betas)
        still = replace(weights, free_shape=False, free_placement=False)
        ended, _, _ = descend(problem, start, skin, (_AGAIN,), still)
        return ended, skin

    return hold


def matched(own: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(U,) the known place (K, 3) m that each place (U, 3) m of a trial is, one to one; -1 where none is near."""
    gap = np.linalg.norm(own[:, None] - known, axis=2)
    rows, columns = linear_sum_assignment(np.minimum(gap, _REACH_M) ** 2)
    place = np.full(len(own), -1)
    near = gap[rows, columns] < _REACH_M
    place[rows[near]] = columns[near]
    return place
