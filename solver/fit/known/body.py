"""What a solved trial knows of a person: the shape of the body, and where on it each marker is stuck."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Points, Pose, blended_turn, forward, place_points
from markerscope.solver.fit.results import FittedMotion

_ENOUGH_FRAMES = 60


@dataclass(frozen=True)
class KnownBody:
    """A person with U markers.

    Attributes
    ----------
    betas : (S,) shape, bone lengths last
    placement : (U) markers on the body at rest
    markers : (U,) index of each among the trial's markers, -1 for one that other trials placed
    poses : (P, 24, 3, 3) parent-relative rotations that the person was seen in, root included
    off_m : m, how far the markers are from their places on average where the person was seen; NaN where unknown
    """

    betas: np.ndarray
    placement: Points
    markers: np.ndarray
    poses: np.ndarray
    off_m: float = float("nan")


def known_body(body: Body, motion: FittedMotion) -> KnownBody:
    """The person of a fitted trial.

    A marker's place at rest is the one that, carried by the skin below it, comes nearest to where the fit put it.

    Parameters
    ----------
    body : the one that the motion was fitted with
    motion : any fitted trial
    """
    markers = np.flatnonzero(motion.marker_joint >= 0)
    frames = np.unique(np.linspace(0, len(motion.time) - 1, _ENOUGH_FRAMES).astype(int))
    links = forward(body, Pose(motion.rotations[frames], motion.trans[frames], motion.betas))
    skin = Points.of_vertices(body, motion.marker_vertex[markers])
    turn = blended_turn(skin, links)  # (F, U, 3, 3)
    at_zero = place_points(
        Points(np.zeros_like(skin.rest), np.zeros_like(skin.dirs), skin.weights), links, motion.betas
    )
    gap = motion.placed[frames][:, markers] - at_zero
    normal = np.einsum("fuab,fuac->ubc", turn, turn)
    rest = np.linalg.solve(normal, np.einsum("fuab,fua->ub", turn, gap)[..., None])[..., 0]
    placement = Points(rest - skin.dirs @ motion.betas, skin.dirs, skin.weights)
    off = float(np.nanmean(motion.residual[:, markers])) if np.isfinite(motion.residual[:, markers]).any() else np.nan
    return KnownBody(motion.betas, placement, markers, spread_out(motion.rotations), off)


def spread_out(rotations: np.ndarray, count: int = 6) -> np.ndarray:
    """Some of the poses, each as unlike those before it as can be (farthest points), root included."""
    some = rotations[:: max(1, len(rotations) // 400)]
    joints = some[:, 1:].reshape(len(some), -1)
    chosen = [int(np.argmin(np.linalg.norm(joints - joints.mean(axis=0), axis=1)))]
    distance = np.full(len(some), np.inf)
    while len(chosen) < min(count, len(some)):
        distance = np.minimum(distance, np.linalg.norm(joints - joints[chosen[-1]], axis=1))
        chosen.append(int(distance.argmax()))
    return some[chosen]
