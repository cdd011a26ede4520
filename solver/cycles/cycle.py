"""Cycles: from one foot strike to the next of the same foot, or one repetition, and what speaks against using one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.events.event import OFF, STRIKE, Event, times_of

POINTS = 101
"""Values of a cycle: 0 to 100 percent."""
_SHORTEST_S, _LONGEST_S = 0.3, 3.0
_MOST_LOST = 0.1
_OTHER = {"left": "right", "right": "left"}


@dataclass(frozen=True)
class Cycle:
    """One cycle of one side.

    Attributes
    ----------
    side : left, right; general for repetitions
    number : from 1, over the cycles of this side in this trial
    start, end : s
    off : s, foot off between; NaN where there is none
    other_strike, other_off : s, of the other foot between; NaN where there is none
    why_not : why it is left out, "" where it is used
    """

    side: str
    number: int
    start: float
    end: float
    off: float = float("nan")
    other_strike: float = float("nan")
    other_off: float = float("nan")
    why_not: str = ""

    @property
    def used(self) -> bool:
        """Whether it counts."""
        return not self.why_not

    @property
    def name(self) -> str:
        """``left 2``."""
        return f"{self.side} {self.number}"

    def percent(self, time: float) -> float:
        """A time as percent of the cycle."""
        return 100 * (time - self.start) / (self.end - self.start)


def gait_cycles(events: Iterable[Event]) -> tuple[Cycle, ...]:
    """Cycles of both feet, by side and time; one that lasts no plausible time, or has two offs, says so."""
    events = tuple(events)
    found = []
    for side in ("left", "right"):
        strikes, offs = times_of(events, side, STRIKE), times_of(events, side, OFF)
        others = times_of(events, _OTHER[side], STRIKE), times_of(events, _OTHER[side], OFF)
        for number, (start, end) in enumerate(pairwise(strikes), 1):
            within = offs[(offs > start) & (offs < end)]
            other_strike, other_off = (_only(times, start, end) for times in others)
            why = ""
            if not _SHORTEST_S <= end - start <= _LONGEST_S:
                why = f"it lasts {end - start:.2f} s"
            elif len(within) > 1:
                why = f"the {side} foot leaves the ground {len(within)} times in it"
            off = float(within[0]) if len(within) == 1 else float("nan")
            found.append(Cycle(side, number, float(start), float(end), off, other_strike, other_off, why))
    return tuple(found)


def repetition_cycles(events: Iterable[Event]) -> tuple[Cycle, ...]:
    """A cycle for each repetition, from its start to its end; its turn stands where a step has its off.

    Raises
    ------
    InputError : a start without an end
    """
    events = tuple(events)
    starts, turns, ends = (times_of(events, "general", kind) for kind in ("start", "turn", "end"))
    if len(starts) != len(ends) or any(ends <= starts) or any(ends[:-1] > starts[1:]):
        raise InputError("starts and ends of repetitions do not come in turns", "events", "put them in order")
    return tuple(
        Cycle("general", number, float(start), float(end), _only(turns, start, end))
        for number, (start, end) in enumerate(zip(starts, ends), 1)
    )


def _only(times: np.ndarray, start: float, end: float) -> float:
    within = times[(times > start) & (times < end)]
    return float(within[0]) if len(within) == 1 else float("nan")


def left_out(cycles: Sequence[Cycle], reasons: Mapping[str, str], where: str) -> tuple[Cycle, ...]:
    """The cycles, some of them left out by hand.

    Parameters
    ----------
    reasons : by the cycle's name (``left 2``)

    Raises
    ------
    InputError : there is no such cycle, or no reason was given
    """
    names = {cycle.name for cycle in cycles}
    for name, reason in reasons.items():
        if name not in names:
            there = ", ".join(sorted(names)) or "none"
            raise InputError(f"there is no cycle {name!r} to leave out", where, f"there are: {there}")
        if not reason.strip():
            raise InputError(f"no reason was given for leaving out {name!r}", where, f'say "{name}: why"')
    return tuple(replace(c, why_not=c.why_not or reasons[c.name]) if c.name in reasons else c for c in cycles)


def judged(cycles: Sequence[Cycle], time: np.ndarray, present: np.ndarray) -> tuple[Cycle, ...]:
    """The cycles, those left out of which too much is not known.

    Parameters
    ----------
    time : (T,) s
    present : (T, ...) True where what the cycles are about is known
    """
    known = present.reshape(len(time), -1)
    out = []
    for cycle in cycles:
        within = (time >= cycle.start - 1e-9) & (time <= cycle.end + 1e-9)
        lost = 1 - known[within].mean(axis=0) if within.any() else np.ones(known.shape[1])
        if cycle.used and (not within.any() or cycle.start < time[0] - 1e-6 or cycle.end > time[-1] + 1e-6):
            cycle = replace(cycle, why_not="it reaches beyond what was recorded")
        elif cycle.used and lost.size and np.median(lost) > _MOST_LOST:
            cycle = replace(cycle, why_not=f"{100 * np.median(lost):.0f} % of it are lost")
        out.append(cycle)
    return tuple(out)


def cut(time: np.ndarray, values: np.ndarray, cycle: Cycle, longest_gap: float = 0.1) -> np.ndarray:
    """(101, ...) values over a cycle, by cubic interpolation; NaN in gaps longer than so many s, and beyond the ends.

    Parameters
    ----------
    time : (T,) s, rising
    values : (T, ...)
    """
    from scipy.interpolate import CubicSpline

    wanted = np.linspace(cycle.start, cycle.end, POINTS)
    flat = values.reshape(len(values), -1)
    out = np.full((POINTS, flat.shape[1]), np.nan)
    step = float(np.median(np.diff(time)))
    finite = np.isfinite(flat)
    for good in np.unique(finite, axis=1).T:  # columns that are known in the same frames
        columns = (finite == good[:, None]).all(axis=0)
        near = good & (time >= cycle.start - 1.0) & (time <= cycle.end + 1.0)
        if near.sum() < 4:
            continue
        t = time[near]
        right = np.clip(np.searchsorted(t, wanted), 1, len(t) - 1)
        whole = (t[right] - t[right - 1] <= max(longest_gap, 1.5 * step)) & (wanted >= t[0] - 1e-6)
        whole &= wanted <= t[-1] + 1e-6
        out[np.ix_(whole, columns)] = CubicSpline(t, flat[near][:, columns])(wanted[whole])
    return out.reshape(POINTS, *values.shape[1:])
