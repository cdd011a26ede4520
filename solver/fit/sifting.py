"""Markers that fit no place on the body, found after a fit."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import Fit, place_costs
from markerscope.solver.fit.doubts.far import FAR_M, suspects, typical
from markerscope.solver.fit.kinematics import forward, place_points
from markerscope.solver.fit.problem import Problem

NOWHERE_M = 0.06
"""A marker that no place on the skin comes nearer to (root mean square over time) is not on this body."""


def residual_of(body: Body, fitted: Fit, markers: np.ndarray) -> np.ndarray:
    """(N, U) m, distance of each marker (N, U, 3) from where a fit puts it; NaN where lost."""
    state = fitted.state
    placed = place_points(state.placement, forward(body, state.pose), state.pose.betas)
    return np.linalg.norm(markers - placed, axis=2)


def strays(body: Body, fitted: Fit, markers: np.ndarray) -> np.ndarray:
    """(U,) True for markers that are far from where a refined fit puts them; none where it was not refined."""
    if not fitted.refined:
        return np.zeros(markers.shape[1], dtype=bool)
    with np.errstate(invalid="ignore"):
        far: np.ndarray = typical(residual_of(body, fitted, markers)) > FAR_M
    return far


def without_place(problem: Problem, fitted: Fit, offset: float) -> np.ndarray:
    """(U,) True for markers that no place on the skin comes near to, as the body moves in a fit.

    Parameters
    ----------
    offset : m, usual height of a marker above the skin
    """
    _, _, square = place_costs(problem, fitted.state, offset)
    count = np.maximum(problem.present.sum(axis=0), 1)
    nowhere: np.ndarray = np.sqrt(np.maximum(square.min(axis=0), 0) / count) > NOWHERE_M
    return nowhere


def loose_share(body: Body, fitted: Fit, markers: np.ndarray) -> float:
    """Share of the markers that a fit leaves far enough from their places to be on a wrong bone."""
    return len(suspects(residual_of(body, fitted, markers))) / max(markers.shape[1], 1)
