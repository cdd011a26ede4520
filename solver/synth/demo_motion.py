"""A motion of the project's own: a person who walks, turns, bends to the floor and raises an arm.

The pelvis follows a planned path, the feet step along it and stay planted between steps, legs follow by inverse
kinematics, trunk and arms by their swing. Angles are in rad, times in s, the lab is z up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.body.model import Body
from solver.body.skeleton import INDEX, JOINTS
from solver.rotations import exp_so3
from solver.synth.motion import Motion

LAB_FROM_REST = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""(3, 3) stands the rest body (y up, facing +z) up in the lab (z up), facing +x."""

_FIRST_STEP, _STEP, _SWING = 0.5, 0.56, 0.40  # s: when walking starts, step duration, time a foot is in the air
_STOP = 6.0  # s, no step begins later
_WALK = (0.5, 4.1)  # s
_SPEED = 0.95  # m/s
_LIFT = 0.09  # m, how high a long step lifts the ankle
_X, _Y, _Z = np.eye(3)


@dataclass(frozen=True)
class _Foot:
    """Where an ankle is (T, 3) m and how its foot stands: heading and pitch (toes down) (T,)."""

    ankle: np.ndarray
    heading: np.ndarray
    pitch: np.ndarray


def demo_motion(body: Body, betas: np.ndarray, *, seconds: float = 10.0, rate: float = 100.0, seed: int = 0) -> Motion:
    """Some ten seconds of walking, turning and bending, fitted to a body's proportions.

    Parameters
    ----------
    body, betas : whose legs reach the floor
    seconds : length; the plan is over after 10
    rate : Hz
    seed : of the small sway that makes no two sides and no two steps alike
    """
    time = np.arange(round(seconds * rate)) / rate
    rest = body.joints(betas)
    sole = float(body.surface(betas)[:, 1].min())
    rng = np.random.default_rng(seed)
    sway = _Sway(time, rng)

    feet = {side: _foot(time, side, rest, sole, sway) for side in ("left", "right")}
    stride, phase = _gait(time)
    pelvis = _pelvis_rotation(time, stride, phase, sway)
    position = _pelvis_position(time, pelvis, feet, rest, sway)

    local = np.tile(np.eye(3), (len(time), len(JOINTS), 1, 1))
    local[:, 0] = pelvis
    for side, foot in feet.items():
        _set_leg(local, side, rest, position, foot)
    _set_trunk(local, time, stride, phase, sway)
    for side in feet:
        _set_arm(local, side, time, stride, phase, sway)
    return Motion(local, position - rest[0], rate)


class _Sway:
    """Small slow wanderings, a new one at every call."""

    def __init__(self, time: np.ndarray, rng: np.random.Generator) -> None:
        self._time, self._rng = time, rng

    def __call__(self, size: float) -> np.ndarray:
        frequency, phase = self._rng.uniform(0.15, 0.9, 4), self._rng.uniform(0, 2 * np.pi, 4)
        waves = np.sin(2 * np.pi * frequency * self._time[:, None] + phase) * self._rng.uniform(0.3, 1, 4)
        return size * waves.sum(axis=1) / 2


def _ease(time: np.ndarray, start: float, stop: float) -> np.ndarray:
    """0 before ``start``, 1 after ``stop``, with least jerk between."""
    u = np.clip((time - start) / (stop - start), 0, 1)
    return u**3 * (10 - 15 * u + 6 * u**2)


def _hump(time: np.ndarray, up: tuple[float, float], down: tuple[float, float]) -> np.ndarray:
    return _ease(time, *up) - _ease(time, *down)


def _bend(time: np.ndarray) -> np.ndarray:
    """How far the person bends to the floor, 0..1."""
    return _hump(time, (6.2, 7.2), (7.7, 8.6))


def _reach(time: np.ndarray) -> np.ndarray:
    """How far the right arm is raised, 0..1."""
    return _hump(time, (8.3, 9.1), (9.2, 9.9))


def _heading(time: np.ndarray) -> np.ndarray:
    return 0.15 + 0.5 * _ease(time, 1.2, 3.8) - 1.75 * _ease(time, 3.6, 5.8)


def _ground_path(time: np.ndarray) -> np.ndarray:
    """(T, 2) m, where the pelvis is meant to be over the floor."""
    fine = np.arange(0, max(12.0, float(time.max()) + 1), 0.005)
    speed = _SPEED * _hump(fine, (_WALK[0], _WALK[0] + 1.0), (_WALK[1] - 1.0, _WALK[1]))
    heading = _heading(fine)
    steps = 0.005 * speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    path = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])[:-1] - np.array([1.2, 0.6])
    return np.stack([np.interp(time, fine, path[:, k]) for k in range(2)], axis=1)


def _gait(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How strong the stride is, 0..1, and its phase, rad, 0 where the left foot leaves the floor."""
    stride = _hump(time, (0.4, 1.2), (3.4, 4.2)) + 0.3 * _hump(time, (3.6, 4.2), (5.4, 6.2))
    return stride, np.pi * (time - _FIRST_STEP) / _STEP


def _turn(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotations about a fixed axis."""
    return exp_so3(np.asarray(angle)[:, None] * axis)


def _foot(time: np.ndarray, side: str, rest: np.ndarray, sole: float, sway: _Sway) -> _Foot:
    """The steps of one foot along the path: planted, rolled off its ball, swung, set down on its heel."""
    sign = 1.0 if side == "left" else -1.0
    ankle, toe = rest[INDEX[f"{side}_ankle"]], rest[INDEX[f"{side}_foot"]]
    width = abs(ankle[0]) * 0.75
    starts = np.arange(_FIRST_STEP + (0 if side == "left" else _STEP), _STOP, 2 * _STEP)

    def planted(moment: np.ndarray) -> np.ndarray:
        """(n, 3): the place over the floor and the heading of the foot beside the path at some moments."""
        heading = _heading(moment)
        out = sign * width * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        return np.column_stack([_ground_path(moment) + out, heading + sign * 0.08])

    places = np.concatenate([planted(np.zeros(1)), planted(starts + _SWING + 0.5 * (2 * _STEP - _SWING))])
    ground, lift, pitch = np.tile(places[0], (len(time), 1)), np.zeros(len(time)), np.zeros(len(time))
    for k, start in enumerate(starts):
        swing = _ease(time, start, start + _SWING)[:, None]
        ground += swing * (places[k + 1] - places[k])
        length = min(1.0, float(np.linalg.norm(places[k + 1, :2] - places[k, :2])) / 0.7)
        air = np.clip((time - start) / _SWING, 0, 1)
        lift += (0.4 + 0.6 * length) * _LIFT * 16 * air**2 * (1 - air) ** 2
        pitch += length * 0.62 * _hump(time, (start - 0.20, start + 0.04), (start + 0.04, start + 0.26))
        pitch -= length * 0.28 * _hump(time, (start + 0.16, start + _SWING), (start + _SWING, start + _SWING + 0.14))
    # The foot turns about its ball with the toes down, about its heel with them up.
    ball = np.array([toe[2] - ankle[2], 0.0, toe[1] - ankle[1] - 0.02])
    heel = np.array([-0.05, 0.0, sole - ankle[1]])
    pivot = np.where(pitch[:, None] > 0, ball, heel)
    rolled = pivot - np.einsum("tij,tj->ti", _turn(_Y, pitch), pivot)
    heading = ground[:, 2] + sway(0.01)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    place = ground[:, :2] + rolled[:, :1] * forward
    return _Foot(np.column_stack([place, ankle[1] - sole + lift + rolled[:, 2]]), heading, pitch)


def _pelvis_rotation(time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: _Sway) -> np.ndarray:
    heading = _turn(_Z, _heading(time) - 0.10 * stride * np.cos(phase) + sway(0.02))
    list_ = _turn(_X, -0.05 * stride * np.sin(phase) + sway(0.015))
    tilt = _turn(_Y, 0.06 + 0.05 * stride + 0.75 * _bend(time) + sway(0.015))
    return heading @ list_ @ tilt @ LAB_FROM_REST


def _pelvis_position(
    time: np.ndarray, pelvis: np.ndarray, feet: dict[str, _Foot], rest: np.ndarray, sway: _Sway
) -> np.ndarray:
    """Over its path, as high as the legs allow without quite straightening."""
    from scipy.ndimage import gaussian_filter1d

    rate = 1.0 / (time[1] - time[0])
    bend, heading = _bend(time), _heading(time)
    back = -0.12 * bend[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    ground = _ground_path(time) + back + np.stack([sway(0.012), sway(0.012)], axis=1)
    reach = []
    for side, foot in feet.items():
        hip, knee, ankle = (rest[INDEX[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        length = 0.994 * (np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
        offset = pelvis @ (hip - rest[0])
        apart = np.linalg.norm(ground + offset[:, :2] - foot.ankle[:, :2], axis=1)
        reach.append(foot.ankle[:, 2] + np.sqrt(np.maximum(length**2 - apart**2, 0.2)) - offset[:, 2])
    height = gaussian_filter1d(np.minimum(*reach), 0.09 * rate, mode="nearest") - 0.012 - 0.24 * bend
    return np.column_stack([ground, height])


def _set_leg(local: np.ndarray, side: str, rest: np.ndarray, pelvis_position: np.ndarray, foot: _Foot) -> None:
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
    turn_thigh = _frame(bent, hinge) @ _frame(rest[knee] - rest[hip], _X).T
    turn_shank = _frame(distance[:, None] * along - bent, hinge) @ _frame(rest[ankle] - rest[knee], _X).T
    turn_foot = _turn(_Z, foot.heading) @ _turn(_Y, foot.pitch) @ LAB_FROM_REST
    local[:, hip] = pelvis.swapaxes(1, 2) @ turn_thigh
    local[:, knee] = turn_thigh.swapaxes(1, 2) @ turn_shank
    local[:, ankle] = turn_shank.swapaxes(1, 2) @ turn_foot
    local[:, INDEX[f"{side}_foot"]] = _turn(_X, -0.8 * np.maximum(foot.pitch, 0))


def _frame(along: np.ndarray, hinge: np.ndarray) -> np.ndarray:
    """(..., 3, 3) columns: the hinge made square to the bone, the bone, and their cross product."""
    along = along / np.linalg.norm(along, axis=-1, keepdims=True)
    across = hinge - np.sum(hinge * along, axis=-1, keepdims=True) * along
    across = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([across, along, np.cross(across, along)], axis=-1)


def _set_trunk(local: np.ndarray, time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: _Sway) -> None:
    bend, reach = _bend(time), _reach(time)
    lead = -0.25 * _hump(time, (3.4, 4.2), (4.8, 5.8))  # head and shoulders turn first
    for name in ("spine1", "spine2", "spine3"):
        forward = -0.02 + 0.22 * bend - 0.03 * reach + sway(0.012)
        twist = 0.07 * stride * np.cos(phase) + 0.3 * lead - 0.09 * bend + sway(0.015)
        local[:, INDEX[name]] = _turn(_X, forward) @ _turn(_Y, twist) @ _turn(_Z, 0.04 * reach + sway(0.012))
    for name in ("neck", "head"):
        nod = 0.03 - 0.10 * bend - 0.10 * reach + sway(0.03)
        local[:, INDEX[name]] = _turn(_Y, 0.6 * lead + sway(0.06)) @ _turn(_X, nod) @ _turn(_Z, sway(0.02))


def _set_arm(
    local: np.ndarray, side: str, time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: _Sway
) -> None:
    """An arm that swings against its leg; the right one picks something up and lifts it."""
    sign = 1.0 if side == "left" else -1.0
    bend, reach = _bend(time), _reach(time) * (side == "right")
    picks = 1.0 if side == "right" else 0.55
    swing = 0.06 - sign * 0.38 * stride * np.sin(phase + 0.25)
    flexion = swing + picks * 1.35 * bend + 2.3 * reach + sway(0.03)
    abduction = 0.14 + 0.10 * bend + 0.25 * reach + sway(0.03)
    rotation = 0.25 + 0.3 * reach + sway(0.05)
    elbow = 0.28 - sign * 0.16 * stride * np.sin(phase + 0.25) + (1 - picks) * 1.2 * bend + 0.5 * reach + sway(0.04)
    hang = _turn(_Z, -sign * (np.pi / 2 - abduction))
    raise_ = 0.12 * np.maximum(flexion, 0)
    local[:, INDEX[f"{side}_collar"]] = _turn(_Z, sign * (raise_ - 0.03 + sway(0.01))) @ _turn(_Y, -sign * 0.3 * raise_)
    local[:, INDEX[f"{side}_shoulder"]] = _turn(_X, -0.9 * flexion) @ hang @ _turn(_X, -rotation)
    local[:, INDEX[f"{side}_elbow"]] = _turn(_Y, -sign * np.maximum(elbow, 0.05)) @ _turn(_X, 0.3 + sway(0.06))
    local[:, INDEX[f"{side}_wrist"]] = _turn(_Z, sway(0.06)) @ _turn(_Y, -sign * (0.05 + sway(0.05)))
