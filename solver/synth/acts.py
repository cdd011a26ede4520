"""Motions of the project's own, by name: what a session can be made from where there is no recording."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.synth.choreography import Key, mirrored, perform
from markerscope.solver.synth.demo_motion import demo_motion
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.walking import walk


def _both(pose: dict[str, float]) -> dict[str, float]:
    """The same for either arm or foot: ``arm_`` and ``foot_`` stand for left and right."""
    found: dict[str, float] = {}
    for name, value in pose.items():
        limb, _, rest = name.partition("_")
        if limb in ("arm", "foot"):
            found |= {f"left_{rest}": value, f"right_{rest}": value}
        else:
            found[name] = value
    return found


_SQUAT = (
    Key(0, {}),
    Key(1.2, _both({"down": 0.40, "lean": 0.45, "forward": -0.10, "bend": 0.5, "arm_raise": 1.3, "nod": -0.5})),
    Key(1.7, _both({"down": 0.42, "lean": 0.50, "forward": -0.11, "bend": 0.5, "arm_raise": 1.5, "nod": -0.5})),
    Key(2.9, {"right_raise": 0.2, "side": 0.1}),
    Key(3.2, {}),
)
_REACH = (
    Key(0, {}),
    Key(1.0, {"right_raise": 2.7, "right_elbow": 0.1, "side": -0.25, "bend": -0.2, "nod": -0.5, "down": -0.0}),
    Key(1.5, {"right_raise": 2.9, "right_elbow": 0.0, "side": -0.3, "bend": -0.25, "nod": -0.6, "left_out": 0.3}),
    Key(2.5, {"right_raise": 1.5, "right_out": -0.4, "twist": 0.9, "turn": 0.25, "look": 0.9, "left": 0.05}),
    Key(3.5, {"right_raise": 1.2, "right_out": 0.9, "twist": -0.8, "turn": -0.2, "look": -0.8, "left": -0.05}),
    Key(
        4.7,
        {"right_raise": 1.4, "bend": 1.1, "lean": 0.6, "down": 0.25, "forward": -0.1, "twist": 0.3, "left_raise": 0.4},
    ),
    Key(6.0, {}),
)
_LUNGE = (
    Key(0, {}),
    Key(0.35, {"right_step": 0.35, "right_lift": 0.13, "forward": 0.10, "left_raise": 0.5, "right_elbow": 0.8}),
    Key(0.75, {"right_step": 0.62, "forward": 0.30, "down": 0.05, "left_raise": 0.9, "left_elbow": 1.0,
               "left_point": 0.25}),
    Key(1.3, {"right_step": 0.62, "forward": 0.36, "down": 0.26, "lean": 0.15, "left_raise": 1.1, "right_elbow": 1.3,
              "left_elbow": 1.2, "right_raise": -0.4, "twist": -0.5, "left_point": 0.6}),
    Key(1.8, {"right_step": 0.62, "forward": 0.28, "down": 0.08, "left_raise": 0.7, "left_point": 0.25}),
    Key(2.2, {"right_step": 0.35, "right_lift": 0.12, "forward": 0.08, "twist": 0.2}),
    Key(2.6, {}),
    Key(3.0, {}),
)  # fmt: skip
_JACK = (
    Key(0, {}),
    Key(0.25, _both({"down": 0.10, "lean": 0.12, "arm_out": 0.2, "arm_elbow": 0.3, "bend": 0.25})),
    Key(0.50, _both({"foot_wide": 0.12, "foot_lift": 0.10, "foot_point": 0.35, "arm_out": 1.2})),
    Key(0.75, _both({"foot_wide": 0.24, "down": 0.08, "arm_out": 2.5, "arm_elbow": 0.3, "lean": 0.1, "bend": -0.15})),
    Key(1.00, _both({"foot_wide": 0.12, "foot_lift": 0.10, "foot_point": 0.35, "arm_out": 1.2})),
    Key(1.25, _both({"down": 0.08, "lean": 0.1, "arm_out": 0.1, "bend": 0.2})),
    Key(1.40, {}),
)
_KICK = (
    Key(0, {}),
    Key(0.5, {"left": 0.10, "right_step": -0.30, "right_lift": 0.15, "right_point": 0.5, "left_raise": 0.7,
              "lean": 0.1}),
    Key(0.9, {"left": 0.11, "right_step": 0.62, "right_lift": 0.55, "right_point": 0.2, "lean": -0.15, "bend": 0.35,
              "right_raise": 0.8, "right_out": 0.5, "left_raise": -0.3, "left_out": 0.8, "twist": 0.4}),
    Key(1.4, {"left": 0.10, "right_step": 0.15, "right_lift": 0.25, "left_out": 0.5, "right_out": 0.4}),
    Key(1.9, {}),
    Key(2.4, {}),
)  # fmt: skip
_THROW = (
    Key(0, {}),
    Key(0.9, {"right_raise": 0.3, "right_out": 1.4, "right_in": -1.2, "right_elbow": 1.4, "twist": -0.8, "turn": -0.4,
              "left_raise": 1.2, "look": 0.7, "forward": -0.08, "down": 0.05, "left_step": 0.3, "left_lift": 0.1}),
    Key(1.25, {"right_raise": 1.6, "right_out": 0.5, "right_in": 0.3, "right_elbow": 0.2, "twist": 0.6, "turn": 0.3,
               "left_raise": 0.2, "left_elbow": 1.0, "forward": 0.18, "down": 0.08, "bend": 0.4, "left_step": 0.4}),
    Key(1.7, {"right_raise": 0.6, "right_out": -0.3, "right_elbow": 0.4, "twist": 0.9, "turn": 0.35, "bend": 0.8,
              "lean": 0.3, "forward": 0.2, "down": 0.1, "left_step": 0.4, "look": -0.5}),
    Key(2.4, {"left_step": 0.2, "left_lift": 0.08, "forward": 0.08}),
    Key(2.8, {}),
    Key(3.2, {}),
)  # fmt: skip
_MARCH = (
    Key(0, {}),
    Key(0.45, {"right_lift": 0.36, "right_step": 0.14, "right_point": 0.3, "left": 0.05, "left_raise": 0.9,
               "left_elbow": 1.0, "right_raise": -0.5, "right_elbow": 0.5, "twist": -0.25, "look": 0.3}),
    Key(0.9, {}),
)  # fmt: skip

ACTS = ("walk", "squat", "reach", "lunge", "jacks", "kick", "throw", "march", "tour")
"""Names of what can be performed; ``tour`` is the motion of the embedded session."""
_CYCLES = {
    "squat": (_SQUAT,),
    "reach": (_REACH, mirrored(_REACH)),
    "lunge": (_LUNGE, mirrored(_LUNGE)),
    "jacks": (_JACK,),
    "kick": (_KICK, mirrored(_KICK)),
    "throw": (_THROW, mirrored(_THROW)),
    "march": (_MARCH, mirrored(_MARCH)),
}


def act(name: str, body: Body, betas: np.ndarray, *, seconds: float, rate: float, rng: np.random.Generator) -> Motion:
    """Perform one of ``ACTS`` for so long (the tour at most ten seconds), fitted to a body's proportions.

    Parameters
    ----------
    rate : Hz
    rng : draws where the person stands and looks, and makes no two repetitions alike
    """
    if name == "tour":
        return demo_motion(body, betas, seconds=min(seconds, 10.0), rate=rate, seed=int(rng.integers(2**31)))
    if name == "walk":
        return walk(body, betas, seconds=seconds, rate=rate, rng=rng)
    if name not in _CYCLES:
        raise InputError(f'"{name}" is neither a motion file nor a known motion', None, f"use one of {', '.join(ACTS)}")
    return perform(_CYCLES[name], body, betas, seconds=seconds, rate=rate, rng=rng)
