"""A trial of a known person, solved without a video: what the tracking found as the stages of a fit see it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import slerp
from markerscope.solver.fit.bundle import Phase, descend
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.fit.known.same import Compared, compare, said
from markerscope.solver.fit.known.track import Tracked, surface_of
from markerscope.solver.fit.labelled.every_frame import every_frame
from markerscope.solver.fit.labelled.solve import NO_VIDEO, observed
from markerscope.solver.fit.method import chosen_row, fitted_motion, in_use, state_of
from markerscope.solver.fit.parts import part_name
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.results import Candidate, FittedMotion, Localization, Orientation
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.state import Camera, Observations, State, Surface

WEIGHTS = replace(NO_VIDEO, free_shape=False, free_placement=False)
"""Of every trial of a known person."""
_STEEPNESS = 4.0
_UNRIVALLED = 0.95
"""Where no other answer was found, nothing says how far the next is."""
_HELD = Phase(0.01, 0.04, 6)
_MOVED = (Phase(0.03, 0.12, 6, free_placement=True), Phase(0.01, 0.04, 10, free_placement=True))


@dataclass(frozen=True)
class KnownSettings:
    """How a trial of a known person is taken.

    Attributes
    ----------
    markers_moved : markers were put on anew since, near the same places: where each sits is found again
    """

    markers_moved: bool = False


@dataclass(frozen=True)
class KnownFitSettings:
    """Which answer goes on to every frame.

    Attributes
    ----------
    candidate : row of the orientation's candidates to use, pinned by hand; None takes the first
    """

    candidate: int | None = None


def pose_of(tracked: Tracked, markers: Markers) -> PosePrior:
    """The tracked poses where a video's would be, in the lab's own frame, never tracked by a video."""
    best = tracked.tracks[0]
    every = np.arange(len(markers.positions), dtype=float)
    return PosePrior(
        rotations=slerp(best.rotations, best.frames.astype(float), every),
        tracked=np.zeros(len(every), bool),
        time=markers.time,
        source="the person of other trials",
    )


def located(body: Body, known: KnownBody, tracked: Tracked, markers: np.ndarray) -> Localization:
    """The different answers as ways to put the markers on the body, the columns of the best alone.

    Parameters
    ----------
    markers : (T, M, 3) m
    """
    best = tracked.tracks[0]
    used = np.flatnonzero(best.place >= 0)
    nearest = Skin(body, known.betas).nearest_vertex(known.placement.shaped(known.betas))
    places = [_own(track.place, best.place)[used] for track in tracked.tracks]
    vertex = np.stack([nearest[place] for place in places])
    count = len(best.frames)
    return Localization(
        markers=used,
        few=best.frames,
        many=best.frames,
        vertex=vertex,
        bone=np.stack([known.placement.weights[place].argmax(axis=1) for place in places]),
        R_lab_cam=np.tile(np.eye(3), (len(places), 1, 1)),
        trans=np.stack([_at(track.frames, track.trans, best.frames) for track in tracked.tracks]).reshape(-1, count, 3),
        cost_mm=1000 * np.array([track.cost for track in tracked.tracks]),
        start=("known person",) * len(places),
        yaw_deg=np.zeros(len(places)),
        cloud=np.where(np.isfinite(markers).all(axis=2).any(axis=0), 0, -1),
    )


def _own(place: np.ndarray, other: np.ndarray) -> np.ndarray:
    """A track's places; of columns that it has none for, the other's."""
    return np.where(place >= 0, place, other)


def _at(frames: np.ndarray, trans: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(wanted, frames, trans[:, k]) for k in range(3)], axis=1)


def ranked(
    body: Body,
    known: KnownBody,
    tracked: Tracked,
    seen: Observations,
    found: Localization,
    settings: KnownSettings,
    progress: Progress = silent,
) -> Orientation:
    """The answers refined on their keyframes, with what each costs, and what speaks against the person.

    Parameters
    ----------
    seen : all T frames
    """
    mine = seen.markers[:, found.markers]
    best_place = tracked.tracks[0].place
    candidates: list[Candidate] = []
    for row, track in enumerate(tracked.tracks):
        progress(row / len(tracked.tracks), "refining the answers")
        place = _own(track.place, best_place)[found.markers]
        some, state, surface = _begun(body, known, mine, track.frames, place, track.rotations, track.trans)
        problem = Problem(body, some, _none(body))
        state, surface, trace = descend(problem, state, surface, (_HELD,), WEIGHTS)
        if settings.markers_moved and row == 0:
            free = replace(WEIGHTS, free_placement=True)
            state, surface, more = descend(problem, state, surface, _MOVED, free)
            trace = (*trace, *more)
        candidates.append(_candidate(body, problem, state, surface, trace, row, refined=row == 0))
    first = candidates[0]
    behind = [candidate.energy / max(first.energy, 1e-9) for candidate in candidates]
    order = sorted(range(1, len(candidates)), key=lambda i: behind[i])
    rows = (first, *(replace(candidates[i], behind=behind[i]) for i in order))
    margin = rows[1].behind if order else float("inf")
    judged = said(comparison(body, known, tracked, seen.markers), known.off_m, moved=settings.markers_moved)
    confidence = min(_sure(margin), judged.cap)
    return Orientation(rows, float(margin), 1 if order else -1, confidence, judged.doubts)


def energy_of(body: Body, known: KnownBody, tracked: Tracked, markers: np.ndarray) -> float:
    """What the best answer costs a frame in a trial (T, M, 3) m, joints that turn as they seldom do included."""
    best = tracked.tracks[0]
    used = np.flatnonzero(best.place >= 0)
    some, state, surface = _begun(
        body, known, markers[:, used], best.frames, best.place[used], best.rotations, best.trans
    )
    problem = Problem(body, some, _none(body))
    state, surface, _ = descend(problem, state, surface, (_HELD,), WEIGHTS)
    found = problem.energies(state, WEIGHTS, surface)
    unseen = len(known.placement.rest) - len(set(best.place[used].tolist()))
    return found["markers"] + found["anatomical"] + unseen * (_HELD.kernel / _HELD.marker) ** 2


def comparison(body: Body, known: KnownBody, tracked: Tracked, markers: np.ndarray) -> Compared:
    """What holding the person's shape and places costs the trial (T, M, 3) m."""
    best = tracked.tracks[0]
    used = np.flatnonzero(best.place >= 0)
    some, state, surface = _begun(
        body, known, markers[:, used], best.frames, best.place[used], best.rotations, best.trans
    )
    return compare(body, some, state, surface, WEIGHTS, len(set(best.place[used].tolist())) / len(known.placement.rest))


def fitted(
    body: Body,
    seen: Observations,
    found: Localization,
    ranks: Orientation,
    time: np.ndarray,
    settings: KnownFitSettings,
    progress: Progress = silent,
) -> FittedMotion:
    """The chosen answer carried to every frame, shape and places held."""
    own = FitSettings(candidate=settings.candidate)
    used = in_use(seen, found, ranks)
    chosen = ranks.candidates[chosen_row(ranks, own)]
    state, surface = state_of(chosen, used)
    pose = every_frame(body, used, found.many, state, surface, WEIGHTS, progress)
    return fitted_motion(body, seen, found, ranks, own, state, pose, time)


def _begun(
    body: Body,
    known: KnownBody,
    markers: np.ndarray,
    frames: np.ndarray,
    place: np.ndarray,
    rotations: np.ndarray,
    trans: np.ndarray,
) -> tuple[Observations, State, Surface]:
    """The known person with the columns (U) at some places, in a track's poses."""
    start = Pose(rotations, trans, known.betas)
    some = observed(markers[frames], start)
    placement = known.placement.take(place)
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0)
    return some, State(start, placement, camera), surface_of(body, placement, known.betas)


def _candidate(
    body: Body, problem: Problem, state: State, surface: Surface, trace: tuple[float, ...], row: int, refined: bool
) -> Candidate:
    energies = problem.energies(state, WEIGHTS, surface)
    placement, betas = state.placement, state.pose.betas
    bone = placement.weights.argmax(axis=1)
    ahead = state.pose.rotations[:, 0, :2, 2].mean(axis=0)
    return Candidate(
        hypothesis=row,
        refined=refined,
        energies=dict(energies.by_term),
        energy=energies.total,
        bone=bone,
        vertex=Skin(body, betas).nearest_vertex(placement.shaped(betas)),
        part=part_name(bone),
        heading_deg=float(np.degrees(np.arctan2(ahead[1], ahead[0]))),
        camera=CameraResult(np.eye(3), np.zeros(3), 1.0, (0, 0), float("nan")),
        rest=placement.rest,
        dirs=placement.dirs,
        weights=placement.weights,
        surface=surface.point,
        normal=surface.normal,
        betas=betas,
        rotations=state.pose.rotations,
        trans=state.pose.trans,
        trace=trace,
    )


def _none(body: Body) -> Points:
    """No landmarks of a video."""
    return Points.none(body.shape_count)


def _sure(margin: float) -> float:
    """0..1 from how much more the next different answer costs; 0.5 for a tie."""
    return float(1 / (1 + max(margin, 1e-9) ** -_STEEPNESS)) if np.isfinite(margin) else _UNRIVALLED
