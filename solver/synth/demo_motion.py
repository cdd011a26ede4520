"""A motion of the project's own: a person who walks, turns, bends to the floor and raises an arm.

The pelvis follows a planned path, the feet step along it and stay planted between steps, legs follow by inverse
kinematics, trunk and arms by their swing. Angles are in rad, times in s, the lab is z up.
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.rig import (
    LAB_FROM_REST,
    Foot,
    Steps,
    Sway,
    ease,
    hump,
    set_leg,
    standing_height,
    stepping_foot,
    turn,
)

_FIRST_STEP, _STEP, _SWING = 0.5, 0.56, 0.40  # s: when walking starts, step duration, time a foot is in the air
_STOP = 6.0  # s, no step begins later
_WALK = (0.5, 4.1)  # s
_SPEED = 0.95  # m/s
_X, _Y, _Z = np.eye(3)


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
    sway = Sway(time, rng)

    plan = Steps(_FIRST_STEP, _STEP, _SWING, _STOP, _heading, _ground_path)
    feet = {side: stepping_foot(time, side, rest, sole, sway, plan) for side in ("left", "right")}
    stride, phase = _gait(time)
    pelvis = _pelvis_rotation(time, stride, phase, sway)
    position = _pelvis_position(time, pelvis, feet, rest, sway)

    local = np.tile(np.eye(3), (len(time), len(JOINTS), 1, 1))
    local[:, 0] = pelvis
    for side, foot in feet.items():
        set_leg(local, side, rest, position, foot)
    _set_trunk(local, time, stride, phase, sway)
    for side in feet:
        _set_arm(local, side, time, stride, phase, sway)
    return Motion(local, position - rest[0], rate)


def _bend(time: np.ndarray) -> np.ndarray:
    """How far the person bends to the floor, 0..1."""
    return hump(time, (6.2, 7.2), (7.7, 8.6))


def _reach(time: np.ndarray) -> np.ndarray:
    """How far the right arm is raised, 0..1."""
    return hump(time, (8.3, 9.1), (9.2, 9.9))


def _heading(time: np.ndarray) -> np.ndarray:
    return 0.15 + 0.5 * ease(time, 1.2, 3.8) - 1.75 * ease(time, 3.6, 5.8)


def _ground_path(time: np.ndarray) -> np.ndarray:
    """(T, 2) m, where the pelvis is meant to be over the floor."""
    fine = np.arange(0, max(12.0, float(time.max()) + 1), 0.005)
    speed = _SPEED * hump(fine, (_WALK[0], _WALK[0] + 1.0), (_WALK[1] - 1.0, _WALK[1]))
    heading = _heading(fine)
    steps = 0.005 * speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    path = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])[:-1] - np.array([1.2, 0.6])
    return np.stack([np.interp(time, fine, path[:, k]) for k in range(2)], axis=1)


def _gait(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How strong the stride is, 0..1, and its phase, rad, 0 where the left foot leaves the floor."""
    stride = hump(time, (0.4, 1.2), (3.4, 4.2)) + 0.3 * hump(time, (3.6, 4.2), (5.4, 6.2))
    return stride, np.pi * (time - _FIRST_STEP) / _STEP


def _pelvis_rotation(time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: Sway) -> np.ndarray:
    heading = turn(_Z, _heading(time) - 0.10 * stride * np.cos(phase) + sway(0.02))
    list_ = turn(_X, -0.05 * stride * np.sin(phase) + sway(0.015))
    tilt = turn(_Y, 0.06 + 0.05 * stride + 0.75 * _bend(time) + sway(0.015))
    return heading @ list_ @ tilt @ LAB_FROM_REST


def _pelvis_position(
    time: np.ndarray, pelvis: np.ndarray, feet: dict[str, Foot], rest: np.ndarray, sway: Sway
) -> np.ndarray:
    bend, heading = _bend(time), _heading(time)
    back = -0.12 * bend[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    ground = _ground_path(time) + back + np.stack([sway(0.012), sway(0.012)], axis=1)
    height = standing_height(ground, pelvis, feet, rest, 1.0 / (time[1] - time[0])) - 0.24 * bend
    return np.column_stack([ground, height])


def _set_trunk(local: np.ndarray, time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: Sway) -> None:
    bend, reach = _bend(time), _reach(time)
    lead = -0.25 * hump(time, (3.4, 4.2), (4.8, 5.8))  # head and shoulders turn first
    for name in ("spine1", "spine2", "spine3"):
        forward = -0.02 + 0.22 * bend - 0.03 * reach + sway(0.012)
        twist = 0.07 * stride * np.cos(phase) + 0.3 * lead - 0.09 * bend + sway(0.015)
        local[:, INDEX[name]] = turn(_X, forward) @ turn(_Y, twist) @ turn(_Z, 0.04 * reach + sway(0.012))
    for name in ("neck", "head"):
        nod = 0.03 - 0.10 * bend - 0.10 * reach + sway(0.03)
        local[:, INDEX[name]] = turn(_Y, 0.6 * lead + sway(0.06)) @ turn(_X, nod) @ turn(_Z, sway(0.02))


def _set_arm(local: np.ndarray, side: str, time: np.ndarray, stride: np.ndarray, phase: np.ndarray, sway: Sway) -> None:
    """An arm that swings against its leg; the right one picks something up and lifts it."""
    sign = 1.0 if side == "left" else -1.0
    bend, reach = _bend(time), _reach(time) * (side == "right")
    picks = 1.0 if side == "right" else 0.55
    swing = 0.06 - sign * 0.38 * stride * np.sin(phase + 0.25)
    flexion = swing + picks * 1.35 * bend + 2.3 * reach + sway(0.03)
    abduction = 0.14 + 0.10 * bend + 0.25 * reach + sway(0.03)
    rotation = 0.25 + 0.3 * reach + sway(0.05)
    elbow = 0.28 - sign * 0.16 * stride * np.sin(phase + 0.25) + (1 - picks) * 1.2 * bend + 0.5 * reach + sway(0.04)
    hang = turn(_Z, -sign * (np.pi / 2 - abduction))
    raise_ = 0.12 * np.maximum(flexion, 0)
    local[:, INDEX[f"{side}_collar"]] = turn(_Z, sign * (raise_ - 0.03 + sway(0.01))) @ turn(_Y, -sign * 0.3 * raise_)
    local[:, INDEX[f"{side}_shoulder"]] = turn(_X, -0.9 * flexion) @ hang @ turn(_X, -rotation)
    local[:, INDEX[f"{side}_elbow"]] = turn(_Y, -sign * np.maximum(elbow, 0.05)) @ turn(_X, 0.3 + sway(0.06))
    local[:, INDEX[f"{side}_wrist"]] = turn(_Z, sway(0.06)) @ turn(_Y, -sign * (0.05 + sway(0.05)))
