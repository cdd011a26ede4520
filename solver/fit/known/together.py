"""A known person's shape and marker places estimated once more, over keyframes of several trials in one problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.bundle import Phase, descend, reassign
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.known.body import KnownBody, spread_out
from markerscope.solver.fit.known.track import Track, surface_of
from markerscope.solver.fit.labelled.solve import NO_VIDEO, observed
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.stage import to_landmarks
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.state import Camera, State

_OFTEN = 0.5
_FRESH_M = 0.10
"""How far a marker may be from the skin that it moves with before the other places have given way to it."""
_PHASES = (
    Phase(0.03, 0.3, 4, free_placement=True),
    Phase(0.02, 0.08, 6, free_placement=True),
    Phase(0.01, 0.04, 8, free_placement=True),
)


@dataclass(frozen=True)
class Followed:
    """A trial and how the person moves through it.

    Attributes
    ----------
    markers : (T, M, 3) m
    track : of the person
    """

    markers: np.ndarray
    track: Track


def estimated_together(body: Body, known: KnownBody, trials: Sequence[Followed], settings: FitSettings) -> KnownBody:
    """The person by what all these trials say.

    Parameters
    ----------
    known : as one trial has them; the search begins there
    settings : whether markers are drawn to bony landmarks
    """
    seen = observed(
        np.concatenate([by_place(t.markers[t.track.frames], t.track.place, len(known.placement.rest)) for t in trials]),
        start := Pose(
            np.concatenate([t.track.rotations for t in trials]),
            np.concatenate([t.track.trans for t in trials]),
            known.betas,
        ),
    )
    none = Points.none(body.shape_count)
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0)
    state, surface = State(start, known.placement, camera), surface_of(body, known.placement, known.betas)
    free = replace(NO_VIDEO, free_shape=True, free_placement=True)
    state, surface, _ = descend(Problem(body, seen, none), state, surface, _PHASES, free)
    count = len(known.placement.rest)
    frames = np.arange(len(seen.markers))
    drawn = to_landmarks(body, seen, none, np.arange(count), frames, state, surface, free, settings)
    pose, placement = drawn.state.pose, drawn.state.placement
    off = np.linalg.norm(place_points(placement, forward(body, pose), pose.betas) - seen.markers, axis=2)
    return KnownBody(pose.betas, placement, known.markers, spread_out(pose.rotations), float(np.nanmean(off)))


def placed_anew(body: Body, known: KnownBody, trials: Sequence[Followed]) -> KnownBody:
    """The person without the places that no movement bears out, and with places for the markers that had none.

    Standing, an elbow's marker may as well sit on the trunk beside it. As soon as the arm moves it is far from there;
    then the skin that it moves with is known from the other markers.

    Parameters
    ----------
    trials : movements; the one that contradicts most places says where their markers sit
    """
    main = max(trials, key=lambda trial: len(_left_over(trial)))
    left_over = _left_over(main)
    borne_out = np.unique(main.track.place[main.track.place >= 0])
    kept = known.placement.take(borne_out)
    if not len(left_over):
        return replace(known, placement=kept, markers=known.markers[borne_out])
    pose = Pose(main.track.rotations, main.track.trans, known.betas)
    seen = observed(main.markers[main.track.frames][:, left_over], pose)
    none = Points.none(body.shape_count)
    state = State(pose, kept, Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0))
    state, _ = reassign(Problem(body, seen, none), state, NO_VIDEO)
    off = np.linalg.norm(place_points(state.placement, forward(body, pose), known.betas) - seen.markers, axis=2)
    own = np.flatnonzero(np.nanmedian(off, axis=0) < _FRESH_M)
    fresh = state.placement.take(own)
    placement = Points(
        np.concatenate([kept.rest, fresh.rest]),
        np.concatenate([kept.dirs, fresh.dirs]),
        np.concatenate([kept.weights, fresh.weights]),
    )
    markers = np.concatenate([known.markers[borne_out], np.full(len(own), -1)])
    return replace(known, placement=placement, markers=markers)


def _left_over(trial: Followed) -> np.ndarray:
    """Columns that are often seen and are none of the person's places."""
    present = np.isfinite(trial.markers).all(axis=2).mean(axis=0)
    return np.flatnonzero((trial.track.place < 0) & (present >= _OFTEN))


def by_place(markers: np.ndarray, place: np.ndarray, count: int) -> np.ndarray:
    """(N, U, 3) m, the columns (N, M, 3) in the order of the person's markers, pieces of one track put together."""
    out = np.full((len(markers), count, 3), np.nan)
    for column in np.flatnonzero(place >= 0):
        own = markers[:, column]
        there = np.isfinite(own).all(axis=1)
        out[there, place[column]] = own[there]
    return out
