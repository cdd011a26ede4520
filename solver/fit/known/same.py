"""Whether a trial is of the person it was taken for, with the markers where they were."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.kinematics import Points, forward, place_points
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import Observations, State, Surface, Weights

CAP = 0.6
_FIT = Phase(0.02, 0.2, 8, free_placement=True)


@dataclass(frozen=True)
class Compared:
    """What holding the person's shape and markers costs a trial.

    Attributes
    ----------
    held_m : m, median distance of the markers from their places, shape and places held
    shape_m : the same with the shape free
    places_m : the same with the places free
    longer : largest change of a bone's length that the free shape asks for, as a share of it, and (name) of which bone
    moved_m : (U,) m, how far the free places are from those held
    cap : the confidence is at most this
    doubts : one sentence each
    """

    held_m: float
    shape_m: float
    places_m: float
    longer: float
    bone: str
    moved_m: np.ndarray
    cap: float
    doubts: tuple[str, ...]


def compare(
    body: Body, seen: Observations, state: State, surface: Surface, base: Weights, share: float, *, moved: bool
) -> Compared:
    """What freeing the shape, and freeing the places, would gain.

    Parameters
    ----------
    seen : the keyframes
    state : the person as known, in the poses of the keyframes
    base : weights with shape and places held
    share : of the person's markers that were found in the trial
    moved : markers were put on anew
    """
    none = Points(np.zeros((0, 3)), np.zeros((0, 3, body.shape_count)), np.zeros((0, 24)))
    problem = Problem(body, seen, none)
    held, _, _ = descend(problem, state, surface, (_FIT,), base)
    shaped, _, _ = descend(problem, held, surface, (_FIT,), replace(base, free_shape=True))
    placed, _, _ = descend(problem, held, surface, (_FIT,), replace(base, free_placement=True))
    off = [_off(body, problem, one) for one in (held, shaped, placed)]
    before, after = (_lengths(body, one) for one in (held, shaped))
    change = np.abs(after / np.maximum(before, 1e-3) - 1)
    limb = int(change.argmax())
    slid = np.linalg.norm(
        placed.placement.shaped(placed.pose.betas) - held.placement.shaped(held.pose.betas), axis=1
    )
    return Compared(off[0], off[1], off[2], float(change[limb]), JOINTS[limb], slid, 1.0, ())


def _off(body: Body, problem: Problem, state: State) -> float:
    where = place_points(state.placement, forward(body, state.pose), state.pose.betas)
    gap = np.where(problem.present, np.linalg.norm(where - problem.target, axis=2), np.nan)
    return float(np.nanmean(gap))


_LIMBS = np.array([JOINTS.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("knee", "ankle", "elbow", "wrist")])


def _lengths(body: Body, state: State) -> np.ndarray:
    """(24,) m, of the bone that ends at each joint; those of the limbs alone."""
    joints = body.joints(state.pose.betas)
    out = np.ones(len(JOINTS))
    out[_LIMBS] = np.linalg.norm(joints[_LIMBS] - joints[[PARENTS[j] for j in _LIMBS]], axis=1)
    return out
