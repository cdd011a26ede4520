"""Bones inside the body, for the eye: meshes laid under the skin of any shape, and moving with the 24 joints.

Each segment's bones are tied to the body by anchors, landmarks and joint centres whose places on the mean body the file
has. On another shape the anchors are elsewhere, and the bones follow by the affine map nearest to a similarity.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache

import numpy as np

from markerscope.resources import resource
from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import INDEX, JOINTS

FILE = resource("body", "bones.npz")
STIFFNESS = 0.3
"""How much a segment's bones resist being widened or sheared, beside what the anchors say: 0 not at all."""


@dataclass(frozen=True, eq=False)
class BoneMeshes:
    """Bones of a whole body, N vertices.

    Attributes
    ----------
    vertices : (N, 3) m in the rest pose of the embedded body's mean shape (y up, facing +z, left at +x)
    faces : (F, 3), outward
    segment : (N,) which segment each vertex is tied to
    weights : (N, 24) joints that move it, rows summing to 1
    anchors : names of landmarks and joints, for each segment
    places : (K, 3) m where each segment's anchors are on the embedded body's mean shape
    """

    vertices: np.ndarray
    faces: np.ndarray
    segment: np.ndarray
    weights: np.ndarray
    anchors: tuple[tuple[str, ...], ...]
    places: tuple[np.ndarray, ...]
    digest: str = ""

    def rest(self, body: Body, betas: np.ndarray) -> np.ndarray:
        """(N, 3) m bones inside a shaped body at rest."""
        here = anchor_places(body, betas)
        moved = np.empty_like(self.vertices)
        for i, (names, places) in enumerate(zip(self.anchors, self.places, strict=True)):
            own = self.segment == i
            moved[own] = carried(places, np.stack([here[name] for name in names]), self.vertices[own])
        return moved

    def posed(self, body: Body, rotations: np.ndarray, betas: np.ndarray, trans: np.ndarray) -> np.ndarray:
        """(T, N, 3) m bones inside a posed body, the arguments those of ``Body.pose``."""
        centres = body.joints(betas)
        turn, joints = chain(rotations, centres, trans)
        shift = joints - (turn @ centres[..., None])[..., 0]
        motion = np.concatenate([turn, shift[..., None]], axis=-1)  # (T, 24, 3, 4)
        points = np.concatenate([self.rest(body, betas), np.ones((len(self.vertices), 1))], axis=1)
        features = (self.weights[:, :, None] * points[:, None]).reshape(len(points), -1)
        product = features @ motion.transpose(1, 3, 0, 2).reshape(features.shape[1], -1)
        return product.reshape(len(points), -1, 3).swapaxes(0, 1)


def anchor_places(body: Body, betas: np.ndarray) -> dict[str, np.ndarray]:
    """Every joint centre and landmark (3,) m of the shaped body at rest, by name."""
    centres = body.joints(betas)
    return {**body.landmarks(betas), **{name: centres[i] for name, i in INDEX.items()}}


def carried(source: np.ndarray, target: np.ndarray, points: np.ndarray, stiffness: float = STIFFNESS) -> np.ndarray:
    """(n, 3) points moved as anchors go from ``source`` to ``target`` (K, 3), K at least 3.

    The affine map that takes the anchors best, held towards the best similarity (Umeyama 1991, eq. 39-43).
    """
    middle, there = source.mean(axis=0), target.mean(axis=0)
    p, q = source - middle, target - there
    u, size, vt = np.linalg.svd(q.T @ p)
    sign = np.array([1, 1, np.sign(np.linalg.det(u @ vt))])
    similar = (size @ sign) / (p * p).sum() * (u * sign) @ vt
    hold = stiffness * (p * p).sum() / 3
    affine = np.linalg.solve(p.T @ p + hold * np.eye(3), (q.T @ p + hold * similar).T).T
    return (points - middle) @ affine.T + there


@cache
def bone_meshes() -> BoneMeshes:
    """The bones that ship; read once, not to be written to."""
    try:
        raw = FILE.read_bytes()
    except OSError as error:
        raise InputError("the bones cannot be read", FILE, "install Markerscope again") from error
    with np.load(FILE, allow_pickle=False) as data:
        vertices = data["vertices"] * float(data["step"])
        weights = np.zeros((len(vertices), len(JOINTS)))
        share = data["second_share"] / 255
        every = np.arange(len(vertices))
        weights[every, data["first_joint"]] += 1 - share
        weights[every, data["second_joint"]] += share
        count = data["anchors_count"]
        ends = np.cumsum(count)[:-1]
        names = [tuple(str(name) for name in part) for part in np.split(data["anchor_names"], ends)]
        found = BoneMeshes(
            vertices=vertices,
            faces=np.cumsum(data["faces"].astype(np.intp), axis=0),
            segment=data["segment"].astype(np.intp),
            weights=weights,
            anchors=tuple(names),
            places=tuple(np.split(data["anchor_places"].astype(float), ends)),
            digest=hashlib.sha256(raw).hexdigest()[:16],
        )
    for array in (found.vertices, found.faces, found.segment, found.weights, *found.places):
        array.setflags(write=False)
    return found
