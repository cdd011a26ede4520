"""Marker layouts that a network is made for: which vertex each marker sits on, and how far from it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.synth.layouts import LAYOUTS as PLACES
from markerscope.solver.synth.layouts import place_vertex

Group = Literal["body", "left_hand", "right_hand"]
Name = Literal["full_body", "body_53", "body_hands"]

HEIGHT_M = 9.5e-3
"""From the skin to the middle of a marker."""
_SIDES = ("left", "right")
_FINGERS = {
    "index_base": (0.25, 0.75),
    "index_tip": (0.85, 0.75),
    "little_base": (0.25, 0.2),
    "little_tip": (0.75, 0.2),
}
"""Places on the back of the fingers: share of the way to the tip, and from the little finger to the index."""
_BODY_53 = (
    *PLACES["full_body"],
    *(f"{side}_{place}" for side in _SIDES for place in ("triceps", "thigh_front", "shin")),
)
LAYOUTS: dict[Name, tuple[str, ...]] = {
    "full_body": PLACES["full_body"],
    "body_53": _BODY_53,
    "body_hands": (
        *_BODY_53,
        *(f"{side}_{place}" for side in _SIDES for place in ("thumb_side", *_FINGERS)),
    ),
}
"""Places of the named layouts: 47 and 53 markers on the body; the last with 5 more on each hand."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where M markers sit on the body.

    Attributes
    ----------
    labels : M names
    vertex : (M,) the skin vertex nearest to each
    joint : (M,) the joint whose bone carries it
    offset : (M, 3) m from the vertex to the marker, in the axes of the rest body
    normal : (M, 3) unit, out of the skin there
    columns : (M,) column of the recording that each is; counted through where there is none
    body : digest of the body whose vertices are meant
    """

    labels: tuple[str, ...]
    vertex: np.ndarray
    joint: np.ndarray
    offset: np.ndarray
    normal: np.ndarray
    columns: np.ndarray
    body: str

    def __len__(self) -> int:
        return len(self.vertex)

    @property
    def group(self) -> tuple[Group, ...]:
        """M groups: a hand's are the markers on its wrist's and its fingers' bones."""
        hands: dict[str, Group] = {"left_wrist": "left_hand", "left_hand": "left_hand"}
        hands |= {"right_wrist": "right_hand", "right_hand": "right_hand"}
        return tuple(hands.get(JOINTS[j], "body") for j in self.joint)

    @property
    def digest(self) -> str:
        """16 hexadecimal digits that are equal for equal layouts, whatever the markers are called."""
        parts = (self.vertex.astype("<i8"), self.joint.astype("<i8"), np.round(1000 * self.offset).astype("<i8"))
        said = hashlib.sha256(self.body.encode())
        for part in parts:
            said.update(np.ascontiguousarray(part).tobytes())
        return said.hexdigest()[:16]

    def select(self, chosen: np.ndarray) -> Layout:
        """Some of its markers, by index or (M,) True."""
        index = np.arange(len(self))[chosen]
        arrays = (self.vertex, self.joint, self.offset, self.normal, self.columns)
        vertex, joint, offset, normal, columns = (array[index] for array in arrays)
        return Layout(tuple(self.labels[i] for i in index), vertex, joint, offset, normal, columns, self.body)

    def plain(self) -> dict[str, Any]:
        """As JSON has it."""
        arrays = {name: getattr(self, name).tolist() for name in ("vertex", "joint", "columns", "offset", "normal")}
        return {"labels": list(self.labels), **arrays, "body": self.body}

    @classmethod
    def from_plain(cls, said: Mapping[str, Any]) -> Layout:
        """Back from JSON."""
        vertex, joint, columns = (np.array(said[name], dtype=np.intp) for name in ("vertex", "joint", "columns"))
        offset, normal = (np.array(said[name], dtype=float).reshape(-1, 3) for name in ("offset", "normal"))
        return cls(tuple(map(str, said["labels"])), vertex, joint, offset, normal, columns, str(said["body"]))

    def rest(self, body: Body, betas: np.ndarray | None = None) -> np.ndarray:
        """(M, 3) m, the markers on the body at rest; on its mean shape where ``betas`` is None."""
        shape = np.zeros(body.shape_count) if betas is None else betas
        return np.asarray(body.surface(shape, self.vertex) + self.offset)


def named_layout(body: Body, name: Name) -> Layout:
    """A layout as laboratories use it, found on the mean shape of a body."""
    betas = np.zeros(body.shape_count)
    labels = LAYOUTS[name]
    vertex = np.array([_vertex(body, betas, label) for label in labels])
    normal = body.normals(betas)[vertex]
    joint = body.weights[vertex].argmax(axis=1)
    return Layout(labels, vertex, joint, HEIGHT_M * normal, normal, np.arange(len(labels)), body.digest)


def session_layout(body: Body, fitted: FittedMotion, labels: Sequence[str], *, most_frames: int = 60) -> Layout:
    """The layout that a fit found, with the markers that it used; each where the fit has it on the shaped rest body.

    Parameters
    ----------
    body : the one that was fitted, with as many shape coefficients as the fit has
    fitted : the result
    labels : of all markers of the recording

    Raises
    ------
    InputError : the fit used fewer than 3 markers
    """
    used = np.flatnonzero((fitted.marker_joint >= 0) & (fitted.marker_vertex >= 0))
    if len(used) < 3:
        raise InputError("fewer than 3 markers were found on the body", None, "solve a recording with more markers")
    vertex, joint = fitted.marker_vertex[used], fitted.marker_joint[used]
    frames = np.unique(np.linspace(0, len(fitted.time) - 1, most_frames).round().astype(int))
    rotations, trans = fitted.rotations[frames], fitted.trans[frames]
    skin, _ = body.pose(rotations, fitted.betas, trans, vertex)
    turned = _blended_turns(body, rotations, vertex)
    away = np.einsum("tmba,tmb->tma", turned, fitted.placed[frames][:, used] - np.asarray(skin))
    offset = np.nanmean(away, axis=0)
    normal = body.normals(fitted.betas)[vertex]
    offset = np.where(np.isfinite(offset), offset, HEIGHT_M * normal)
    return Layout(tuple(labels[int(i)] for i in used), vertex, joint, offset, normal, used, body.digest)


def _blended_turns(body: Body, rotations: np.ndarray, vertex: np.ndarray) -> np.ndarray:
    """(T, M, 3, 3) how the skin at vertices is turned from rest, the nearest rotation to the blend."""
    from markerscope.solver.body.model import chain
    from markerscope.solver.cleaning.fill.frames import nearest_rotations

    turn, _ = chain(rotations, np.zeros((len(JOINTS), 3)), np.zeros((len(rotations), 3)))
    blended = np.einsum("mj,tjab->tmab", body.weights[vertex], turn)
    return nearest_rotations(blended.reshape(-1, 3, 3)).reshape(blended.shape)


def _vertex(body: Body, betas: np.ndarray, label: str) -> int:
    side, _, place = label.partition("_")
    if place not in _FINGERS:
        return place_vertex(body, betas, label)
    # Markers of whole-body recordings are not looked for on fingers, so these are found by where the fingers are.
    surface, normals = body.surface(betas), body.normals(betas)
    own = np.flatnonzero((body.weights[:, INDEX[f"{side}_hand"]] > 0.8) & (normals[:, 1] > 0.4))
    along, across = np.abs(surface[own, 0]), surface[own, 2]
    share, width = _FINGERS[place]
    wanted_along = along.min() + share * (along.max() - along.min())
    low, high = np.quantile(across, (0.05, 0.95))
    off = np.abs(along - wanted_along) + 1.5 * np.abs(across - (low + width * (high - low)))
    return int(own[off.argmin()])
