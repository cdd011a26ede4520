"""Where on the body the markers sit: hypotheses for the whole body or any part, before any pose is changed.

The body of the video, turned into the lab by an unknown rotation and shifted in every frame, is laid over the markers:
each marker takes the one vertex that stays nearest to it over all frames (the cost of every pair is one matrix
product), then the rotation and shifts are solved in closed form, and so on. Many starts, each a fraction of a
millisecond a round: every bone as the place where the cloud sits, times every yaw.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.body.skeleton import JOINTS
from solver.rotations import exp_so3, kabsch, log_so3

R_LAB_UPRIGHT_CAMERA = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Turns an upright camera's axes (x right, y down, z away) into a z-up lab in which it looks along +y."""

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
    found = []
    for name, members in starts:
        for yaw, turn in turns:
            result = overlay.solve(turn, members, search.rounds, free_turn=R_lab_cam is None)
            found.append(Hypothesis(vertices[result[0]], result[1], result[2], result[3], name, yaw))
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
    """The closed-form parts of laying a body over markers, with all that does not change computed once."""

    def __init__(self, markers: np.ndarray, points: np.ndarray) -> None:
        self.seen = np.isfinite(markers).all(axis=2)  # (N, M)
        self.markers = np.where(self.seen[..., None], markers, 0.0)
        self.points = points
        self.count = np.maximum(self.seen.sum(axis=1), 1)
        # Single precision tells the nearest vertex as well, in half the time.
        self.flat = points.transpose(1, 0, 2).reshape(points.shape[1], -1).astype(np.float32)
        self.own = np.einsum("nvk,nvk->vn", points, points) @ self.seen
        self.total = max(int(self.seen.sum()), 1)
        self.ever = self.seen.any(axis=0)

    def solve(
        self, turn: np.ndarray, members: np.ndarray, rounds: int, *, free_turn: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Vertex positions (M,) in the candidates, camera turn, shifts (N, 3) and mean squared distance."""
        middle = self.points[:, members].mean(axis=1) @ turn.T
        trans = self.markers.sum(axis=1) / self.count[:, None] - middle
        chosen = np.full(self.markers.shape[1], -1)
        cost = np.inf
        for round_ in range(rounds):
            distance = self._distances(turn, trans)
            nearest = distance.argmin(axis=0)
            cost = float(distance[nearest, np.arange(len(nearest))][self.ever].sum()) / self.total
            if np.array_equal(nearest, chosen):
                break
            chosen = nearest
            turn, trans = self._register(chosen, turn, free_turn and round_ > 1, free_turn)
        return np.where(self.ever, chosen, 0), turn, trans, cost

    def _distances(self, turn: np.ndarray, trans: np.ndarray) -> np.ndarray:
        """(V, M) m^2 summed over the frames in which the marker is seen."""
        # The markers are carried to the body instead of the body to the markers: nearly all is then known beforehand.
        carried = ((self.markers - trans[:, None]) @ turn) * self.seen[..., None]
        product = self.flat @ carried.transpose(0, 2, 1).reshape(self.flat.shape[1], -1).astype(np.float32)
        return self.own - 2 * product + np.einsum("nmk,nmk->m", carried, carried)

    def _register(
        self, chosen: np.ndarray, turn: np.ndarray, all_axes: bool, any_turn: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        source = self.points[:, chosen] * self.seen[..., None]
        centre_source = source.sum(axis=1) / self.count[:, None]
        centre_target = self.markers.sum(axis=1) / self.count[:, None]
        if any_turn:
            a = ((source - centre_source[:, None]) * self.seen[..., None]).reshape(-1, 3)
            b = ((self.markers - centre_target[:, None]) * self.seen[..., None]).reshape(-1, 3)
            if all_axes:
                turn = kabsch(a, b)
            else:
                h = b.T @ (a @ turn.T)
                yaw = np.arctan2(h[1, 0] - h[0, 1], h[0, 0] + h[1, 1])
                turn = exp_so3(np.array([0, 0, yaw])) @ turn
        return turn, centre_target - centre_source @ turn.T


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
