"""Repetitions of a movement, by a trigger with two thresholds on an angle (Schmitt 1938).

The ends of a repetition are times at which the angle passes a threshold, where it moves; the extremes of an angle while
somebody sits or stands are nowhere in particular.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.events.event import Event, Kind
from markerscope.solver.filters.smooth import Filter, smooth


@dataclass(frozen=True)
class RepetitionSettings:
    """How repetitions are told.

    Attributes
    ----------
    low, high : shares of the angle's usual range (its 5th to 95th percentile) that a repetition passes
    cutoff : Hz, of the Butterworth filter before
    least : degrees that the usual range has at least
    """

    low: float = 0.3
    high: float = 0.7
    cutoff: float = 3.0
    least: float = 10.0


@dataclass(frozen=True)
class Repetition:
    """One repetition: away from where the trial began, and back.

    Attributes
    ----------
    start, end : s, when the angle leaves and comes back past the threshold nearer to where it rests
    turn : s, the middle of the time beyond the other threshold
    """

    start: float
    turn: float
    end: float


DEFAULT = RepetitionSettings()


def find_repetitions(
    time: np.ndarray, degrees: np.ndarray, settings: RepetitionSettings = DEFAULT
) -> tuple[Repetition, ...]:
    """Whole repetitions, in order; one that the recording cuts off is none.

    Parameters
    ----------
    time : (T,) s, evenly spaced
    degrees : (T,) of an angle that goes to and fro; gaps are bridged

    Raises
    ------
    InputError : the angle is never known, or does not move
    """
    known = np.isfinite(degrees)
    if known.sum() < 10:
        raise InputError("is known in fewer than ten frames", "the angle of the repetitions", "choose another angle")
    rate = (len(time) - 1) / (time[-1] - time[0])
    curve = np.interp(time, time[known], degrees[known])
    if settings.cutoff < 0.45 * rate:
        curve = smooth(curve, rate, Filter("butterworth", 4, settings.cutoff))
    low, high = np.percentile(curve, [5, 95])
    if high - low < settings.least:
        what = f"moves by {high - low:.1f} degrees only"
        raise InputError(what, "the angle of the repetitions", "choose an angle that goes to and fro")
    share = (curve - low) / (high - low)
    if share[: max(1, round(0.2 * rate))].mean() > 0.5:  # rests where the angle is large: somebody who sits
        share = 1 - share
    found, start, beyond = [], None, None
    for k in range(1, len(share)):
        if share[k - 1] < settings.low <= share[k]:
            start = None if beyond else _crossing(time, share, k, settings.low)
        if share[k - 1] < settings.high <= share[k] and beyond is None and start is not None:
            beyond = _crossing(time, share, k, settings.high)
        if share[k - 1] >= settings.high > share[k]:
            back = _crossing(time, share, k, settings.high)
        if share[k - 1] >= settings.low > share[k]:
            if beyond is not None and start is not None:
                found.append(Repetition(start, (beyond + back) / 2, _crossing(time, share, k, settings.low)))
            start = beyond = None
    return tuple(found)


def events_of_repetitions(repetitions: tuple[Repetition, ...], angle: str) -> tuple[Event, ...]:
    """Start, turn and end of each as events of no side."""
    found = []
    for one in repetitions:
        kinds: tuple[tuple[Kind, float], ...] = (("start", one.start), ("turn", one.turn), ("end", one.end))
        found += [Event(time, "general", kind, "angle", label=f"{angle} {kind}") for kind, time in kinds]
    return tuple(found)


def _crossing(time: np.ndarray, share: np.ndarray, k: int, level: float) -> float:
    part = (level - share[k - 1]) / (share[k] - share[k - 1])
    return float(time[k - 1] + part * (time[k] - time[k - 1]))
