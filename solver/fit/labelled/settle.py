"""Markers of which only the bone is known, put where on that bone they fit best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.fit.kinematics import Points, blended_turn, forward, place_points
from markerscope.solver.fit.labelled.places import Places, bone_vertices
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import State, Surface, Weights

_MOST_CANDIDATES = 400
_REACH_M = 0.03


def settle(problem: Problem, state: State, surface: Surface, places: Places, weights: Weights) -> tuple[State, Surface]:
    """Each marker without a known vertex moved to the vertex of its bone that its whole trajectory fits best.

    In every frame the marker is carried back to the rest body as if it rode on a vertex; the vertex whose carried
    marker strays least from its skin, over all frames together, takes it.
    """
    body, betas = problem.body, state.pose.betas
    skin = Skin(body, betas)
    links = forward(body, state.pose)
    placed = state.placement.shaped(betas).copy()
    for i in np.flatnonzero(places.vertex < 0):
        own = bone_vertices(body, int(places.bone[i]))
        own = own[:: -(-len(own) // _MOST_CANDIDATES)]
        seen = problem.present[:, i]
        if not seen.any():
            continue
        points, _ = skin.on_vertices(own, weights.offset)
        gap = problem.target[:, i, None] - place_points(points, links, betas)  # (N, V, 3)
        best = int((np.einsum("nvk,nvk->nv", gap, gap) * seen[:, None]).sum(0).argmin())
        turn = blended_turn(points.take(np.array([best])), links)[:, 0]
        carried = np.einsum("nji,nj->ni", turn, gap[:, best])[seen].mean(0).clip(-_REACH_M, _REACH_M)
        normal = skin.normal(own[best])
        placed[i] = points.shaped(betas)[best] + carried - (carried @ normal) * normal
    moved, below = skin.attach(placed)
    known = places.vertex >= 0
    placement = Points(*(_pick(known, getattr(state.placement, k), getattr(moved, k)) for k in _FIELDS))
    return (
        replace(state, placement=placement),
        Surface(_pick(known, surface.point, below.point), _pick(known, surface.normal, below.normal)),
    )


_FIELDS = ("rest", "dirs", "weights")


def _pick(known: np.ndarray, old: np.ndarray, new: np.ndarray) -> np.ndarray:
    return np.where(known.reshape(-1, *[1] * (old.ndim - 1)), old, new)
