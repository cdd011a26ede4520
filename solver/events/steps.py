"""Foot strikes and offs from where the feet are: the middle of several published estimates.

Strike: the foot furthest ahead of the pelvis (Zeni et al. 2008), which comes early; the fastest fall of the foot's
centre (O'Connor et al. 2007); the lowest point of the heel. Off: the foot furthest behind the pelvis (Zeni); the
fastest rise of the foot's centre (O'Connor); the toe's greatest upward acceleration, which comes early (after Hreljac
and Marshall 2000). Running leaves the ground while the foot still moves back, so that the last one alone is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from markerscope.solver.core.metrics import nanmean_along
from markerscope.solver.events.event import OFF, STRIKE, Event, Kind, Side, in_order
from markerscope.solver.events.feet import Feet, Foot
from markerscope.solver.filters.smooth import Filter, smooth, stretches


@dataclass(frozen=True)
class StepSettings:
    """How steps are found.

    Attributes
    ----------
    cutoff : Hz, of the Butterworth filter before positions are read (O'Connor et al. 2007 take 7)
    zeni_strike, toe_off : s, added to the two estimates that come early
    longest_gap : s, shorter ones are bridged
    near : s, the other estimates are looked for so close to Zeni's
    least_swing : m that the foot goes to and fro about the pelvis, below which there are no steps
    least_speed : m/s that a foot reaches in a swing
    shortest : s, no stance and no swing is shorter
    doubtful : s, estimates that are further apart are told
    """

    cutoff: float = 7.0
    zeni_strike: float = 0.040
    toe_off: float = 0.020
    longest_gap: float = 0.15
    near: float = 0.12
    least_swing: float = 0.15
    least_speed: float = 0.5
    shortest: float = 0.12
    doubtful: float = 0.06


@dataclass(frozen=True, eq=False)
class Steps:
    """What was found.

    Attributes
    ----------
    events : in order
    running : whether no time was spent on both feet
    notes : what was left out, one sentence each
    """

    events: tuple[Event, ...]
    running: bool
    notes: tuple[str, ...] = ()


DEFAULT = StepSettings()
_DROP = 0.05
"""Share of the swing by which a peak stands out on its lower side, where the recording or the sight of a foot ends."""


def find_steps(feet: Feet, settings: StepSettings = DEFAULT, *, body: bool = False) -> Steps:
    """Strikes and offs of both feet.

    Parameters
    ----------
    feet : heel, toe and pelvis over time
    body : whether they are of a solved body
    """
    rate = feet.rate
    if len(feet.time) < 0.5 * rate:
        return Steps((), False, ("Less than half a second is too short for steps.",))
    pelvis = _ready(feet.pelvis, rate, settings)
    ready = {
        side: Foot(_ready(foot.heel, rate, settings), _ready(foot.toe, rate, settings))
        for side, foot in feet.sides.items()
    }
    ahead = heading(pelvis, list(ready.values()), rate)
    found = {side: _of_foot(foot, pelvis, ahead, rate, settings) for side, foot in ready.items()}
    running = _runs(found, rate, settings)
    events, notes = [], []
    for side, (strikes, offs) in found.items():
        foot, place = ready[side], _swing(ready[side].centre, pelvis, ahead)
        kinds: tuple[tuple[Kind, list[int]], ...] = ((STRIKE, strikes), (OFF, offs))
        for kind, frames in kinds:
            for frame in frames:
                told = (
                    _strike_times(foot, frame, rate, settings)
                    if kind == STRIKE
                    else _off_times(foot, frame, rate, settings, running)
                )
                known = np.array([time for time in told if np.isfinite(time)])
                if not len(known):
                    continue
                time = float(feet.time[0] + np.median(known))
                spread = float(np.ptp(known)) if len(known) > 1 else float("nan")
                events.append(Event(time, _side(side), kind, "body" if body else "markers", spread))
        lost = 1 - float(np.isfinite(place).mean())
        if lost > 0.05:
            notes.append(
                f"The {side} foot is lost in {100 * lost:.0f} % of the frames; steps there were not looked for."
            )
    kept, left = _possible(in_order(events), settings)
    doubtful = [event for event in kept if event.spread > settings.doubtful]
    if doubtful:
        listed = ", ".join(f"the {event.side} {event.words} at {event.time:.2f} s" for event in doubtful[:5])
        more = f" and {len(doubtful) - 5} more" if len(doubtful) > 5 else ""
        notes.append(f"The estimates are over {settings.doubtful:g} s apart for {listed}{more}.")
    return Steps(kept, running, (*notes, *left))


def _possible(events: tuple[Event, ...], settings: StepSettings) -> tuple[tuple[Event, ...], list[str]]:
    """The events less those that would make a stance or a swing too short for anybody; what was left out."""
    kept = list(events)
    notes: list[str] = []
    while True:
        pairs = [
            (one, other)
            for side in ("left", "right")
            for one, other in pairwise([event for event in kept if event.side == side])
            if other.time - one.time < settings.shortest
        ]
        if not pairs:
            return tuple(kept), notes
        worse = max(pairs[0], key=lambda event: np.nan_to_num(event.spread, nan=settings.doubtful))
        kept.remove(worse)
        notes.append(f"The {worse.side} {worse.words} at {worse.time:.2f} s was left out: too close to another event.")


def heading(pelvis: np.ndarray, feet: list[Foot], rate: float) -> np.ndarray:
    """(T, 2) unit vectors of the way ahead: the pelvis' path, or where the feet point while it stays in place.

    Parameters
    ----------
    pelvis : (T, 3) m
    feet : toes and heels; backward walking goes where the path goes
    """
    half = max(1, round(0.5 * rate))
    pointing = nanmean_along(np.array([_unit((foot.toe - foot.heel)[:, :2]) for foot in feet]), 0) if feet else None
    path = _bridged(pelvis[:, :2])
    velocity = np.zeros((len(path), 2))
    for t in range(len(path)):
        a, b = max(0, t - half), min(len(path) - 1, t + half)
        velocity[t] = (path[b] - path[a]) * rate / max(b - a, 1)
    speed = np.linalg.norm(velocity, axis=1)
    way = _unit(velocity)
    if pointing is None:
        return way
    facing = _unit(_mean_over(_bridged(pointing), half))
    return np.where((speed > 0.3)[:, None], way, facing)


def _of_foot(
    foot: Foot, pelvis: np.ndarray, ahead: np.ndarray, rate: float, settings: StepSettings
) -> tuple[list[int], list[int]]:
    """Frames of the foot furthest ahead (heel) and furthest behind (toe)."""
    heel, toe = (_swing(part, pelvis, ahead) for part in (foot.heel, foot.toe))
    # Against the pelvis too: a foot that stands still while the pelvis sways above it takes no step.
    speed = np.linalg.norm(np.gradient(foot.centre, axis=0), axis=1) * rate
    back, fore = round(0.45 * rate), round(0.45 * rate)
    strikes = [
        t
        for t in _peaks(heel, rate, settings)
        if np.nanmax(speed[max(0, t - back) : t + 1], initial=0) > settings.least_speed
    ]
    offs = [t for t in _peaks(-toe, rate, settings) if np.nanmax(speed[t : t + fore], initial=0) > settings.least_speed]
    return strikes, offs


def _peaks(signal: np.ndarray, rate: float, settings: StepSettings) -> list[int]:
    """Frames of the peaks that stand out on both sides, as far as these are seen."""
    from scipy.signal import find_peaks

    known = np.isfinite(signal)
    if known.sum() < 0.3 * rate:
        return []
    swing = float(np.ptp(np.percentile(signal[known], [5, 95])))
    if swing < settings.least_swing:
        return []
    least = 0.3 * swing
    found: list[int] = []
    for run in stretches(known):
        piece = signal[run]
        if len(piece) < 5:
            continue
        low = piece.min() - swing
        peaks, _ = find_peaks(np.concatenate([[low], piece, [low]]), prominence=least, distance=max(1, 0.3 * rate))
        for p in peaks - 1:
            # Where the foot comes into sight, or goes out of it, what is highest there need not be a peak.
            if min(piece[p] - piece[: p + 1].min(), piece[p] - piece[p:].min()) > _DROP * swing:
                found.append(run.start + int(p))
    return found


def _strike_times(foot: Foot, frame: int, rate: float, settings: StepSettings) -> tuple[float, float, float]:
    middle = frame + settings.zeni_strike * rate
    fall = _derivative(foot.centre[:, 2])
    return (middle / rate, _least(fall, middle, rate, settings), _least(foot.heel[:, 2], middle, rate, settings))


def _off_times(foot: Foot, frame: int, rate: float, settings: StepSettings, running: bool) -> tuple[float, ...]:
    rise = -_derivative(foot.centre[:, 2])
    spring = -_derivative(_derivative(foot.toe[:, 2]))
    toe = _least(spring, frame - settings.toe_off * rate, rate, settings)
    if running:
        return (toe if np.isfinite(toe) else frame / rate,)
    return (frame / rate, _least(rise, frame, rate, settings), toe + settings.toe_off)


def _least(signal: np.ndarray, frame: float, rate: float, settings: StepSettings) -> float:
    """S from the first frame, of the least value near a frame, to a part of a frame; NaN where it lies at an end."""
    first = max(0, round(frame - settings.near * rate))
    last = min(len(signal), round(frame + settings.near * rate) + 1)
    piece = signal[first:last]
    if len(piece) < 3 or not np.isfinite(piece).all():
        return float("nan")
    k = int(np.argmin(piece))
    if k in (0, len(piece) - 1):
        return float("nan")
    a, b, c = piece[k - 1 : k + 2]
    part = 0.5 * (a - c) / max(a - 2 * b + c, 1e-300)
    return float((first + k + np.clip(part, -0.5, 0.5)) / rate)


def _runs(found: dict[str, tuple[list[int], list[int]]], rate: float, settings: StepSettings) -> bool:
    """Whether both feet are mostly off the ground between an off and the other foot's strike: nobody walks so.

    Where one foot alone is known, whether it is on the ground for less than half of a stride.
    """
    late = settings.zeni_strike * rate
    both: list[float] = []
    shares: list[float] = []
    for side, (strikes, offs) in found.items():
        others = np.array([t for other, (times, _) in found.items() if other != side for t in times]) + late
        if len(others):
            both += [float(min(off - others, key=abs)) for off in offs]
        for a, b in pairwise(strikes):
            between = [t for t in offs if a < t < b]
            if len(between) == 1 and b - a < 2.5 * rate:
                shares.append((between[0] - a - late) / (b - a))
    if both:
        return float(np.median(both)) < 0
    return bool(shares) and float(np.median(shares)) < 0.5


def _swing(part: np.ndarray, pelvis: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """(T,) m ahead of the pelvis."""
    return np.asarray(np.einsum("tk,tk->t", (part - pelvis)[:, :2], ahead))


def _ready(points: np.ndarray, rate: float, settings: StepSettings) -> np.ndarray:
    """Short gaps bridged, smoothed."""
    bridged = _bridged(points, round(settings.longest_gap * rate))
    return smooth(bridged, rate, Filter("butterworth", 4, min(settings.cutoff, 0.45 * rate)))


def _bridged(points: np.ndarray, longest: int | None = None) -> np.ndarray:
    """Gaps filled by a smooth curve through their surroundings, up to so many frames; None: all, ends held."""
    from scipy.interpolate import PchipInterpolator

    known = np.isfinite(points).all(axis=1)
    if known.all() or known.sum() < 2:
        return points.copy()
    frames = np.arange(len(points))
    out = points.copy()
    if longest is None:
        for k in range(points.shape[1]):
            out[:, k] = np.interp(frames, frames[known], points[known, k])
        return out
    curve = PchipInterpolator(frames[known], points[known], axis=0, extrapolate=False)
    for gap in stretches(~known):
        if gap.start > 0 and gap.stop < len(points) and gap.stop - gap.start <= longest:
            out[gap] = curve(frames[gap])
    return out


def _derivative(values: np.ndarray) -> np.ndarray:
    return np.gradient(values)


def _mean_over(values: np.ndarray, half: int) -> np.ndarray:
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(values, 2 * half + 1, axis=0, mode="nearest"))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


def _side(side: str) -> Side:
    return "left" if side == "left" else "right"
