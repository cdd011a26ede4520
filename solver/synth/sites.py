"""Where markers sit on the skin: points of faces, drawn equally over the area or named as laboratories name them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import INDEX, PARTS
from markerscope.solver.synth.motion import Motion

_PER_BONE = 2  # markers that each bone of a part gets at least
_FRAMES_AT_ONCE = 2000  # keeps what is posed at a time small
_TRIES = 200  # points drawn for one marker before the skin counts as full


@dataclass(frozen=True, eq=False)
class Sites:
    """Places of markers on the skin.

    Attributes
    ----------
    corners : (M, 3) vertices of the face below each marker
    shares : (M, 3) of these in the point below it
    vertex : (M,) the nearest of them
    joint : (M,) the joint whose bone moves that point most
    height : (M,) m above the skin
    """

    corners: np.ndarray
    shares: np.ndarray
    vertex: np.ndarray
    joint: np.ndarray
    height: np.ndarray

    def __len__(self) -> int:
        return len(self.vertex)

    def select(self, chosen: np.ndarray | slice) -> Sites:
        """Some of them."""
        return Sites(*(getattr(self, f)[chosen] for f in ("corners", "shares", "vertex", "joint", "height")))

    def raised(self, height: np.ndarray) -> Sites:
        """The same places, so far (M,) m above the skin."""
        return replace(self, height=height)


def face_areas(surface: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(F,) m2."""
    a, b, c = (surface[faces[:, k]] for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)


def sites_at(body: Body, betas: np.ndarray, corners: np.ndarray, shares: np.ndarray) -> Sites:
    """Sites at points of faces, on the skin."""
    surface = body.surface(betas)
    points = np.einsum("mk,mka->ma", shares, surface[corners])
    nearest = np.linalg.norm(surface[corners] - points[:, None], axis=2).argmin(axis=1)
    bones = np.einsum("mk,mkj->mj", shares, body.weights[corners]).argmax(axis=1)
    return Sites(corners, shares, corners[np.arange(len(corners)), nearest], bones, np.zeros(len(corners)))


def markable(body: Body, part: str | None = None) -> np.ndarray:
    """(F,) faces where a marker can sit: of the whole body, or those that follow a part's bones most."""
    allowed = body.marker_mask[body.faces].all(axis=1)
    if part is not None:
        own = np.isin(body.weights.argmax(axis=1), [INDEX[name] for name in PARTS[part]])
        allowed &= own[body.faces].all(axis=1)
    return allowed


def uniform_sites(
    body: Body, betas: np.ndarray, count: int, rng: np.random.Generator, *, part: str | None = None, apart: float = 0.03
) -> Sites:
    """Markers spread at random, equally over the area of the skin, not closer than ``apart`` m at rest.

    The first n of more markers are what n markers are: fewer are a subset of more. A part's first markers are two on
    each of its bones.

    Raises
    ------
    InputError : so many do not fit, or they are too few for the bones of the part
    """
    surface = body.surface(betas)
    allowed = np.flatnonzero(markable(body, part))
    area = face_areas(surface, body.faces[allowed])
    owner = body.weights[body.faces[allowed]].mean(axis=1).argmax(axis=1)
    own = [] if part is None else [INDEX[name] for name in PARTS[part]]
    first = [bone for bone in own for _ in range(_PER_BONE)]
    if count < len(first):
        what = f"{count} markers are too few for {len(own)} bones"
        raise InputError(what, f"the {part}".replace("_", " "), f"ask for {len(first)} or more")
    corners, shares, points = np.empty((count, 3), np.intp), np.empty((count, 3)), np.full((count, 3), np.inf)
    for m in range(count):
        chance = np.where(owner == first[m], area, 0) if m < len(first) else area
        picked = rng.choice(len(allowed), size=_TRIES, p=chance / chance.sum())
        where = _in_triangle(rng.random((_TRIES, 2)))
        chosen = body.faces[allowed[picked]]
        drawn = np.einsum("nk,nka->na", where, surface[chosen])
        free = (np.linalg.norm(drawn[:, None] - points[None, :m], axis=2) >= apart).all(axis=1)
        if own:
            bone = np.einsum("nk,nkj->nj", where, body.weights[chosen]).argmax(axis=1)
            free &= np.isin(bone, first[m] if m < len(first) else own)
        if not free.any():
            what = f"{count} markers do not fit {1000 * apart:g} mm apart"
            raise InputError(what, "the skin" if part is None else f"the {part}".replace("_", " "), "ask for fewer")
        k = int(free.argmax())
        corners[m], shares[m], points[m] = chosen[k], where[k], drawn[k]
    return sites_at(body, betas, corners, shares)


def _in_triangle(square: np.ndarray) -> np.ndarray:
    """(N, 2) in the unit square to (N, 3) shares of the corners, equally over the triangle."""
    root = np.sqrt(square[:, 0])
    return np.stack([1 - root, root * (1 - square[:, 1]), root * square[:, 1]], axis=1)


def site_paths(body: Body, betas: np.ndarray, motion: Motion, sites: Sites) -> np.ndarray:
    """(T, M, 3) m, markers that stick to the skin and stand out from it by their height."""
    lifted = replace(body, template=body.template + 0.01 * body.normals(betas), _torch={})

    def points(of: Body, frames: slice) -> np.ndarray:
        pose, place = motion.rotations[frames], motion.trans[frames]
        skin = np.asarray(of.pose(pose, betas, place, sites.corners.ravel())[0])
        return np.einsum("mk,tmka->tma", sites.shares, skin.reshape(len(place), -1, 3, 3))

    found = np.empty((len(motion.trans), len(sites), 3))
    for start in range(0, len(found), _FRAMES_AT_ONCE):
        frames = slice(start, start + _FRAMES_AT_ONCE)
        skin = points(body, frames)
        outward = points(lifted, frames) - skin  # shortened where blending pinches the skin
        outward /= np.linalg.norm(outward, axis=2, keepdims=True)
        found[frames] = skin + sites.height[:, None] * outward
    return found
