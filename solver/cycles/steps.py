"""Steps in space and time, cycle by cycle, each figure with its definition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from markerscope.solver.cycles.curve import Scalar
from markerscope.solver.cycles.cycle import Cycle
from markerscope.solver.events.feet import Feet

DEFINITIONS = {
    "stride time": ("s", "from a strike of the foot to its next strike"),
    "step time": ("s", "from the other foot's strike to this foot's next strike"),
    "cadence": ("steps/min", "two steps in a stride time: 120 / stride time"),
    "stance": ("%", "strike to off of the same foot, in percent of the stride time"),
    "swing": ("%", "off to the next strike, in percent of the stride time"),
    "double support": (
        "%",
        "both feet on the ground: strike to the other foot's off, and the other foot's strike to off",
    ),
    "single support": ("%", "the other foot's off to its strike, in percent of the stride time"),
    "stride length": ("m", "distance of the heel between two strikes of the foot, on the floor"),
    "step length": (
        "m",
        "this heel ahead of the other one at this foot's next strike, along the direction of progression there",
    ),
    "step width": ("m", "between the two heels at that strike, across the direction of progression"),
    "walking speed": ("m/s", "stride length over stride time"),
}
"""Unit and definition of each figure. On a treadmill the feet do not travel, and lengths and speed are not known."""

_TRAVELS_M_S = 0.15


def step_table(trial: str, feet: Feet, cycles: Sequence[Cycle], ahead: np.ndarray) -> tuple[Scalar, ...]:
    """The figures of every gait cycle used.

    Parameters
    ----------
    feet : where heels and pelvis are
    ahead : (T, 2) the direction of progression
    """
    rows: list[Scalar] = []
    for cycle in cycles:
        if not cycle.used or cycle.side not in ("left", "right"):
            continue
        values = {**_times(cycle), **_lengths(cycle, feet, ahead)}
        rows += [
            Scalar(trial, cycle.name, cycle.side, quantity, DEFINITIONS[quantity][0], float(value))
            for quantity, value in values.items()
        ]
    return tuple(rows)


def _times(cycle: Cycle) -> dict[str, float]:
    stride = cycle.end - cycle.start
    stance = 100 * (cycle.off - cycle.start) / stride
    single = 100 * (cycle.other_strike - cycle.other_off) / stride
    first = 100 * (cycle.other_off - cycle.start) / stride
    second = 100 * (cycle.off - cycle.other_strike) / stride
    walks = cycle.other_off < cycle.other_strike  # one who runs has the other foot strike after this one's off
    return {
        "stride time": stride,
        "step time": cycle.end - cycle.other_strike,
        "cadence": 120 / stride,
        "stance": stance,
        "swing": 100 - stance,
        "double support": max(first, 0.0) + max(second, 0.0) if walks else float("nan"),
        "single support": single if walks else float("nan"),
    }


def _lengths(cycle: Cycle, feet: Feet, ahead: np.ndarray) -> dict[str, float]:
    none = dict.fromkeys(("stride length", "step length", "step width", "walking speed"), float("nan"))
    other = feet.sides.get("right" if cycle.side == "left" else "left")
    own = feet.sides.get(cycle.side)
    if own is None:
        return none

    def at(points: np.ndarray, time: float) -> np.ndarray:
        return np.array([np.interp(time, feet.time, points[:, k]) for k in range(2)])

    stride_time = cycle.end - cycle.start
    way = at(feet.pelvis, cycle.end) - at(feet.pelvis, cycle.start)
    travel = float(np.linalg.norm(way))
    travels = travel / stride_time > _TRAVELS_M_S
    # A step is measured where it ends, so that in a curve both feet are measured alike.
    direction = at(ahead, cycle.end)
    direction = direction / max(float(np.linalg.norm(direction)), 1e-12)
    across = np.array([-direction[1], direction[0]])
    stride = float(np.linalg.norm(at(own.heel, cycle.end) - at(own.heel, cycle.start))) if travels else float("nan")
    found = {"stride length": stride, "walking speed": stride / stride_time}
    if other is None or not np.isfinite(cycle.other_strike):
        return none | found
    gap = at(own.heel, cycle.end) - at(other.heel, cycle.end)
    sign = 1 if cycle.side == "left" else -1
    found["step length"] = float(gap @ direction) if travels else float("nan")
    found["step width"] = float(sign * gap @ across)
    return none | found
