"""Motion through random poses: every joint within its limits, arms, legs and trunk moving together as people do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.rig import LAB_FROM_REST, turn

_X, _Y, _Z = np.eye(3)
_PAUSE = (0.25, 1.2)  # s between two poses
_ALIKE = (0.35, 0.25)  # chance that a moment's sides are alike, or take turns


@dataclass(frozen=True)
class _Range:
    """Rad: least, usual and most; ``usual`` is where half of the poses are on either side."""

    least: float
    usual: float
    most: float

    def at(self, z: np.ndarray) -> np.ndarray:
        """Values of standard normal numbers: two of them reach the limits nearly."""
        share = np.tanh(0.6 * z)
        return self.usual + np.where(share > 0, (self.most - self.usual) * share, (self.usual - self.least) * share)


_TRUNK = {
    "lean": _Range(-0.5, 0.1, 1.2),
    "list": _Range(-0.35, 0.0, 0.35),
    "turn": _Range(-3.1, 0.0, 3.1),
    "bend": _Range(-0.5, 0.1, 1.1),
    "side": _Range(-0.55, 0.0, 0.55),
    "twist": _Range(-0.8, 0.0, 0.8),
    "nod": _Range(-0.8, 0.0, 0.8),
    "look": _Range(-1.2, 0.0, 1.2),
    "tilt": _Range(-0.5, 0.0, 0.5),
}
_SIDED = {
    "shrug": _Range(-0.2, 0.0, 0.5),
    "protract": _Range(-0.35, 0.0, 0.35),
    "raise": _Range(-0.9, 0.35, 2.9),
    "out": _Range(-0.5, 0.3, 2.7),
    "in": _Range(-1.3, 0.1, 1.3),
    "elbow": _Range(0.0, 0.7, 2.5),
    "pronate": _Range(-1.2, 0.2, 1.2),
    "wrist": _Range(-1.1, 0.0, 1.1),
    "deviate": _Range(-0.5, 0.0, 0.4),
    "curl": _Range(-0.2, 0.4, 1.5),
    "hip": _Range(-0.5, 0.25, 2.1),
    "abduct": _Range(-0.35, 0.05, 0.9),
    "rotate": _Range(-0.6, 0.0, 0.6),
    "knee": _Range(0.0, 0.4, 2.5),
    "ankle": _Range(-0.45, 0.0, 0.8),
    "invert": _Range(-0.35, 0.0, 0.35),
    "point": _Range(-0.3, 0.0, 0.3),
    "toes": _Range(-0.9, 0.0, 0.3),
}
_FOLLOWS = {"knee": ("hip", 0.6), "elbow": ("raise", 0.3), "shrug": ("out", 0.5), "bend": ("lean", 0.6)}
"""Channels that go with another, and how much: a lifted thigh bends the knee."""


def free_motion(seconds: float, rate: float, rng: np.random.Generator) -> Motion:
    """Smoothly from one random pose to the next, lively or calm as the generator draws.

    Parameters
    ----------
    seconds, rate : s and Hz
    """
    from scipy.interpolate import PchipInterpolator

    frames = max(2, round(seconds * rate))
    time = np.arange(frames) / rate
    moments = np.concatenate([[-1.0], np.cumsum(rng.uniform(*_PAUSE, int(seconds / _PAUSE[0]) + 4)) - 0.5])
    liveliness = rng.uniform(0.35, 1.15)
    count = len(moments)
    # Each pose keeps something of the one before: people do not move all joints at once.
    kept = rng.uniform(0.0, 0.6)

    def wander() -> np.ndarray:
        z = rng.normal(size=count)
        for k in range(1, count):
            z[k] = kept * z[k - 1] + np.sqrt(1 - kept**2) * z[k]
        return liveliness * z

    z: dict[str, np.ndarray] = {name: wander() for name in _TRUNK}
    alike = rng.random(count)
    sign = np.where(alike < _ALIKE[0], 1.0, -1.0)
    bound = alike < sum(_ALIKE)
    for name in _SIDED:
        left, right = wander(), wander()
        z[f"left_{name}"], z[f"right_{name}"] = left, np.where(bound, sign * 0.95 * left + 0.3 * right, right)
    for name, (leader, share) in _FOLLOWS.items():
        for side in ("left_", "right_") if name in _SIDED else ("",):
            z[side + name] = share * z[side + leader] + np.sqrt(1 - share**2) * z[side + name]
    value = {}
    for name, numbers in z.items():
        limits = _TRUNK[name] if name in _TRUNK else _SIDED[name.partition("_")[2]]
        value[name] = PchipInterpolator(moments, limits.at(numbers))(time)
    local = _local(value, frames)
    walk = np.cumsum(rng.normal(0, 0.02 / np.sqrt(rate), (frames, 2)), axis=0)
    return Motion(local, np.column_stack([walk, np.full(frames, 0.95)]), rate)


def _local(value: dict[str, np.ndarray], frames: int) -> np.ndarray:
    """(T, 24, 3, 3) from the channels, (T,) rad each."""
    local = np.tile(np.eye(3), (frames, len(JOINTS), 1, 1))
    local[:, 0] = turn(_Z, value["turn"]) @ turn(_X, value["list"]) @ turn(_Y, value["lean"]) @ LAB_FROM_REST
    for name in ("spine1", "spine2", "spine3"):
        local[:, INDEX[name]] = (
            turn(_X, value["bend"] / 3) @ turn(_Y, value["twist"] / 3) @ turn(_Z, -value["side"] / 3)
        )
    for name in ("neck", "head"):
        local[:, INDEX[name]] = turn(_Y, value["look"] / 2) @ turn(_X, value["nod"] / 2) @ turn(_Z, -value["tilt"] / 2)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        own = {name: value[f"{side}_{name}"] for name in _SIDED}
        local[:, INDEX[f"{side}_collar"]] = turn(_Z, sign * own["shrug"]) @ turn(_Y, -sign * own["protract"])
        hang = turn(_Z, -sign * (np.pi / 2 - own["out"]))
        local[:, INDEX[f"{side}_shoulder"]] = turn(_X, -own["raise"]) @ hang @ turn(_X, -own["in"])
        local[:, INDEX[f"{side}_elbow"]] = turn(_Y, -sign * own["elbow"]) @ turn(_X, own["pronate"])
        local[:, INDEX[f"{side}_wrist"]] = turn(_Z, -sign * own["wrist"]) @ turn(_Y, -sign * own["deviate"])
        local[:, INDEX[f"{side}_hand"]] = turn(_Z, -sign * own["curl"])
        local[:, INDEX[f"{side}_hip"]] = (
            turn(_X, -own["hip"]) @ turn(_Z, sign * own["abduct"]) @ turn(_Y, -sign * own["rotate"])
        )
        local[:, INDEX[f"{side}_knee"]] = turn(_X, own["knee"])
        local[:, INDEX[f"{side}_ankle"]] = (
            turn(_X, own["ankle"]) @ turn(_Z, sign * own["invert"]) @ turn(_Y, sign * own["point"])
        )
        local[:, INDEX[f"{side}_foot"]] = turn(_X, own["toes"])
    return local
