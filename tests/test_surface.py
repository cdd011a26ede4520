"""Distance of markers to the fitted skin."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.meshes import vertex_normals
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.fit.surface import surface_distance


def test_markers_at_a_known_height_over_the_skin() -> None:
    body = with_bone_lengths(Body.load())
    frames = 7
    rotations = np.repeat(anatomical.mean_pose()[None], frames, axis=0)
    trans = np.linspace(0, 1, frames)[:, None] * [1, 0, 0.2]
    betas = np.zeros(body.shape_count)
    vertices, _ = body.pose(rotations, betas, trans)
    # Flat places, where the closest point of the skin is the foot of the normal.
    places = np.flatnonzero(body.weights[:, 4] > 0.9)[::40][:5]
    positions = np.empty((frames, len(places) + 1, 3))
    for t in range(frames):
        normals = vertex_normals(vertices[t], body.faces)
        positions[t, :-1] = vertices[t, places] + 0.005 * normals[places]
    positions[:, -1] = vertices[:, places[0]] + 5.0
    positions[3, 1] = np.nan
    used = np.append(np.full(len(places), 4), -1)
    motion = SimpleNamespace(rotations=rotations, betas=betas, trans=trans, marker_joint=used)
    assert set(vars(motion)) <= {field.name for field in fields(FittedMotion)}
    found = surface_distance(body, cast(FittedMotion, motion), positions)
    assert found.mean == pytest.approx(0.005, abs=5e-4), "a marker that was not used does not count"
    assert found.per_marker[-1] > 4
    assert found.per_marker.shape == (len(places) + 1,) and np.isfinite(found.per_marker).all()
    np.testing.assert_array_equal(found.frames, np.arange(frames))


def test_nothing_seen_is_not_a_distance() -> None:
    body = with_bone_lengths(Body.load())
    rotations = np.repeat(anatomical.mean_pose()[None], 2, axis=0)
    motion = SimpleNamespace(
        rotations=rotations, betas=np.zeros(body.shape_count), trans=np.zeros((2, 3)), marker_joint=np.array([3])
    )
    found = surface_distance(body, cast(FittedMotion, motion), np.full((2, 1, 3), np.nan))
    assert np.isnan([found.mean, found.median, found.per_marker[0]]).all()
