"""A known person found in one frame of unlabelled markers, from any heading: poses that the person was seen in, turned
about the vertical, set on the markers, matched one to one, and bent until they fit.

The cheapest of several starts is the answer; how much the best different one costs says how sure it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.fit.labelled.solve import NO_VIDEO, observed
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import Camera, State, Surface

_HEADINGS = 24
_STARTS = 8
_RIGID_STEPS = 6
_REACH_M = (0.30, 0.20, 0.12, 0.08, 0.05, 0.05, 0.04, 0.04)
"""How far a marker may be from its place and still be matched, step by step."""
_STEPS_EACH = 2
_JOINT_DEG, _ROOT_DEG = 30.0, 60.0
"""How near a joint stays to the start where no marker holds it."""
_SAME_M = 0.05
_UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
"""Turns the rest body (y up, facing +z) upright in the lab (z up)."""


@dataclass(frozen=True)
class Found:
    """A known person in one frame.

    Attributes
    ----------
    rotations : (24, 3, 3) root in the internal lab frame, others relative to the parent
    trans : (3,) m
    match : (U,) which of the frame's points each of the person's markers is, -1 where none is
    residual : (U,) m between a marker's place and its point; NaN where there is none
    cost : m, what a marker is off on average, one without a point counted as far as it may be matched
    next_cost : m, the same of the best different answer; infinite where there is none
    """

    rotations: np.ndarray
    trans: np.ndarray
    match: np.ndarray
    residual: np.ndarray
    cost: float
    next_cost: float


def find(body: Body, known: KnownBody, points: np.ndarray) -> Found:
    """The known person among unlabelled points: the cheapest of the answers.

    Parameters
    ----------
    body : the one that ``known`` was fitted with
    points : (P, 3) m, internal lab frame, z up; some of the person's markers and whatever else was seen, NaN = lost
    """
    return answers(body, known, points)[0]


def answers(body: Body, known: KnownBody, points: np.ndarray) -> tuple[Found, ...]:
    """The different ways to see the known person among unlabelled points, the cheapest first.

    Parameters
    ----------
    body, known, points : as of ``find``
    """
    seen = np.flatnonzero(np.isfinite(points).all(axis=1))
    starts = [start for _, start in promising(body, known, points[seen])]
    ended = sorted(_bent(body, known, points[seen], starts), key=lambda found: found.cost)
    links = [forward(body, Pose(a.rotations[None], a.trans[None], known.betas)) for a in ended]
    places = [place_points(known.placement, link, known.betas)[0] for link in links]
    chosen: list[int] = []
    for i, place in enumerate(places):
        if all(np.linalg.norm(place - places[c], axis=1).mean() > _SAME_M for c in chosen):
            chosen.append(i)
    costs = [ended[c].cost for c in chosen]
    return tuple(
        replace(
            ended[c],
            match=np.where(ended[c].match >= 0, seen[np.clip(ended[c].match, 0, None)], -1),
            next_cost=min((cost for k, cost in enumerate(costs) if k != i), default=float("inf")),
        )
        for i, c in enumerate(chosen)
    )


def promising(body: Body, known: KnownBody, points: np.ndarray) -> list[tuple[float, Pose]]:
    """The most promising starts: a pose, a heading, and a place, by nearest points; and what each costs, m2, ascending.

    Parameters
    ----------
    points : (P, 3) m, all seen
    """
    relaxed = anatomical.mean_pose().copy()
    relaxed[0] = _UPRIGHT
    library = np.concatenate([known.poses, relaxed[None]])
    poses = Pose(library, np.zeros((len(library), 3)), known.betas)
    model = place_points(known.placement, forward(body, poses), known.betas)  # (L, U, 3)
    about = model.mean(axis=1, keepdims=True)
    yaw = exp_so3(np.stack([np.zeros(_HEADINGS), np.zeros(_HEADINGS), np.arange(_HEADINGS) * 2 * np.pi / _HEADINGS], 1))
    turned = np.einsum("hab,lub->lhua", yaw, model - about).reshape(-1, model.shape[1], 3)
    turn = np.broadcast_to(yaw, (len(library), _HEADINGS, 3, 3)).reshape(-1, 3, 3)
    place = np.broadcast_to(np.median(points, axis=0), (len(turned), 3)).copy()
    for _ in range(_RIGID_STEPS):
        off = turned[:, :, None] + place[:, None, None] - points  # (S, U, P, 3)
        square = np.einsum("supk,supk->sup", off, off)
        nearest = square.argmin(axis=2)
        least = np.take_along_axis(square, nearest[..., None], axis=2)[..., 0]
        weight = 1 / (1 + least / _REACH_M[1] ** 2) ** 2
        share = weight / weight.sum(axis=1, keepdims=True)
        middle = np.einsum("su,suk->sk", share, turned)
        target = points[nearest]
        aim = np.einsum("su,suk->sk", share, target)
        one, two = turned - middle[:, None], target - aim[:, None]
        sine = np.einsum("su,su->s", share, one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])
        cosine = np.einsum("su,suk->s", share, one[..., :2] * two[..., :2])
        angle = np.arctan2(sine, cosine)
        step = exp_so3(np.stack([0 * angle, 0 * angle, angle], axis=1))
        turned = np.einsum("sab,sub->sua", step, turned)
        turn = step @ turn
        place = aim - np.einsum("sab,sb->sa", step, middle)
    off = turned[:, :, None] + place[:, None, None] - points
    square = np.minimum(np.einsum("supk,supk->sup", off, off), _REACH_M[0] ** 2)
    # What a start leaves unexplained on either side: places without a point, and points without a place.
    cost = square.min(axis=2).mean(axis=1) + square.min(axis=1).mean(axis=1)
    order = np.argsort(cost, kind="stable")
    chosen: list[int] = []
    for s in order:
        if len(chosen) == _STARTS:
            break
        apart = [np.linalg.norm(turned[s] + place[s] - turned[c] - place[c], axis=1).mean() > _SAME_M for c in chosen]
        if all(apart):
            chosen.append(int(s))
    starts = []
    root = body.joints(known.betas)[0]
    for s in chosen:
        pose = s // _HEADINGS
        rotations = library[pose].copy()
        rotations[0] = turn[s] @ rotations[0]
        # The pose stood with its root joint at its place of rest; turning about the markers' middle moves it.
        trans = turn[s] @ (root - about[pose, 0]) + place[s] - root
        starts.append((float(cost[s]), Pose(rotations[None], trans[None], known.betas)))
    return starts


def _bent(body: Body, known: KnownBody, points: np.ndarray, starts: list[Pose]) -> list[Found]:
    """Each start matched one to one and bent, in turns, the reach narrowing; all at once, as if each were a frame."""
    held = replace(
        NO_VIDEO, free_shape=False, free_placement=False, prior_deg=_JOINT_DEG, root_deg=_ROOT_DEG, anatomical=0.1
    )
    camera = Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0)
    count = len(known.placement.rest)
    surface = Surface(np.zeros((count, 3)), np.tile([0.0, 0, 1], (count, 1)))
    none = Points.none(body.shape_count)
    pose = Pose(np.concatenate([s.rotations for s in starts]), np.concatenate([s.trans for s in starts]), known.betas)
    for reach in _REACH_M:
        match = _matched(_placed(body, known, pose), points, reach)
        target = np.where((match >= 0)[..., None], points[np.clip(match, 0, None)], np.nan)
        seen = replace(observed(target, pose), tracked=np.ones(len(starts), bool))
        problem, state = Problem(body, seen, none), State(pose, known.placement, camera)
        weights = replace(held, marker=reach / 4, marker_kernel=2 * reach)
        for _ in range(_STEPS_EACH):
            state = problem.step(state, weights, surface, 1e-4)
        pose = state.pose
    places = _placed(body, known, pose)
    match = _matched(places, points, _REACH_M[-1])
    gap = np.linalg.norm(places - points[np.clip(match, 0, None)], axis=2)
    residual = np.where(match >= 0, gap, np.nan)
    cost = np.where(match >= 0, residual, _REACH_M[-1]).mean(axis=1)
    return [
        Found(pose.rotations[s], pose.trans[s], match[s], residual[s], float(cost[s]), float("inf"))
        for s in range(len(starts))
    ]


def _placed(body: Body, known: KnownBody, pose: Pose) -> np.ndarray:
    """(N, U, 3) m, where the person's markers are in each pose."""
    return place_points(known.placement, forward(body, pose), pose.betas)


def _matched(places: np.ndarray, points: np.ndarray, reach: float) -> np.ndarray:
    """(N, U) the point of each place, one to one with the least sum of squares within reach; -1 for none."""
    square = ((places[:, :, None] - points) ** 2).sum(axis=3)
    match = np.full(places.shape[:2], -1)
    for s, own in enumerate(square):
        rows, columns = linear_sum_assignment(np.minimum(own, reach**2))
        near = own[rows, columns] < reach**2
        match[s, rows[near]] = columns[near]
    return match
