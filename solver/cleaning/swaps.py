"""Tracks that exchanged their markers, or broke in two: found, said, and left to the user to mend."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from markerscope.solver.cleaning.gaps import Gap, find_gaps
from markerscope.solver.core.markers import Markers

_LOOK_S = 0.25
"""A track is trusted to go on straight for so long."""
_JUMP_M = 0.02
"""Steps beside the way that are smaller are no sign of anything."""
_UNUSUAL = 6.0
"""Times the marker's median step beside its way."""
_BETTER = 0.35
"""Of the jumps, what may remain after an exchange."""
_NEAR_M = 0.02
_NEAR_SHARE = 0.25
"""A track goes on in another that begins this near to where it was going, plus a share of the way it went unseen."""
_FARTHEST_M = 0.06
_SHORTEST = 5
"""Frames of a track whose direction can be told."""


@dataclass(frozen=True)
class Proposal:
    """An edit that would mend tracks.

    Attributes
    ----------
    kind : ``swap``: two tracks exchange from ``frame`` to ``last``; ``join``: the second's samples go to the first
    frame, last : from 0, both inclusive, what the edit reaches
    markers : the two; in a join the first is the one that goes on
    evidence : m, how much better the tracks go on straight with the edit than without it, or than any other would
    sentence : the same for a person
    """

    kind: Literal["swap", "join"]
    frame: int
    last: int
    markers: tuple[int, int]
    evidence: float
    sentence: str


@dataclass(frozen=True)
class _Step:
    """A step of a track that leaves its way: where it was last seen, when, and how it moved (m a frame)."""

    marker: int
    frame: int
    before: int
    place: np.ndarray
    speed: np.ndarray
    jump: float

    def expected(self, frame: int) -> np.ndarray:
        """Where it would have been."""
        return self.place + self.speed * (frame - self.before)


def find_proposals(markers: Markers) -> tuple[Proposal, ...]:
    """Everything that looks like an exchange or a break, by frame."""
    found = [*_swaps(markers), *_joins(markers)]
    return tuple(sorted(found, key=lambda proposal: (proposal.frame, proposal.markers)))


def apply_proposals(markers: Markers, chosen: Iterable[Proposal]) -> Markers:
    """The markers with chosen edits made, in the order of their frames. Applying an exchange twice undoes it."""
    positions = markers.positions.copy()
    filled = None if markers.filled is None else markers.filled.copy()
    for edit in sorted(chosen, key=lambda proposal: proposal.frame):
        a, b = edit.markers
        span = slice(edit.frame, edit.last + 1)
        for array in (positions, filled):
            if array is None:
                continue
            if edit.kind == "swap":
                array[span, [a, b]] = array[span, [b, a]]
            else:
                array[span, a] = array[span, b]
                array[span, b] = False if array.dtype == bool else np.nan
    return replace(markers, positions=positions, filled=filled)


def _swaps(markers: Markers) -> list[Proposal]:
    """Two tracks that jump at about the same time, each to where the other was going."""
    look = max(1, round(_LOOK_S * markers.rate))
    steps = sorted(_steps(markers, look), key=lambda step: step.frame)
    found: list[Proposal] = []
    taken: set[int] = set()
    for i, one in enumerate(steps):
        best: tuple[float, int] | None = None
        for k in range(i + 1, len(steps)):
            other = steps[k]
            if other.frame - one.frame > look:
                break
            # Both must have been on their own way before either jumped.
            if other.marker == one.marker or other.before >= one.frame or {i, k} & taken:
                continue
            left = _cross(markers.positions, one, other)
            most = min(_BETTER * (one.jump + other.jump), 2 * _FARTHEST_M)
            if left < most and (best is None or left < best[0]):
                best = left, k
        if best is not None:
            left, k = best
            other = steps[k]
            taken |= {i, k}
            pair = min(one.marker, other.marker), max(one.marker, other.marker)
            a, b = (markers.labels[m] for m in pair)
            time = markers.time[one.frame]
            said = (
                f"{a} and {b} look exchanged from {time:.3f} s on: they jump by {1000 * one.jump:.0f} and "
                f"{1000 * other.jump:.0f} mm, each to where the other was going, {1000 * left:.0f} mm off in all."
            )
            last = len(markers.positions) - 1
            found.append(Proposal("swap", one.frame, last, pair, one.jump + other.jump - left, said))
    return found


def _cross(positions: np.ndarray, one: _Step, other: _Step) -> float:
    """m, what is left of both jumps if the tracks are exchanged."""
    first = positions[one.frame, one.marker] - other.expected(one.frame)
    second = positions[other.frame, other.marker] - one.expected(other.frame)
    return float(np.linalg.norm(first) + np.linalg.norm(second))


def _steps(markers: Markers, look: int) -> list[_Step]:
    """Steps that leave the way of their track, over gaps of up to ``look`` frames."""
    steps = []
    for m in range(len(markers.labels)):
        track = markers.positions[:, m]
        seen = np.flatnonzero(np.isfinite(track).all(axis=1))
        if len(seen) < _SHORTEST:
            continue
        now, before, earlier = seen[2:], seen[1:-1], seen[:-2]
        speed = np.where((before - earlier == 1)[:, None], track[before] - track[earlier], 0.0)
        jump = np.linalg.norm(track[now] - track[before] - speed * (now - before)[:, None], axis=1)
        usual = np.median(jump)
        leaves = (now - before <= look) & (jump > _JUMP_M) & (jump > _UNUSUAL * usual)
        steps += [
            _Step(m, int(now[k]), int(before[k]), track[before[k]], speed[k], float(jump[k]))
            for k in np.flatnonzero(leaves)
        ]
    return steps


def _joins(markers: Markers) -> list[Proposal]:
    """Tracks that end where another begins, which is then the same marker's."""
    positions, rate = markers.positions, markers.rate
    look = max(1, round(2 * _LOOK_S * rate))
    present = markers.present.copy()
    spans = sorted(find_gaps(~present), key=lambda span: span.first)  # the gaps of what is lost are what is seen
    owner = {span: span.marker for span in spans}
    ended = sorted((s for s in spans if s.length >= _SHORTEST), key=lambda s: s.last)
    ends = [s.last for s in ended]
    found: list[Proposal] = []
    for span in spans:
        if span.first == 0 or span.length < _SHORTEST:
            continue
        near = ended[bisect_left(ends, span.first - look) : bisect_left(ends, span.first)]
        earlier = sorted(near, key=lambda s: (s.first, s.marker))
        away = {s: _away(positions, s, span) for s in earlier}
        if any(s.marker == span.marker and away[s][0] < away[s][1] for s in earlier):
            continue  # goes on in its own track
        fits = sorted(
            (away[s][0], k, s)
            for k, s in enumerate(earlier)
            if away[s][0] < away[s][1]
            and owner[s] != span.marker
            and not present[s.last + 1 : span.last + 1, owner[s]].any()
        )
        if not fits or (len(fits) > 1 and fits[1][0] < 2 * fits[0][0] and owner[fits[1][2]] != owner[fits[0][2]]):
            continue  # none, or two that cannot be told apart
        distance, _, before = fits[0]
        goes_on = owner[before]
        owner[span] = goes_on
        present[span.first : span.last + 1, goes_on] = True
        present[span.first : span.last + 1, span.marker] = False
        a, b = markers.labels[goes_on], markers.labels[span.marker]
        said = (
            f"{a} ends at {markers.time[before.last]:.3f} s and {b} begins at {markers.time[span.first]:.3f} s, "
            f"{1000 * distance:.0f} mm from where {a} was going: they look like one marker."
        )
        rival = fits[1][0] if len(fits) > 1 else _FARTHEST_M
        found.append(Proposal("join", span.first, span.last, (goes_on, span.marker), rival - distance, said))
    return found


def _away(positions: np.ndarray, ended: Gap, begun: Gap) -> tuple[float, float]:
    """m, how far a span begins from where another was going, and how far it may."""
    tail = positions[max(ended.first, ended.last - _SHORTEST + 1) : ended.last + 1, ended.marker]
    speed = (tail[-1] - tail[0]) / (len(tail) - 1)
    unseen = begun.first - ended.last
    distance = float(np.linalg.norm(positions[begun.first, begun.marker] - tail[-1] - speed * unseen))
    return distance, min(_NEAR_M + _NEAR_SHARE * float(np.linalg.norm(speed)) * unseen, _FARTHEST_M)
