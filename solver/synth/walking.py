"""Walking in a wide arc, for as long as is wanted."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.synth.choreography import Course, embodied
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.rig import Steps, Sway, ease, stepping_foot

_FIRST, _STEP, _SWING = 0.5, 0.56, 0.40  # s, as in ``rig.Steps``
_SPEED, _RADIUS = (0.7, 1.0), (1.6, 2.4)  # m/s, m


def walk(body: Body, betas: np.ndarray, *, seconds: float, rate: float, rng: np.random.Generator) -> Motion:
    """Walk along a circle, to the left or to the right, from a standing start.

    Parameters
    ----------
    body, betas : whose legs reach the floor
    rate : Hz
    rng : draws the circle, the speed, and the sway that makes no two steps alike
    """
    time = np.arange(round(seconds * rate)) / rate
    speed, radius = rng.uniform(*_SPEED), rng.uniform(*_RADIUS) * rng.choice([-1, 1])
    start = rng.uniform(-np.pi, np.pi)

    def heading(moment: np.ndarray) -> np.ndarray:
        """Rad; the way walked, with a start that takes 1.2 s, over the radius."""
        gone = speed * np.where(moment < 1.7, 0.6 * ease(moment, 0.5, 1.7), moment - 1.1)
        angle: np.ndarray = start + gone / radius
        return angle

    def ground(moment: np.ndarray) -> np.ndarray:
        angle = heading(moment)
        return radius * np.stack([np.sin(angle), -np.cos(angle)], axis=1)

    rest, sway = body.joints(betas), Sway(time, rng)
    sole = float(body.surface(betas)[:, 1].min())
    plan = Steps(_FIRST, _STEP, _SWING, seconds + 2, heading, ground)
    feet = {side: stepping_foot(time, side, rest, sole, sway, plan) for side in ("left", "right")}
    stride, phase = ease(time, 0.4, 1.4), np.pi * (time - _FIRST) / _STEP
    beat, swing = stride * np.cos(phase), stride * np.sin(phase + 0.25)
    course = Course(
        {
            "turn": -0.10 * beat,
            "list": -0.05 * stride * np.sin(phase),
            "lean": 0.05 * stride,
            "twist": 0.21 * beat,
            "left_raise": -0.38 * swing,
            "right_raise": 0.38 * swing,
            "left_elbow": 0.1 - 0.16 * swing,
            "right_elbow": 0.1 + 0.16 * swing,
        },
        len(time),
    )
    return embodied(course, feet, ground(time), heading(time), rest, rate, sway)
