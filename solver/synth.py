"""Sessions of known truth: a body outside the shape basis, markers on its skin, and what a capture does to them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solver.body.model import Body, chain, vertex_normals
from solver.body.skeleton import INDEX, JOINTS, PARENTS, mirror_index
from solver.markers import Markers
from solver.synth_motion import Motion, demo_motion

__all__ = ["Corruption", "Motion", "Placement", "corrupt", "demo_motion", "marker_paths", "place_markers", "vary_body"]

MARKERS_PER_BONE: dict[str, int] = {
    **{"pelvis": 4, "spine3": 5, "head": 3},
    **{
        f"{side}_{bone}": count
        for side in ("left", "right")
        for bone, count in {"shoulder": 2, "elbow": 2, "wrist": 2, "hip": 3, "knee": 3, "ankle": 3}.items()
    },
}
"""How many markers a whole body carries on each bone (named after the joint it turns about)."""

_SLIDE = {
    "pelvis": 4.0,
    "spine3": 4.0,
    "head": 1.0,
    "shoulder": 5.0,
    "elbow": 3.0,
    "wrist": 1.5,
    "hip": 6.0,
    "knee": 4.0,
}
_SLIDE_ELSEWHERE = 2.0  # mm, standard deviation of skin sliding, by the last word of the bone's name above
_OFFSET, _OFFSET_SPREAD = 9.5e-3, 1.5e-3  # m from the skin to the middle of a marker


@dataclass(frozen=True)
class Placement:
    """Markers on the rest surface.

    Attributes
    ----------
    vertex : (M,) the skin vertex below each marker
    joint : (M,) the joint whose bone carries it
    height : (M,) m above the skin along its normal
    """

    vertex: np.ndarray
    joint: np.ndarray
    height: np.ndarray


@dataclass(frozen=True)
class Corruption:
    """What a capture does to marker paths.

    Attributes
    ----------
    slide : times the usual sliding of skin over bone (some 2 to 6 mm by bone, slow, partly shared and partly bound to
        the bending of the joint)
    jitter : m, white noise a coordinate
    lost : fraction of all samples that is missing, in gaps whose lengths have a heavy tail
    longest_gap : s
    """

    slide: float = 1.0
    jitter: float = 0.4e-3
    lost: float = 0.04
    longest_gap: float = 2.0


def vary_body(body: Body, rng: np.random.Generator, *, bones: float = 0.03, bumps: float = 0.010) -> Body:
    """A body whose mean lies outside of its shape basis, so that no coefficients reach it.

    Parameters
    ----------
    bones : standard deviation of the factor on each bone's length, alike left and right but for a third of it
    bumps : m, the height of some ten smooth swellings and hollows of the skin
    """
    both = rng.normal(0, bones, len(JOINTS))
    factor = 1 + 0.5 * (both + both[mirror_index()]) + rng.normal(0, bones / 3, len(JOINTS))
    old = body.joint_template
    new = old.copy()
    for j in range(1, len(JOINTS)):
        parent = int(PARENTS[j])
        new[j] = new[parent] + factor[j] * (old[j] - old[parent])
    # Each vertex moves as its bones do: shifted with the joint, stretched along the bone to its first child.
    stretch = np.tile(np.eye(3), (len(JOINTS), 1, 1))
    for j in range(len(JOINTS)):
        child = next((k for k, parent in enumerate(PARENTS) if parent == j), None)
        if child is not None:
            along = old[child] - old[j]
            along = along / np.linalg.norm(along)
            stretch[j] += (factor[child] - 1) * np.outer(along, along)
    skin = np.einsum("vj,jab,vb->va", body.weights, stretch, body.template)
    skin += body.weights @ (new - np.einsum("jab,jb->ja", stretch, old))
    normals = vertex_normals(skin, body.faces)
    headless = 1 - body.weights[:, INDEX["head"]]
    for centre in rng.choice(np.flatnonzero(body.marker_mask & (headless > 0.99)), 10, replace=False):
        reach = rng.uniform(0.06, 0.14)
        fall = np.exp(-0.5 * np.sum((skin - skin[centre]) ** 2, axis=1) / reach**2)
        fall *= headless * np.maximum(normals @ normals[centre], 0)  # not the other side of a limb
        skin = skin + bumps * rng.uniform(-1, 1) * fall[:, None] * normals[centre]
    return replace(body, template=skin, joint_template=new, name=f"{body.name}, varied", digest="", _torch={})


def place_markers(
    body: Body, betas: np.ndarray, rng: np.random.Generator, *, counts: dict[str, int] | None = None
) -> Placement:
    """Spread markers over the outer skin of each bone, as far from each other as a hasty hand puts them.

    Parameters
    ----------
    counts : markers on each bone, by the joint's name; ``MARKERS_PER_BONE`` where it is None
    """
    skin, normals = body.surface(betas), body.normals(betas)
    vertices, joints = [], []
    for name, count in (counts or MARKERS_PER_BONE).items():
        bone = INDEX[name]
        allowed = np.flatnonzero(body.marker_mask & (body.weights[:, bone] > 0.6) & _outside(name, normals))
        chosen = [int(rng.choice(allowed))]
        while len(chosen) < count:
            gap = np.linalg.norm(skin[allowed, None] - skin[chosen], axis=2).min(axis=1)
            far = np.argsort(gap)[-max(1, len(allowed) // 12) :]
            chosen.append(int(allowed[rng.choice(far)]))
        vertices += chosen
        joints += [bone] * count
    height = np.maximum(rng.normal(_OFFSET, _OFFSET_SPREAD, len(vertices)), 5e-3)
    return Placement(np.array(vertices), np.array(joints), height)


def _outside(bone: str, normals: np.ndarray) -> np.ndarray:
    """(V,) where no other limb rubs: not the inner thigh, the armpit or the sole."""
    side, _, part = bone.partition("_")
    out = 1.0 if side == "left" else -1.0
    if part in ("hip", "knee"):
        return normals[:, 0] * out > -0.3
    if part == "ankle":
        return normals[:, 1] > -0.2
    if part in ("shoulder", "elbow", "wrist"):
        return normals[:, 1] > -0.4
    return np.ones(len(normals), dtype=bool)


def marker_paths(body: Body, betas: np.ndarray, motion: Motion, placement: Placement) -> np.ndarray:
    """(T, M, 3) m, markers that stick to the skin and stand out from it by their height."""
    raised = replace(body, template=body.template + 0.01 * body.normals(betas), _torch={})
    skin, above = (
        np.asarray(b.pose(motion.rotations, betas, motion.trans, placement.vertex)[0]) for b in (body, raised)
    )
    outward = above - skin  # shortened where blending pinches the skin
    return skin + placement.height[:, None] * outward / np.linalg.norm(outward, axis=2, keepdims=True)


def corrupt(
    paths: np.ndarray,
    body: Body,
    betas: np.ndarray,
    motion: Motion,
    placement: Placement,
    rng: np.random.Generator,
    settings: Corruption | None = None,
) -> tuple[Markers, np.ndarray]:
    """Slide, shake, lose and shuffle marker paths (T, M, 3) m.

    Returns
    -------
    markers : with labels that mean nothing
    order : (M,) which marker of ``placement`` each of them is
    """
    settings = settings or Corruption()
    turns, _ = chain(motion.rotations, body.joints(betas), motion.trans)
    slide = settings.slide * _sliding(motion, placement, rng)
    noisy = paths + np.einsum("tmab,tmb->tma", turns[:, placement.joint], slide)
    noisy = noisy + rng.normal(0, settings.jitter, paths.shape)
    noisy[_gaps(paths.shape[:2], motion.rate, rng, settings)] = np.nan
    order = rng.permutation(paths.shape[1])
    labels = tuple(f"M{i + 1:02d}" for i in range(len(order)))
    return Markers(noisy[:, order], motion.rate, labels), order


def _sliding(motion: Motion, placement: Placement, rng: np.random.Generator) -> np.ndarray:
    """(T, M, 3) m, how skin slides over bone, in the bone's axes."""
    from scipy.ndimage import gaussian_filter1d

    frames = len(motion.trans)

    def wander(count: int) -> np.ndarray:
        """(T, count, 3) of unit size, slow."""
        noise = gaussian_filter1d(rng.normal(size=(frames, count, 3)), 0.15 * motion.rate, axis=0)
        return noise / np.maximum(noise.std(axis=0), 1e-12)

    shared, own = wander(len(JOINTS)), wander(len(placement.joint))
    # Bending away from the usual pose drags the skin, every marker in its own direction.
    trace = np.trace(motion.rotations, axis1=2, axis2=3)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    bent = angle - np.median(angle, axis=0)
    size = np.array([_SLIDE.get(JOINTS[j].split("_")[-1], _SLIDE_ELSEWHERE) for j in placement.joint]) * 1e-3
    direction = rng.normal(size=(len(size), 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    bound = bent[:, placement.joint, None] * direction
    return size[:, None] * (0.45 * shared[:, placement.joint] + 0.35 * own + bound) / np.sqrt(3)


def _gaps(shape: tuple[int, int], rate: float, rng: np.random.Generator, settings: Corruption) -> np.ndarray:
    """(T, M) True where a marker is lost; some markers are lost far more often than others."""
    frames, count = shape
    lost = np.zeros(shape, dtype=bool)
    lengths = np.arange(1, max(2, min(int(settings.longest_gap * rate), frames // 2)) + 1)
    chance = (lengths + 0.6) ** -1.4
    chance /= chance.sum()
    prone = rng.gamma(0.7, size=count)
    prone /= prone.sum()
    while lost.mean() < settings.lost:
        marker, start = rng.choice(count, p=prone), rng.integers(frames)
        lost[start : start + rng.choice(lengths, p=chance), marker] = True
    return lost
