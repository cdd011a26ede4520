"""Markers on the skin: spread by hand over each bone, and where they are while the body moves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.synth.motion import Motion

MARKERS_PER_BONE: dict[str, int] = {
    **{"pelvis": 4, "spine3": 5, "head": 3},
    **{
        f"{side}_{bone}": count
        for side in ("left", "right")
        for bone, count in {"shoulder": 2, "elbow": 2, "wrist": 2, "hip": 3, "knee": 3, "ankle": 3}.items()
    },
}
"""How many markers a whole body carries on each bone (named after the joint it turns about)."""

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
