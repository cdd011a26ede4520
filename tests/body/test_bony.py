"""Palpable landmarks: each on the bone that anatomy gives it, and skin that stays with that bone."""

from __future__ import annotations

import numpy as np
import open3d
import pytest
import trimesh

from markerscope.solver.body.bony import bony_sites
from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from tools.bake_body import bony_skin
from tools.bake_body.picker import Landmark, Picker

NOTHING = np.zeros(10)
BONES = {
    "spine3": "c7 t8 sternum_ij sternum_px",
    "pelvis": "sacrum {side}_asis {side}_psis",
    "{side}_collar": "{side}_acromion",
    "{side}_shoulder": "{side}_elbow_lateral {side}_elbow_medial",
    "{side}_elbow": "{side}_wrist_radius {side}_wrist_ulna",
    "{side}_wrist": "{side}_hand_meta2 {side}_hand_meta3 {side}_hand_meta5",
    "{side}_hip": "{side}_knee_lateral {side}_knee_medial",
    "{side}_knee": "{side}_tibial_tuberosity {side}_fibula_head {side}_ankle_lateral {side}_ankle_medial",
    "{side}_ankle": "{side}_calcaneus {side}_toe {side}_meta1 {side}_meta5",
}
"""Wu et al. 2002, 2005: which landmarks define the frame of which bone."""


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


def test_every_landmark_is_on_the_bone_that_anatomy_gives_it(body: Body):
    sites = bony_sites(body)
    expected = {
        name.format(side=side): bone.format(side=side)
        for bone, names in BONES.items()
        for name in names.split()
        for side in ("left", "right")
    }
    assert {name: JOINTS[bone] for name, bone in zip(sites.names, sites.bone, strict=True)} == expected
    assert [body.landmark_names[i] for i in sites.row] == list(sites.names)
    weights = np.einsum("lk,lkj->lj", sites.values, body.weights[sites.vertices])
    share = weights[np.arange(len(sites)), sites.bone]
    assert share.min() > 0.95, dict(zip(sites.names, share.round(2), strict=True))


@pytest.mark.parametrize("joint", "left_knee left_elbow left_ankle left_wrist spine1 neck left_foot".split())
def test_skin_over_bone_stays_with_it_when_a_joint_bends(body: Body, joint: str):
    """Every site above the joint stays where it is, every one below goes along as one piece."""
    sites = bony_sites(body)
    rotations = np.tile(np.eye(3), (1, 24, 1, 1))
    rotations[0, INDEX[joint]] = turn = exp_so3(np.array([0.4, 0.3, -0.5]))
    posed, joints = body.pose(rotations, NOTHING, np.zeros((1, 3)))
    rest, moved = sites.points(body.template), sites.points(posed[0])
    below = np.array([_below(int(bone), INDEX[joint]) for bone in sites.bone])
    centre = joints[0, INDEX[joint]]
    expected = np.where(below[:, None], (rest - centre) @ turn.T + centre, rest)
    error = 1000 * np.linalg.norm(moved - expected, axis=1)
    assert error.max() < 2, {name: round(float(e), 1) for name, e in zip(sites.names, error, strict=True) if e > 2}


def _below(bone: int, joint: int) -> bool:
    from markerscope.solver.core.skeleton import descendants

    return bool(descendants()[joint, bone])


def test_sites_are_mirrored_and_their_normals_point_out_of_the_body(body: Body):
    sites = bony_sites(body)
    surface = body.surface(np.random.default_rng(2).normal(0, 1, 10))
    points, normals = sites.points(surface), sites.normals(body, surface)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
    for i, name in enumerate(sites.names):
        if name.startswith("left"):
            j = sites.names.index(name.replace("left", "right"))
            np.testing.assert_allclose(points[j], points[i] * [-1, 1, 1], atol=1e-3)
            np.testing.assert_allclose(normals[j], normals[i] * [-1, 1, 1], atol=0.05)
            assert mirror_index()[sites.bone[i]] == sites.bone[j]
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(surface.astype(np.float32), body.faces.astype(np.uint32))
    for depth, expected in ((0.0095, 0), (-0.006, 1)):
        inside = scene.compute_occupancy((points + depth * normals).astype(np.float32)).numpy()
        assert (inside == expected).all(), np.array(sites.names)[inside != expected]


def tube() -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.cylinder(radius=0.04, height=0.6, sections=48)
    mesh = mesh.subdivide_to_size(0.008)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def rigid(vertices: np.ndarray, faces: np.ndarray, *rows: bony_skin.BonySkin, **at: np.ndarray) -> np.ndarray:
    rig = np.zeros((len(vertices), 24))
    rig[:, 0] = 1
    found = {n: Landmark((int(np.linalg.norm(vertices - p, axis=1).argmin()),), (1.0,)) for n, p in at.items()}
    everywhere = np.ones(len(vertices), bool)
    return bony_skin.rigid_weights(rig, Picker(vertices, faces), everywhere, found, list(rows))


def test_weights_are_the_bones_within_the_core_and_the_rigs_beyond_the_reach():
    vertices, faces = tube()
    row = bony_skin.BonySkin(("here",), 4, 0.03, 0.07, True)
    weights = rigid(vertices, faces, row, here=np.array([0.04, 0, 0]))
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    # On a tube the shortest way is straight once it is unrolled.
    angle = np.arctan2(vertices[:, 1], vertices[:, 0])
    way = np.hypot(0.04 * angle, vertices[:, 2])
    side = np.hypot(vertices[:, 0], vertices[:, 1]) > 0.0399
    assert weights[side & (way < 0.025), 4].min() > 0.99, "edges are longer than straight lines by some per cent"
    np.testing.assert_allclose(weights[side & (way > 0.0705), 0], 1, atol=1e-12)
    between = side & (way > 0.035) & (way < 0.054)
    assert ((weights[between, 4] > 0) & (weights[between, 4] < 1)).all()
    assert np.corrcoef(way[between], weights[between, 4])[0, 1] < -0.75


def test_an_edge_of_bone_is_followed_and_neighbours_share():
    vertices, faces = tube()
    low, high = np.array([0.04, 0, -0.1]), np.array([0.04, 0, 0.1])
    edge = bony_skin.BonySkin(("low", "high"), 4, 0.01, 0.03, False)
    weights = rigid(vertices, faces, edge, low=low, high=high)
    on_edge = (np.abs(vertices[:, 1]) < 0.006) & (vertices[:, 0] > 0.03) & (np.abs(vertices[:, 2]) < 0.1)
    assert on_edge.sum() > 10 and weights[on_edge, 4].min() > 0.9
    assert weights[vertices[:, 0] < 0, 4].max() == 0, "the other side of the limb is not reached"
    other = bony_skin.BonySkin(("high",), 5, 0.01, 0.03, True)
    shared = rigid(vertices, faces, edge, other, low=low, high=high)
    at = np.linalg.norm(vertices - high, axis=1).argmin()
    np.testing.assert_allclose(shared[at, [4, 5]], 0.5, atol=1e-9)


def test_bodies_that_touch_do_not_share_skin():
    """Two thighs: what is near through the air is not near along the skin."""
    one, faces = tube()
    vertices = np.vstack([one, one + np.array([0.085, 0, 0])])
    row = bony_skin.BonySkin(("inside",), 4, 0.03, 0.07, True)
    weights = rigid(vertices, np.vstack([faces, faces + len(one)]), row, inside=np.array([0.04, 0, 0]))
    assert weights[: len(one), 4].max() == 1 and weights[len(one) :, 4].max() == 0


def test_the_core_of_one_bone_is_its_alone():
    """A landmark whose neighbour's falloff reaches it, as the lateral malleolus lies beside the heel."""
    vertices, faces = tube()
    one, other = np.array([0.04, 0, 0]), np.array([0.04, 0, 0.04])
    rows = [bony_skin.BonySkin((name,), bone, 0.02, 0.06, True) for name, bone in (("one", 4), ("other", 5))]
    weights = rigid(vertices, faces, *rows, one=one, other=other)
    near = np.linalg.norm(vertices - one, axis=1) < 0.01
    assert weights[near, 4].min() > 0.999
