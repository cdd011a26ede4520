"""Bones inside the body: laid where its joints are, following shape and pose, small enough to ship."""

from __future__ import annotations

import numpy as np
import open3d
import pytest

from markerscope.resources import resource
from markerscope.solver.body.bone_meshes import BoneMeshes, anchor_places, bone_meshes, carried
from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from tools.bake_body import bones as bake


@pytest.fixture(scope="module")
def body() -> Body:
    return with_bone_lengths(Body.load())


@pytest.fixture(scope="module")
def meshes() -> BoneMeshes:
    return bone_meshes()


def test_the_file_is_small_and_says_whose_bones_they_are(meshes: BoneMeshes):
    assert resource("body", "bones.npz").stat().st_size < 120_000
    assert len(meshes.faces) <= bake.FACES
    assert meshes.faces.min() == 0 and meshes.faces.max() == len(meshes.vertices) - 1
    np.testing.assert_allclose(meshes.weights.sum(axis=1), 1)
    notice = resource("body", "NOTICE-bones.txt").read_text(encoding="utf-8")
    for words in ("Rajagopal", "MIT License", "Stanford University", "OpenSim", "What was changed"):
        assert words in notice


def test_the_file_belongs_to_the_body_that_ships(body: Body, meshes: BoneMeshes):
    """Bones have to be laid anew after every bake of the body."""
    here = anchor_places(body, np.zeros(body.shape_count))
    for names, places in zip(meshes.anchors, meshes.places, strict=True):
        np.testing.assert_allclose(places, [here[name] for name in names], atol=1e-5)


def of(meshes: BoneMeshes, joint: str) -> np.ndarray:
    """(n,) the vertices that move with a joint alone."""
    return np.flatnonzero(meshes.weights[:, INDEX[joint]] == 1)


@pytest.mark.parametrize("seed", range(4))
def test_long_bones_end_at_the_joints_of_any_shape(body: Body, meshes: BoneMeshes, seed: int):
    betas = np.zeros(body.shape_count) if seed == 0 else np.random.default_rng(seed).normal(0, 1, body.shape_count)
    rest, joints = meshes.rest(body, betas), body.joints(betas)
    for side in ("left", "right"):
        for near, far, most in (("hip", "knee", 0.035), ("shoulder", "elbow", 0.03), ("knee", "ankle", 0.045)):
            bone = rest[of(meshes, f"{side}_{near}")]
            ends = joints[INDEX[f"{side}_{near}"]], joints[INDEX[f"{side}_{far}"]]
            axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
            along = (bone - ends[0]) @ axis
            assert along.min() == pytest.approx(0, abs=most), f"{side} {near}"
            assert along.max() == pytest.approx(np.linalg.norm(ends[1] - ends[0]), abs=most), f"{side} {near}"


@pytest.mark.parametrize("seed", range(4))
def test_limb_bones_stay_under_the_skin_of_thin_and_heavy_people(body: Body, meshes: BoneMeshes, seed: int):
    betas = np.random.default_rng(10 + seed).normal(0, 1, body.betas_count)
    betas = np.pad(betas, (0, body.shape_count - len(betas)))
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(body.surface(betas).astype(np.float32), body.faces.astype(np.uint32))
    points = meshes.rest(body, betas).astype(np.float32)
    out = np.where(scene.compute_occupancy(points).numpy() > 0, 0, scene.compute_distance(points).numpy())
    for side in ("left", "right"):
        for joint in ("hip", "knee", "shoulder", "elbow", "ankle"):
            own = of(meshes, f"{side}_{joint}")
            assert 1000 * out[own].max() < 12, f"{side} {joint}: {1000 * out[own].max():.0f} mm outside"
    assert 1000 * out[of(meshes, "pelvis")].max() < 5


def test_posed_bones_go_with_their_joints(body: Body, meshes: BoneMeshes):
    """The femur moves as the thigh does, rigidly; the whole follows a shift and a turn of the root."""
    rng = np.random.default_rng(4)
    betas = rng.normal(0, 0.5, body.shape_count)
    rotations = exp_so3(0.4 * rng.normal(size=(2, 24, 3)))
    trans = rng.normal(size=(2, 3))
    posed = meshes.posed(body, rotations, betas, trans)
    rest, centres = meshes.rest(body, betas), body.joints(betas)
    femur = of(meshes, "left_hip")
    turn = rotations[:, 0] @ rotations[:, INDEX["left_hip"]]
    joints = np.asarray(body.pose(rotations, betas, trans, want_vertices=False)[1])[:, INDEX["left_hip"]]
    for t in range(2):
        expected = (rest[femur] - centres[INDEX["left_hip"]]) @ turn[t].T + joints[t]
        np.testing.assert_allclose(posed[t, femur], expected, atol=1e-9)


def test_left_bones_are_the_right_ones_mirrored(meshes: BoneMeshes):
    for joint in JOINTS:
        if joint.startswith("left") and joint != "left_collar":
            left, right = (meshes.vertices[of(meshes, name)] for name in (joint, joint.replace("left", "right")))
            np.testing.assert_allclose(left.mean(axis=0), right.mean(axis=0) * [-1, 1, 1], atol=1.5e-3)


def test_points_are_carried_as_their_anchors_go():
    """A similarity is taken over exactly; of a stretch along one axis what the stiffness leaves."""
    rng = np.random.default_rng(6)
    source, points = rng.normal(size=(6, 3)), rng.normal(size=(20, 3))
    turn = exp_so3(np.array([0.3, -1.2, 0.5]))
    np.testing.assert_allclose(carried(source, 1.3 * source @ turn.T + 2, points), 1.3 * points @ turn.T + 2, atol=1e-9)
    corners = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])
    stretched = corners * [1.0, 1.2, 1.0]
    np.testing.assert_allclose(carried(corners, stretched, corners, stiffness=0), stretched, atol=1e-12)
    np.testing.assert_allclose(carried(corners, stretched, corners, stiffness=1e9), corners * 16 / 15, atol=1e-6)


def test_thinning_keeps_every_bone():
    from tools.bake_body.rajagopal import Mesh

    ball = open3d.geometry.TriangleMesh.create_sphere(0.05, 20)
    big = bake.Part(Mesh(np.asarray(ball.vertices), np.asarray(ball.triangles)), "thorax", 9, 9, 0.0)
    ball = open3d.geometry.TriangleMesh.create_sphere(0.01, 6)
    small = bake.Part(Mesh(np.asarray(ball.vertices), np.asarray(ball.triangles)), "thorax", 9, 9, 0.0)
    thin = bake.thin_out([big, small, small], 300)
    counts = [len(part.mesh.faces) for part in thin]
    assert sum(counts) <= 302 and min(counts) >= bake.LEAST - 4
