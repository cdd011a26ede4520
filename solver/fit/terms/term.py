"""What a term of the energy is: a name, what an estimate costs by it, and its part of the normal equations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Protocol

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Chain, Points, shape_jacobian
from markerscope.solver.fit.normal import NormalEquations, group_jacobian, groups
from markerscope.solver.fit.state import State, Surface, Unknowns, Weights


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where the terms are evaluated.

    Attributes
    ----------
    links : the state's forward kinematics, (F, 24, ...)
    weights : of the phase; spreads that no phase changes are a term's own
    unknowns : where the unknowns shared by all frames stand in the normal equations
    """

    body: Body
    state: State
    links: Chain
    surface: Surface
    weights: Weights
    unknowns: Unknowns

    @property
    def frames(self) -> int:
        """F."""
        return len(self.links.turn)


class Term(Protocol):
    """A term of the energy; a frozen dataclass that holds its data."""

    @property
    def name(self) -> str:
        """What its cost is listed by; terms of one name are listed as one."""

    def energy(self, at: Estimate) -> float:
        """What the estimate costs by this term, the mean over the F frames."""

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """Add the Gauss-Newton matrix J^T W J and the slope J^T W r, both of the sum over frames."""


class Evidence(Term, Protocol):
    """A term that comes with the observations and goes with them wherever the fit looks at some of the frames."""

    def of_frames(self, frames: np.ndarray | slice) -> Evidence:
        """The same of some of the frames; itself, where it says nothing of single frames."""


@dataclass(frozen=True)
class Energies:
    """The cost of an estimate by the name of the term, each per frame."""

    by_term: dict[str, float]

    def __getitem__(self, name: str) -> float:
        return self.by_term[name]

    @property
    def total(self) -> float:
        """Sum of all terms."""
        return reduce(add, self.by_term.values(), 0.0)


def add_points(
    sums: NormalEquations,
    at: Estimate,
    points: Points,
    by_place: np.ndarray,
    residual: np.ndarray,
    shared: slice | None = None,
    by_shared: np.ndarray | None = None,
) -> None:
    """Add rows that depend on where points of the body are in the lab.

    Parameters
    ----------
    points : P of the body
    by_place : (F, P, R, 3) derivative of R rows a point by its place (1/m), times the root of the weight
    residual : (F, P, R), times the root of the weight
    shared, by_shared : unknowns shared by all frames and the derivatives by them, (F, P, R, B); None takes the shape's
    """
    frames, _, rows, _ = by_place.shape
    if shared is None:
        shared = at.unknowns.shape
        if at.weights.free_shape:
            by_shared = by_place @ shape_jacobian(at.body, points, at.links)
    for group in groups(points.weights):
        p = group.points
        count = rows * len(p)
        by_pose = by_place[:, p] @ group_jacobian(points, group, at.links, at.state.pose.betas)
        mine = None if by_shared is None else by_shared[:, p].reshape(frames, count, -1)
        sums.add_rows(group, by_pose.reshape(frames, count, -1), residual[:, p].reshape(frames, -1), shared, mine)
