"""Further minima of one limb's energy: where they are, and what they cost beside the answer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.second.limb import Guesses, Limb

_ALONG, _ACROSS = 0.35, 0.17
"""rad, how far a bone is turned at first about its own length, and about the two other axes of its frame: what is below
it moves along then, so 10 degrees move an ankle by some 70 mm. The last bone, with nothing below, takes the first."""
_WIDE, _FINE = (0.02, 0.08, 4), (0.01, 0.04, 20)
"""m, spread and kernel of the markers, and steps."""
_SAME_M, _SAME_DEG = 0.004, 3.0
"""Descents that have come this near to each other go on as one, but for one that costs less by more than a share."""
_SAME_COST = 0.01


@dataclass(frozen=True, eq=False)
class Minima:
    """Where the descents of a limb ended.

    Attributes
    ----------
    guesses : (S) the first from the answer itself, the others from elsewhere
    cost : (S,) per frame
    apart : (S, K) m, mean distance of each joint from where the first has it
    turn_deg : (S, K) turn of each bone against the first
    """

    guesses: Guesses
    cost: np.ndarray
    apart: np.ndarray
    turn_deg: np.ndarray


def starts(limb: Limb) -> Guesses:
    """Every bone turned both ways about each of its axes, the markers set where they are then carried."""
    count, turns = len(limb.bones), []
    for k in range(count):
        length = limb.segment[min(k, count - 2)]
        for axis in range(3):
            last, along = k == count - 1, axis == int(np.abs(length).argmax())
            for sign in (-1, 1):
                vector = np.zeros((count, 3))
                vector[k, axis] = sign * (_ALONG if last or along else _ACROSS)
                turns.append(vector)
    return limb.placed_again(limb.at(exp_so3(np.stack(turns))))


def minima(limb: Limb) -> Minima:
    """Where the answer and each start come to rest."""
    answer = limb.at(np.eye(3) + np.zeros((1, len(limb.bones), 3, 3)))
    wide = limb.descend(starts(limb), *_WIDE)[0]
    guesses, cost = limb.descend(answer.joined(wide), _FINE[0], _FINE[1], _WIDE[2])
    kept = _different(limb, guesses, cost)
    guesses, cost = limb.descend(guesses.take(kept), *_FINE)
    apart, turn = _apart(limb, guesses, 0)
    return Minima(guesses, cost / len(limb.first), apart, turn)


def _apart(limb: Limb, guesses: Guesses, row: int) -> tuple[np.ndarray, np.ndarray]:
    """(S, K) m and degrees, how far joints and bones are from those of one of the guesses."""
    joints = limb.joints(guesses)
    return np.linalg.norm(joints - joints[row], axis=3).mean(axis=1), limb.turned_apart(guesses, row)


def _different(limb: Limb, guesses: Guesses, cost: np.ndarray) -> np.ndarray:
    """The first guess, and of the others the cheapest of each that have come together, none that came to the first.

    One that came to the first at a lower cost stays: its markers ride on other skin.
    """
    left = 1 + np.argsort(cost[1:])
    kept = [0]
    while True:
        apart, turn = _apart(limb, guesses, kept[-1])
        same = (apart < _SAME_M).all(axis=1) & (turn < _SAME_DEG).all(axis=1)
        same &= cost > cost[kept[-1]] * (1 - _SAME_COST)
        left = left[~same[left]]
        if not len(left):
            return np.array(kept)
        kept.append(int(left[0]))
        left = left[1:]
