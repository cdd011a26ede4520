"""What made motions are put together from: easing, sway, feet that stay where they are planted, legs that follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX

LAB_FROM_REST = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""(3, 3) stands the rest body (y up, facing +z) up in the lab (z up), facing +x."""
LIFT = 0.09
"""m, how high a long step lifts the ankle."""
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class Foot:
    """Where an ankle is (T, 3) m and how its foot stands: heading and pitch (toes down) (T,)."""

    ankle: np.ndarray
    heading: np.ndarray
    pitch: np.ndarray


@dataclass(frozen=True)
class Steps:
    """When and where a person steps: times in s, left foot first.

    Attributes
    ----------
    first, step, swing, stop : start of the first step, time between steps, time a foot is in the air, no step later
    heading : (n,) rad at (n,) s
    ground : (n, 2) m at (n,) s, where the pelvis is meant to be over the floor
    """

    first: float
    step: float
    swing: float
    stop: float
    heading: Callable[[np.ndarray], np.ndarray]
    ground: Callable[[np.ndarray], np.ndarray]


class Sway:
    """Small slow wanderings, a new one at every call."""

    def __init__(self, time: np.ndarray, rng: np.random.Generator) -> None:
        self._time, self._rng = time, rng

    def __call__(self, size: float) -> np.ndarray:
        """(T,) of about this size."""
        frequency, phase = self._rng.uniform(0.15, 0.9, 4), self._rng.uniform(0, 2 * np.pi, 4)
        waves = np.sin(2 * np.pi * frequency * self._time[:, None] + phase) * self._rng.uniform(0.3, 1, 4)
        return size * waves.sum(axis=1) / 2


def ease(time: np.ndarray, start: float, stop: float) -> np.ndarray:
    """0 before ``start``, 1 after ``stop``, with least jerk between."""
    u = np.clip((time - start) / (stop - start), 0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


def hump(time: np.ndarray, up: tuple[float, float], down: tuple[float, float]) -> np.ndarray:
    """From 0 to 1 and back to 0."""
    return ease(time, *up) - ease(time, *down)


def turn(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations about a fixed axis."""
    return exp_so3(np.asarray(angle)[:, None] * axis)


def stepping_foot(time: np.ndarray, side: str, rest: np.ndarray, sole: float, sway: Sway, plan: Steps) -> Foot:
    """The steps of one foot along the path: planted, rolled off its ball, swung, set down on its heel."""
    sign = 1.0 if side == "left" else -1.0
    ankle, toe = rest[INDEX[f"{side}_ankle"]], rest[INDEX[f"{side}_foot"]]
    width = abs(ankle[0]) * 0.75
    starts = np.arange(plan.first + (0 if side == "left" else plan.step), plan.stop, 2 * plan.step)

    def planted(moment: np.ndarray) -> np.ndarray:
        """(n, 3): the place over the floor and the heading of the foot beside the path at some moments."""
        heading = plan.heading(moment)
        out = sign * width * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        return np.column_stack([plan.ground(moment) + out, heading + sign * 0.08])

    places = np.concatenate([planted(np.zeros(1)), planted(starts + plan.swing + 0.5 * (2 * plan.step - plan.swing))])
    ground, lift, pitch = np.tile(places[0], (len(time), 1)), np.zeros(len(time)), np.zeros(len(time))
    for k, start in enumerate(starts):
        swing = ease(time, start, start + plan.swing)[:, None]
        ground += swing * (places[k + 1] - places[k])
        length = min(1.0, float(np.linalg.norm(places[k + 1, :2] - places[k, :2])) / 0.7)
        air = np.clip((time - start) / plan.swing, 0, 1)
        lift += (0.4 + 0.6 * length) * LIFT * 16 * air**2 * (1 - air) ** 2
        pitch += length * 0.62 * hump(time, (start - 0.20, start + 0.04), (start + 0.04, start + 0.26))
        pitch -= (
            length
            * 0.28
            * hump(time, (start + 0.16, start + plan.swing), (start + plan.swing, start + plan.swing + 0.14))
        )
    # The foot turns about its ball with the toes down, about its heel with them up.
    ball = np.array([toe[2] - ankle[2], 0.0, toe[1] - ankle[1] - 0.02])
    heel = np.array([-0.05, 0.0, sole - ankle[1]])
    pivot = np.where(pitch[:, None] > 0, ball, heel)
    rolled = pivot - np.einsum("tij,tj->ti", turn(_Y, pitch), pivot)
    heading = ground[:, 2] + sway(0.01)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    place = ground[:, :2] + rolled[:, :1] * forward
    return Foot(np.column_stack([place, ankle[1] - sole + lift + rolled[:, 2]]), heading, pitch)


def standing_height(
    ground: np.ndarray, pelvis: np.ndarray, feet: dict[str, Foot], rest: np.ndarray, rate: float
) -> np.ndarray:
    """(T,) m of the pelvis over ``ground`` (T, 2): as high as the legs allow without quite straightening."""
    from scipy.ndimage import gaussian_filter1d

    reach = []
    for side, foot in feet.items():
        hip, knee, ankle = (rest[INDEX[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        length = 0.994 * (np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
        offset = pelvis @ (hip - rest[0])
        apart = np.linalg.norm(ground + offset[:, :2] - foot.ankle[:, :2], axis=1)
        reach.append(foot.ankle[:, 2] + np.sqrt(np.maximum(length**2 - apart**2, 0.2)) - offset[:, 2])
    height: np.ndarray = gaussian_filter1d(np.minimum(*reach), 0.09 * rate, mode="nearest") - 0.012
    return height


def set_leg(local: np.ndarray, side: str, rest: np.ndarray, pelvis_position: np.ndarray, foot: Foot) -> None:
    """Hip, knee, ankle and toe rotations that bring an ankle to its foot, the knee bending forward."""
    hip, knee, ankle = (INDEX[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle"))
    pelvis = local[:, 0]
    start = pelvis_position + pelvis @ (rest[hip] - rest[0])
    thigh, shank = np.linalg.norm(rest[knee] - rest[hip]), np.linalg.norm(rest[ankle] - rest[knee])
    span = foot.ankle - start
    distance = np.linalg.norm(span, axis=1)
    along = span / distance[:, None]
    # A leg that is nearly straight gives way softly: a knee that snaps straight would jerk the markers.
    stretch = distance / (thigh + shank)
    distance = (thigh + shank) * (stretch - 0.006 * np.logaddexp(0, (stretch - 0.997) / 0.006))
    ahead = np.stack([np.cos(foot.heading), np.sin(foot.heading), np.zeros(len(span))], axis=1)
    ahead = ahead - np.sum(ahead * along, axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    cosine = (thigh**2 + distance**2 - shank**2) / (2 * thigh * distance)
    bent = thigh * (cosine[:, None] * along + np.sqrt(1 - cosine**2)[:, None] * ahead)
    hinge = np.cross(-along, ahead)  # to the left
    turn_thigh = frame(bent, hinge) @ frame(rest[knee] - rest[hip], _X).T
    turn_shank = frame(distance[:, None] * along - bent, hinge) @ frame(rest[ankle] - rest[knee], _X).T
    turn_foot = turn(_Z, foot.heading) @ turn(_Y, foot.pitch) @ LAB_FROM_REST
    local[:, hip] = pelvis.swapaxes(1, 2) @ turn_thigh
    local[:, knee] = turn_thigh.swapaxes(1, 2) @ turn_shank
    local[:, ankle] = turn_shank.swapaxes(1, 2) @ turn_foot
    local[:, INDEX[f"{side}_foot"]] = turn(_X, -0.8 * np.maximum(foot.pitch, 0))


def frame(along: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """(..., 3, 3) columns: the hinge made square to the bone, the bone, and their cross product."""
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    across = hinge - np.sum(hinge * along, axis=-1, keepdims=True) * along
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([across, along, np.cross(across, along)], axis=-1)
