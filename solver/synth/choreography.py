"""Made motions from key poses: a few numbers at a few moments become a whole body that stands on its feet.

Angles are in rad, lengths in m, times in s. A key pose names only what is not as in standing:

- pelvis: ``forward``, ``left``, ``down``, ``lean`` (tilts forward), ``list`` (to the right), ``turn`` (to the left)
- trunk and head: ``bend`` (forward), ``side`` (to the right), ``twist`` (to the left), ``nod``, ``look`` (to the left)
- arms, with ``left_`` or ``right_`` before: ``raise`` (forward), ``out`` (sideways), ``in`` (rotation), ``elbow``
- feet, likewise: ``step`` (forward), ``wide`` (outward), ``lift``, ``point`` (toes down)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.rig import LAB_FROM_REST, Foot, Sway, set_leg, standing_height, turn

_X, _Y, _Z = np.eye(3)
_MIRRORED = ("left", "list", "turn", "side", "twist", "look")  # change their sign where left and right are exchanged
_FASTER, _SMALLER = (0.85, 1.2), (0.8, 1.1)  # how unlike two repetitions are
_SOFT = 0.05  # s, over which a change of pace is drawn out
_SIDES = ("left", "right")


@dataclass(frozen=True)
class Key:
    """A pose at a moment: s since the start of the cycle, and what is not as in standing."""

    time: float
    pose: dict[str, float]


def mirrored(keys: Sequence[Key]) -> tuple[Key, ...]:
    """The same with left and right exchanged."""
    return tuple(Key(key.time, dict(_other_side(name, value) for name, value in key.pose.items())) for key in keys)


def _other_side(name: str, value: float) -> tuple[str, float]:
    side, _, rest = name.partition("_")
    if side in _SIDES and rest:
        return f"{'right' if side == 'left' else 'left'}_{rest}", value
    return name, -value if name in _MIRRORED else value


def perform(
    cycles: Sequence[Sequence[Key]],
    body: Body,
    betas: np.ndarray,
    *,
    seconds: float,
    rate: float,
    rng: np.random.Generator,
) -> Motion:
    """Repeat cycles of key poses in turn, no two alike, on the spot that the generator draws.

    Parameters
    ----------
    cycles : each begins and ends standing
    body, betas : whose legs reach the floor
    """
    time = np.arange(round(seconds * rate)) / rate
    course = _course(cycles, time, rng)
    sway = Sway(time, rng)
    rest = body.joints(betas)
    sole = float(body.surface(betas)[:, 1].min())
    start, heading = rng.uniform(-0.6, 0.6, 2), float(rng.uniform(-np.pi, np.pi))
    feet = {side: _foot(course, side, rest, sole, start, heading) for side in _SIDES}
    return embodied(course, feet, start, np.full(len(time), heading), rest, rate, sway)


class Course:
    """The value of every channel over time: (T,) by name, 0 where there is none of that name."""

    def __init__(self, values: Mapping[str, np.ndarray], frames: int) -> None:
        self._values, self._zero = values, np.zeros(frames)

    def __getitem__(self, name: str) -> np.ndarray:
        return self._values.get(name, self._zero)


def _course(cycles: Sequence[Sequence[Key]], time: np.ndarray, rng: np.random.Generator) -> Course:
    """The channels of repeated cycles, flat where two key poses agree, so that a planted foot stays."""
    from scipy.interpolate import PchipInterpolator
    from scipy.ndimage import gaussian_filter1d

    names = sorted({name for cycle in cycles for key in cycle for name in key.pose})
    moments, poses = [], []
    clock, count = 0.3, 0
    while clock < time[-1] + 1:
        slower, size = rng.uniform(*_FASTER), rng.uniform(*_SMALLER)
        cycle = cycles[count % len(cycles)]
        for key in cycle[:-1]:
            moments.append(clock + slower * key.time)
            poses.append([size * key.pose.get(name, 0.0) for name in names])
        clock += slower * cycle[-1].time
        count += 1
    inside = np.clip(time, moments[0], moments[-1])
    values = gaussian_filter1d(PchipInterpolator(moments, np.array(poses))(inside), _SOFT / (time[1] - time[0]), axis=0)
    return Course(dict(zip(names, values.T, strict=True)), len(time))


def _foot(course: Course, side: str, rest: np.ndarray, sole: float, start: np.ndarray, heading: float) -> Foot:
    """A foot where the key poses have it; with its toes down it stands on its ball."""
    sign = 1.0 if side == "left" else -1.0
    ankle, toe = rest[INDEX[f"{side}_ankle"]], rest[INDEX[f"{side}_foot"]]
    pitch = course[f"{side}_point"]
    ball = np.array([toe[2] - ankle[2], 0.0, toe[1] - ankle[1] - 0.02])
    rolled = ball - np.einsum("tij,j->ti", turn(_Y, pitch), ball)
    aside = sign * (0.9 * abs(ankle[0]) + course[f"{side}_wide"])
    place = np.stack([course[f"{side}_step"] + rolled[:, 0], aside], axis=1)
    c, s = np.cos(heading), np.sin(heading)
    height = ankle[1] - sole + course[f"{side}_lift"] + np.maximum(rolled[:, 2], 0)
    ground = place @ np.array([[c, s], [-s, c]]) + start
    return Foot(np.column_stack([ground, height]), np.full(len(pitch), heading + sign * 0.1), pitch)


def embodied(
    course: Course,
    feet: dict[str, Foot],
    path: np.ndarray,
    heading: np.ndarray,
    rest: np.ndarray,
    rate: float,
    sway: Sway,
) -> Motion:
    """The whole body over its feet; ``path`` (2,) or (T, 2) m is where it is, ``heading`` (T,) rad where it looks."""
    pelvis = (
        turn(_Z, heading + course["turn"] + sway(0.02))
        @ turn(_X, course["list"] + sway(0.012))
        @ turn(_Y, 0.05 + course["lean"] + sway(0.012))
        @ LAB_FROM_REST
    )
    c, s = np.cos(heading), np.sin(heading)
    ahead, left = course["forward"] + sway(0.01), course["left"] + sway(0.01)
    ground = path + np.stack([c * ahead - s * left, s * ahead + c * left], axis=1)
    height = standing_height(ground, pelvis, feet, rest, rate) - course["down"]
    position = np.column_stack([ground, height])
    local = np.tile(np.eye(3), (len(heading), len(JOINTS), 1, 1))
    local[:, 0] = pelvis
    for side, foot in feet.items():
        set_leg(local, side, rest, position, foot)
        _set_arm(local, side, course, sway)
    for name in ("spine1", "spine2", "spine3"):
        forward = (course["bend"] / 3 - 0.02) + sway(0.012)
        local[:, INDEX[name]] = (
            turn(_X, forward)
            @ turn(_Y, course["twist"] / 3 + sway(0.015))
            @ turn(_Z, -course["side"] / 3 + sway(0.012))
        )
    for name in ("neck", "head"):
        local[:, INDEX[name]] = turn(_Y, course["look"] / 2 + sway(0.05)) @ turn(
            _X, 0.03 + course["nod"] / 2 + sway(0.03)
        )
    return Motion(local, position - rest[0], rate)


def _set_arm(local: np.ndarray, side: str, course: Course, sway: Sway) -> None:
    sign = 1.0 if side == "left" else -1.0
    flexion, out = course[f"{side}_raise"] + 0.06 + sway(0.03), course[f"{side}_out"] + 0.14 + sway(0.03)
    rotation, elbow = course[f"{side}_in"] + 0.2 + sway(0.04), course[f"{side}_elbow"] + 0.25 + sway(0.04)
    lifted = 0.14 * np.maximum(flexion, 0) + 0.14 * np.maximum(out, 0)
    local[:, INDEX[f"{side}_collar"]] = turn(_Z, sign * (lifted - 0.03)) @ turn(_Y, -sign * 0.1 * flexion)
    hang = turn(_Z, -sign * (np.pi / 2 - out))
    local[:, INDEX[f"{side}_shoulder"]] = turn(_X, -0.9 * flexion) @ hang @ turn(_X, -rotation)
    local[:, INDEX[f"{side}_elbow"]] = turn(_Y, -sign * np.maximum(elbow, 0.05)) @ turn(_X, 0.3 + sway(0.06))
    local[:, INDEX[f"{side}_wrist"]] = turn(_Z, sway(0.08)) @ turn(_Y, -sign * (0.05 + sway(0.06)))
