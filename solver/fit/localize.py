"""Where on the body the markers sit: hypotheses for the whole body or any part, before any pose is changed.

The body of the video, turned into the lab by an unknown rotation and shifted in every frame, is laid over the markers:
each marker takes the one vertex that stays nearest to it over all frames (the cost of every pair is one matrix
product), then the rotation and shifts are solved in closed form, and so on. Many starts, worked at side by side: every
bone as the place where the cloud sits, times every yaw.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.parallel import spread
from markerscope.solver.core.rotations import exp_so3, kabsch, log_so3
from markerscope.solver.core.skeleton import JOINTS

R_LAB_UPRIGHT_CAMERA = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns an upright camera's axes (x right, y down, z away) into a z-up lab in which it looks along +y."""

_BLOCK = 32
"""Starts worked at together: what they need stays in the processor's cache."""
_DOUBT = 2.0
"""The fewer the markers, the less their distance alone says: n of them tell a tenth apart where one would take n."""


@dataclass(frozen=True)
class Hypothesis:
    """One way the markers may sit on the body.

    Attributes
    ----------
    vertex : (M,) vertex index of each marker
    R_lab_cam : (3, 3) camera to lab
    trans : (N, 3) m, shift of the body in each frame
    cost : m^2, mean squared distance of the markers to their vertices
    start : the bone the cloud was started at, or "whole body"
    yaw_deg : the yaw it was started from
    """

    vertex: np.ndarray
    R_lab_cam: np.ndarray
    trans: np.ndarray
    cost: float
    start: str
    yaw_deg: float


@dataclass(frozen=True)
class Search:
    """How widely to look.

    Attributes
    ----------
    yaws : starts of the camera's heading, evenly spread
    rounds : of assignment and registration
    keep : hypotheses handed on
    any_orientation : also start from turned lab frames, where the vertical axis is not to be trusted
    """

    yaws: int = 8
    rounds: int = 12
    keep: int = 160
    any_orientation: bool = False


def hypotheses(
    markers: np.ndarray,
    body_points: np.ndarray,
    vertices: np.ndarray,
    bone: np.ndarray,
    search: Search,
    R_lab_cam: np.ndarray | None = None,
) -> tuple[Hypothesis, ...]:
    """Every distinct way to lay the video's body over the markers, best first.

    Parameters
    ----------
    markers : (N, M, 3) m, lab frame, NaN = lost
    body_points : (N, V, 3) m, candidate places on the video's body, camera axes, about its root
    vertices : (V,) vertex index of each candidate
    bone : (V,) bone each candidate follows most
    search : how widely to look
    R_lab_cam : (3, 3) if the camera is known already
    """
    overlay = _Overlay(markers, body_points)
    starts = [("whole body", np.ones(len(bone), bool))]
    starts += [(JOINTS[j], bone == j) for j in range(len(JOINTS)) if (bone == j).sum() >= 3]
    turns = [(0.0, R_lab_cam)] if R_lab_cam is not None else _turns(search)
    names = [(name, yaw) for name, _ in starts for yaw, _ in turns]
    members = np.repeat([inside for _, inside in starts], len(turns), axis=0)
    headings = np.tile([turn for _, turn in turns], (len(starts), 1, 1))

    def begun(first: int) -> list[Hypothesis]:
        block = slice(first, first + _BLOCK)
        laid = overlay.solve(headings[block], members[block], search.rounds, free_turn=R_lab_cam is None)
        return [
            Hypothesis(vertices[chosen], turn, trans, float(cost), *name)
            for chosen, turn, trans, cost, name in zip(*laid, names[block], strict=True)
        ]

    found = [one for block in spread(begun, range(0, len(names), _BLOCK)) for one in block]
    return _distinct(found, bone_of=dict(zip(vertices.tolist(), bone.tolist(), strict=True)), keep=search.keep)


def _turns(search: Search) -> list[tuple[float, np.ndarray]]:
    turns = []
    for yaw in np.arange(search.yaws) * 360 / search.yaws:
        turns.append((float(yaw), exp_so3(np.array([0, 0, np.radians(yaw)])) @ R_LAB_UPRIGHT_CAMERA))
    if search.any_orientation:
        tips = [exp_so3(np.array(v) * np.pi / 2) for v in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (2, 0, 0))]
        turns += [(yaw, tip @ turn) for tip in tips for yaw, turn in turns]
    return turns


class _Overlay:
    """The closed-form parts of laying a body over markers, with all that does not change computed once.

    Of S starts at a time: turns (S, 3, 3) from camera to lab, shifts (S, N, 3) m, the vertices chosen (S, M).
    """

    def __init__(self, markers: np.ndarray, points: np.ndarray) -> None:
        self.seen = np.isfinite(markers).all(axis=2)  # (N, M)
        self.markers = np.where(self.seen[..., None], markers, 0.0)
        self.points = points
        self.count = np.maximum(self.seen.sum(axis=1), 1)[:, None]
        self.centre = self.markers.sum(axis=1) / self.count
        # |m - p|^2 less |m|^2 is one product of (m, 1) and (-2 p, |p|^2); single precision tells the nearest as well.
        square = np.einsum("nvk,nvk->nv", points, points)[..., None]
        features = np.concatenate([-2 * points, square], axis=2)
        self.features = features.transpose(0, 2, 1).reshape(-1, points.shape[1]).astype(np.float32)
        self.total = max(int(self.seen.sum()), 1)
        self.ever = self.seen.any(axis=0)

    def solve(
        self, turn: np.ndarray, members: np.ndarray, rounds: int, *, free_turn: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Places in the candidates (S, M), turns, shifts and mean squared distances (S,) m^2.

        Parameters
        ----------
        turn : to begin with
        members : (S, V) the vertices whose middle is laid on that of the markers
        """
        share = members / members.sum(axis=1, keepdims=True)
        turn, trans = turn.copy(), self.centre - (share @ self.points).swapaxes(0, 1) @ turn.swapaxes(1, 2)
        chosen = np.full((len(turn), self.markers.shape[1]), -1)
        cost = np.full(len(turn), np.inf)
        moving = np.arange(len(turn))
        for round_ in range(rounds):
            nearest, distance = self._nearest(turn[moving], trans[moving])
            cost[moving] = distance[:, self.ever].sum(axis=1) / self.total
            new = (nearest != chosen[moving]).any(axis=1)
            moving, nearest = moving[new], nearest[new]
            if not len(moving):
                break
            chosen[moving] = nearest
            all_axes = free_turn and round_ > 1
            turn[moving], trans[moving] = self._register(nearest, turn[moving], all_axes, free_turn)
        return np.where(self.ever, chosen, 0), turn, trans, cost

    def _nearest(self, turn: np.ndarray, trans: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The vertex nearest to each marker over the frames in which it is seen, and how far, m^2 summed over them."""
        # The markers are carried to the body instead of the body to the markers: nearly all is then known beforehand.
        carried = ((self.markers - trans[:, :, None]) @ turn[:, None]) * self.seen[..., None]  # (S, N, M, 3)
        starts, _, count = carried.shape[:3]
        seen = np.broadcast_to(self.seen[..., None], (*carried.shape[:3], 1))
        rows = np.concatenate([carried, seen], axis=3).transpose(0, 2, 1, 3).reshape(starts * count, -1)
        distance = rows.astype(np.float32) @ self.features
        nearest = distance.argmin(axis=1)
        least = distance[np.arange(len(rows)), nearest].reshape(starts, count)
        return nearest.reshape(starts, count), least + np.einsum("snmk,snmk->sm", carried, carried)

    def _register(
        self, chosen: np.ndarray, turn: np.ndarray, all_axes: bool, any_turn: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        source = self.points[:, chosen].swapaxes(0, 1) * self.seen[..., None]  # (S, N, M, 3)
        centre = source.sum(axis=2) / self.count
        if any_turn:
            a = ((source - centre[:, :, None]) * self.seen[..., None]).reshape(len(chosen), -1, 3)
            b = ((self.markers - self.centre[:, None]) * self.seen[..., None]).reshape(-1, 3)
            if all_axes:
                turn = kabsch(a, b)
            else:
                h = b.T @ (a @ turn.swapaxes(1, 2))
                yaw = np.arctan2(h[:, 1, 0] - h[:, 0, 1], h[:, 0, 0] + h[:, 1, 1])
                turn = exp_so3(yaw[:, None] * np.array([0.0, 0, 1])) @ turn
        return turn, self.centre - centre @ turn.swapaxes(1, 2)


def _distinct(found: list[Hypothesis], bone_of: dict[int, int], keep: int) -> tuple[Hypothesis, ...]:
    """The cheapest of each group that agree on the camera and on most markers' bones."""
    kept: list[tuple[Hypothesis, np.ndarray]] = []
    found = sorted(found, key=lambda h: h.cost)
    limit = found[0].cost * (1 + _DOUBT / np.sqrt(len(found[0].vertex))) ** 2
    for one in found:
        if one.cost > limit:
            break
        bones = np.array([bone_of[int(v)] for v in one.vertex])
        same = any(
            np.linalg.norm(log_so3(one.R_lab_cam.T @ other.R_lab_cam)) < np.radians(15)
            and (bones == other_bones).mean() > 0.8
            for other, other_bones in kept
        )
        if not same:
            kept.append((one, bones))
        if len(kept) == keep:
            break
    return tuple(one for one, _ in kept)
