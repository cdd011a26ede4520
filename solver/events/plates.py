"""Foot strikes and offs from force plates: when a plate is loaded, and whose foot was on it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from markerscope.solver.events.event import OFF, STRIKE, Event, Side, in_order
from markerscope.solver.events.feet import Feet
from markerscope.solver.filters.smooth import stretches
from markerscope.solver.io.force_plates import ForcePlate

THRESHOLD_N = 20.0
_SHORTEST_S = 0.1
_JOINED_S = 0.03
_NEAR_M = 0.20
_EDGE_M = 0.015
_CLEAR = 0.6


def events_of_plates(
    feet: Feet, plates: Sequence[ForcePlate], threshold: float = THRESHOLD_N
) -> tuple[tuple[Event, ...], tuple[str, ...]]:
    """Strikes and offs of the contacts that belong to one foot, and what was left out, one sentence each.

    A strike counts where the heel, an off where the toe, was within the plate and not on another one's edge; a contact
    at the start or the end of the recording has one of the two alone. Where one plate carried both feet in turn, the
    strike is the first one's and the off the second one's.

    Parameters
    ----------
    feet : where the feet are, on the plates' clock
    threshold : N, vertical
    """
    events: list[Event] = []
    notes: list[str] = []
    for plate in plates:
        for start, stop in contacts(plate, threshold):
            for kind, time, whole in ((STRIKE, start[0], start[1]), (OFF, stop[0], stop[1])):
                if not whole:
                    continue
                side = _whose(feet, plate, start[0], stop[0], kind == STRIKE)
                if side is None:
                    notes.append(f"The contact of {plate.name} at {time:.3f} s is near no foot, or near both.")
                elif _inside(feet, plate, side, time, kind == STRIKE):
                    events.append(Event(time, side, kind, "plates"))
                else:
                    part = "strike" if kind == STRIKE else "off"
                    notes.append(f"The {side} foot's {part} at {time:.3f} s is not wholly on {plate.name}.")
    return in_order(events), tuple(notes)


def contacts(plate: ForcePlate, threshold: float = THRESHOLD_N) -> list[tuple[tuple[float, bool], tuple[float, bool]]]:
    """When a plate was loaded: s of start and stop, between samples, each with whether it lies in the recording."""
    force, time = plate.force[:, 2], plate.time
    rate = (len(time) - 1) / (time[-1] - time[0])
    loaded = force > threshold
    for run in stretches(~loaded):
        if run.start > 0 and run.stop < len(loaded) and run.stop - run.start < _JOINED_S * rate:
            loaded[run] = True
    found = []
    for run in stretches(loaded):
        if run.stop - run.start < _SHORTEST_S * rate:
            continue
        begins, ends = run.start > 0, run.stop < len(loaded)
        start, stop = float(time[run.start]), float(time[run.stop - 1])
        if begins:
            start = _crossing(time, force, run.start - 1, threshold)
        if ends:
            stop = _crossing(time, force, run.stop - 1, threshold)
        found.append(((start, begins), (stop, ends)))
    return found


def _crossing(time: np.ndarray, force: np.ndarray, k: int, threshold: float) -> float:
    """s, where the force between samples k and k + 1 passes the threshold."""
    share = (threshold - force[k]) / (force[k + 1] - force[k])
    return float(time[k] + np.clip(share, 0, 1) * (time[k + 1] - time[k]))


def _whose(feet: Feet, plate: ForcePlate, start: float, stop: float, at_start: bool) -> Side | None:
    """The foot under which the centre of pressure lies in the first, or the last, part of a contact."""
    part = min(0.35 * (stop - start), 0.25)
    first, last = (start, start + part) if at_start else (stop - part, stop)
    within = (feet.time >= first - 1e-9) & (feet.time <= last + 1e-9)
    if within.sum() < 2:
        return None
    centre = np.stack([np.interp(feet.time[within], plate.time, plate.centre[:, k]) for k in range(2)], axis=1)
    away = {}
    for side, foot in feet.sides.items():
        off = _from_segment(centre, foot.heel[within, :2], foot.toe[within, :2])
        if np.isfinite(off).any():
            away[side] = float(np.nanmedian(off))
    if not away:
        return None
    nearest = min(away, key=lambda side: away[side])
    others = [value for side, value in away.items() if side != nearest]
    if away[nearest] > _NEAR_M or any(away[nearest] > _CLEAR * value for value in others):
        return None
    return "left" if nearest == "left" else "right"


def _from_segment(points: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(T,) m from points to the segments a to b, all (T, 2)."""
    along = b - a
    share = np.einsum("tk,tk->t", points - a, along) / np.maximum(np.einsum("tk,tk->t", along, along), 1e-12)
    return np.asarray(np.linalg.norm(points - a - np.clip(share, 0, 1)[:, None] * along, axis=1))


def _inside(feet: Feet, plate: ForcePlate, side: str, time: float, strike: bool) -> bool:
    """Whether the part of the foot that the event is of stands within the plate's corners."""
    if plate.corners is None:
        return True
    part = feet.sides[side].heel if strike else feet.sides[side].toe
    later = time + 0.05 if strike else time - 0.05
    point = np.array([np.interp(later, feet.time, part[:, k]) for k in range(2)])
    corners = plate.corners[:, :2]
    nexts = np.roll(corners, -1, axis=0)
    side_vector = nexts - corners
    turn = side_vector[:, 0] * (point - corners)[:, 1] - side_vector[:, 1] * (point - corners)[:, 0]
    distance = turn / np.linalg.norm(side_vector, axis=1)
    return bool((distance > _EDGE_M).all() or (distance < -_EDGE_M).all())
