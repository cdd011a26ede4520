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
_LEAST_SHARE = 0.7
_USUAL_M, _TIMES, _MORE_M = 0.004, 1.8, 0.0025
"""m and 1: markers this much further off than elsewhere are not where the person's are. Fixed on
16 synthetic trials of the same person (1.0 to 1.2 times) and six real ones (1.1 to 1.3); of others it was 3.3 and more.
"""
_SHAPE_GAIN = 0.3
"""Of what free places gain a free shape gains so much, if it is another person."""
_MOVED_M = 0.02
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
    share : of the person's markers that were found in the trial
    """

    held_m: float
    shape_m: float
    places_m: float
    longer: float
    bone: str
    moved_m: np.ndarray
    share: float


@dataclass(frozen=True)
class Said:
    """What speaks against the person: one sentence each, and what the confidence is at most."""

    doubts: tuple[str, ...] = ()
    cap: float = 1.0


def said(found: Compared, usual_m: float, *, moved: bool) -> Said:
    """What there is to doubt.

    Parameters
    ----------
    usual_m : m, how far the person's markers are from their places elsewhere; NaN where that is not known
    moved : the user has said that markers were put on anew
    """
    doubts = []
    if found.share < _LEAST_SHARE:
        doubts.append(
            f"Only {100 * found.share:.0f} % of the person's markers were found in this trial: check that it is of "
            "this person with the same markers."
        )
    usual = usual_m if np.isfinite(usual_m) else _USUAL_M
    if found.held_m > max(_TIMES * usual, usual + _MORE_M):
        held = f"Markers are {1000 * found.held_m:.0f} mm from the person's places ({1000 * usual:.0f} elsewhere)"
        gain = (found.held_m - found.shape_m) / max(found.held_m - found.places_m, 1e-4)
        if gain >= _SHAPE_GAIN:
            doubts.append(
                f"{held}, and another shape of body brings them to {1000 * found.shape_m:.0f} mm "
                f"({found.bone.replace('_', ' ')} {100 * found.longer:.0f} % off in length): this is likely another "
                "person; solve the trial apart from this subject."
            )
        elif not moved:
            count = int((found.moved_m > _MOVED_M).sum())
            doubts.append(
                f"{held}, and other places bring them to {1000 * found.places_m:.0f} mm ({count} of "
                f"{len(found.moved_m)} markers by more than {1000 * _MOVED_M:.0f} mm): markers were "
                "likely moved between the trials; if so, say markers_moved = true."
            )
    return Said(tuple(doubts), CAP if doubts else 1.0)


def compare(body: Body, seen: Observations, state: State, surface: Surface, base: Weights, share: float) -> Compared:
    """What freeing the shape, and freeing the places, would gain.

    Parameters
    ----------
    seen : the keyframes
    state : the person as known, in the poses of the keyframes
    base : weights with shape and places held
    share : of the person's markers that were found in the trial
    """
    none = Points.none(body.shape_count)
    problem = Problem(body, seen, none)
    held, _, _ = descend(problem, state, surface, (_FIT,), base)
    shaped, _, _ = descend(problem, held, surface, (_FIT,), replace(base, free_shape=True))
    placed, _, _ = descend(problem, held, surface, (_FIT,), replace(base, free_placement=True))
    off = [_off(body, problem, one) for one in (held, shaped, placed)]
    before, after = (_lengths(body, one) for one in (held, shaped))
    change = np.abs(after / np.maximum(before, 1e-3) - 1)
    limb = int(change.argmax())
    slid = np.linalg.norm(placed.placement.shaped(placed.pose.betas) - held.placement.shaped(held.pose.betas), axis=1)
    return Compared(off[0], off[1], off[2], float(change[limb]), JOINTS[limb], slid, share)


def _off(body: Body, problem: Problem, state: State) -> float:
    where = place_points(state.placement, forward(body, state.pose), state.pose.betas)
    gap = np.where(problem.present, np.linalg.norm(where - problem.target, axis=2), np.nan)
    return float(np.nanmean(gap))


_LIMBS = np.array(
    [JOINTS.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("knee", "ankle", "elbow", "wrist")]
)


def _lengths(body: Body, state: State) -> np.ndarray:
    """(24,) m, of the bone that ends at each joint; those of the limbs alone."""
    joints = body.joints(state.pose.betas)
    out = np.ones(len(JOINTS))
    out[_LIMBS] = np.linalg.norm(joints[_LIMBS] - joints[[PARENTS[j] for j in _LIMBS]], axis=1)
    return out
