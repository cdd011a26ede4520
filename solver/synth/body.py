"""Bodies for synthetic sessions: shapes that no coefficients reach."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.bones import MODES, with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.meshes import vertex_normals
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS, mirror_index


def vary_body(
    body: Body, rng: np.random.Generator, *, bones: float = 0.03, bumps: float = 0.010, centres: float = 0.0
) -> Body:
    """A body whose mean lies outside of its shape basis, so that no coefficients reach it.

    Parameters
    ----------
    bones : standard deviation of the factor on each bone's length, alike left and right but for a third of it
    bumps : m, the height of some ten smooth swellings and hollows of the skin
    centres : m, standard deviation of each coordinate of a joint's centre about its usual place under the skin
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
    if centres:  # alike left and right but for a third of it, as the lengths are
        moved = rng.normal(0, centres, (len(JOINTS), 3))
        mirrored = moved[mirror_index()] * (-1, 1, 1)
        new = new + (moved + mirrored) / np.sqrt(2) + rng.normal(0, centres / 3, moved.shape)
    return replace(body, template=skin, joint_template=new, name=f"{body.name}, varied", digest="", _torch={})


def vary_bones(body: Body, rng: np.random.Generator, bones: float = 0.03) -> Body:
    """A body whose bones differ from what its shape says in ways that the program's own bone lengths reach.

    Parameters
    ----------
    bones : standard deviation of a bone's length, as a fraction
    """
    lengths = rng.normal(0, 1, len(MODES)) * bones / np.array([mode.share for mode in MODES])
    return with_lengths(body, lengths)


def with_lengths(body: Body, lengths: np.ndarray) -> Body:
    """The body with coefficients (B,) of ``bones.MODES`` made part of its template."""
    grown, first = with_bone_lengths(body), body.shape_count
    return replace(
        body,
        template=body.template + grown.shape_dirs[..., first:] @ lengths,
        joint_template=body.joint_template + grown.joint_dirs[..., first:] @ lengths,
        name=f"{body.name}, bones varied",
        digest="",
        _torch={},
    )
