"""Markers put beside the places that they were meant for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.synth.sites import Sites, markable, sites_at

if TYPE_CHECKING:
    from markerscope.solver.body.model import Body


def misplaced(body: Body, betas: np.ndarray, sites: Sites, by: float, rng: np.random.Generator) -> Sites:
    """The same sites, each moved ``by`` m in a random direction along the skin, to where a marker can sit there.

    The skin bends, so a marker ends a little nearer than that.
    """
    import open3d as o3d

    surface = body.surface(betas)
    points = np.einsum("mk,mka->ma", sites.shares, surface[sites.corners])
    a, b, c = (surface[sites.corners[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    drawn = rng.normal(size=(len(sites), 3))
    along = np.cross(normal, drawn)
    moved = points + by * along / np.linalg.norm(along, axis=1, keepdims=True)
    faces = body.faces[markable(body)]
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy(surface.astype(np.float32)), o3d.core.Tensor.from_numpy(faces.astype(np.uint32))
    )
    found = scene.compute_closest_points(o3d.core.Tensor.from_numpy(moved.astype(np.float32)))
    uv = found["primitive_uvs"].numpy().astype(float)
    shares = np.column_stack([1 - uv.sum(axis=1), uv])
    return sites_at(body, betas, faces[found["primitive_ids"].numpy()], shares)
