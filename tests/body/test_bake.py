"""The steps of the bake, on shapes whose answers are known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, PARENTS
from tools.bake_body import coarse, joint_centres, markers, proportions, rig, shape_space, tpose
from tools.bake_body.picker import Picker, mean
from tools.bake_body.source import Sample


def sphere(level: int = 4) -> tuple[np.ndarray, np.ndarray]:
    mesh = trimesh.creation.icosphere(subdivisions=level)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_a_ray_leaves_a_sphere_at_its_radius(seed: int):
    vertices, faces = sphere()
    rng = np.random.default_rng(seed)
    origin, direction = rng.uniform(-0.4, 0.4, 3), rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    along = origin @ direction
    expected = origin + direction * (-along + np.sqrt(along**2 + 1 - origin @ origin))
    landmark = Picker(vertices, faces).surface(origin, direction)
    assert np.linalg.norm(landmark.of(vertices) - expected) < 0.01
    assert sum(landmark.values) == pytest.approx(1)


def test_a_ray_that_meets_nothing_is_an_error():
    vertices, faces = sphere(1)
    with pytest.raises(ValueError, match="no surface"):
        Picker(vertices, faces).surface(np.array([0, 0, 3.0]), np.array([0, 0, 1.0]))


def test_a_point_inside_is_a_mean_of_its_surroundings_and_follows_them():
    vertices, faces = sphere(3)
    point = np.array([0.1, -0.2, 0.3])
    landmark = Picker(vertices, faces).around(point, np.ones(len(vertices), bool), count=len(vertices))
    np.testing.assert_allclose(landmark.of(vertices), point, atol=1e-9)
    np.testing.assert_allclose(landmark.of(2 * vertices + [1, 2, 3]), 2 * point + [1, 2, 3], atol=1e-9)
    pair = mean(landmark, landmark.mirrored(np.arange(len(vertices))))
    np.testing.assert_allclose(pair.of(vertices), point, atol=1e-9)


@pytest.mark.parametrize("count", [60, 200])
def test_the_coarse_mesh_of_a_torus_is_a_closed_torus(count: int):
    """A torus has holes that a careless dual would close or tear."""
    mesh = trimesh.creation.torus(1.0, 0.35, major_sections=60, minor_sections=30)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    index, small = coarse.coarse_mesh(vertices, faces, np.ones(len(vertices), bool), np.ones(len(vertices)), count)
    assert count <= len(index) <= count + coarse.REPAIRS
    assert len(coarse.bad_edges(small)) == 0
    assert len(index) - 3 * len(small) // 2 + len(small) == 0, "Euler's characteristic of a torus is 0"
    kept = trimesh.Trimesh(vertices[index], small, process=False)
    assert kept.volume == pytest.approx(mesh.volume, rel=0.35 if count == 60 else 0.1)


def test_seeds_keep_to_where_they_are_allowed():
    vertices, faces = sphere(3)
    allowed = vertices[:, 2] > -0.5
    index, _ = coarse.coarse_mesh(vertices, faces, allowed, np.ones(len(vertices)), 100)
    assert allowed[index].all()


def test_a_hole_and_a_doubled_face_are_noticed():
    faces = sphere(1)[1]
    assert len(coarse.bad_edges(faces)) == 0
    assert len(coarse.bad_edges(faces[1:])) == 3
    assert len(coarse.bad_edges(np.vstack([faces, faces[:1]]))) > 0


def test_a_pinch_is_noticed():
    """Two spheres that share a vertex have no bad edge, and are no sphere."""
    faces = sphere(1)[1]
    count = faces.max() + 1
    other = np.where(faces == 0, 3, faces + count)  # its first vertex is the fourth of the first sphere
    assert len(coarse.pinched_vertices(faces)) == 0
    assert len(coarse.bad_edges(np.vstack([faces, other]))) == 0
    assert coarse.pinched_vertices(np.vstack([faces, other])).tolist() == [3]


def test_areas_add_up():
    vertices, faces = sphere()
    assert coarse.vertex_areas(vertices, faces).sum() == pytest.approx(4 * np.pi, rel=0.01)


def test_hip_centres_are_those_of_harrington():
    """An upright pelvis of average size, by hand: x = -0.24 PD - 9.9, y = -0.30 PW - 10.9, z = 0.33 PW + 7.3 mm."""
    stature = 1.7
    width, depth = joint_centres.PELVIS_WIDTH * stature, joint_centres.PELVIS_DEPTH * stature
    skin = 0.012  # as thick in front as behind
    asis = [np.array([[sign * width / 2, 1.0, depth / 2 + skin]]) for sign in (1, -1)]
    psis = [np.array([[sign * 0.045, 1.0, -depth / 2 - skin]]) for sign in (1, -1)]
    left, right = joint_centres.hip_centres(*asis, *psis, np.array([stature]))
    expected = [0.33 * width + 0.0073, 1.0 - 0.30 * width - 0.0109, depth / 2 - 0.24 * depth - 0.0099]
    np.testing.assert_allclose(left[0], expected, atol=1e-12)
    np.testing.assert_allclose(right[0], np.array(expected) * [-1, 1, 1], atol=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10)
def test_hip_centres_turn_with_the_pelvis(seed: int):
    rng = np.random.default_rng(seed)
    turn, shift = exp_so3(rng.normal(size=3)), rng.normal(size=3)
    spines = (0.12, 1, 0.1), (-0.12, 1, 0.1), (0.05, 1.02, -0.1), (-0.05, 1.02, -0.1)
    points = [np.array([spine]) for spine in spines]
    straight = joint_centres.hip_centres(*points, np.array([1.7]))
    turned = joint_centres.hip_centres(*[p @ turn.T + shift for p in points], np.array([1.7]))
    np.testing.assert_allclose(np.array(turned), np.array(straight) @ turn.T + shift, atol=1e-12)


def skin(turns, rest, posed, vertices, weights):  # type: ignore[no-untyped-def]
    """Plain linear blend skinning: world rotations (24, 3, 3), joints at rest and posed (24, 3), vertices (V, 3)."""
    moved = np.einsum("jab,vjb->vja", turns, vertices[:, None] - rest) + posed
    return np.einsum("vj,vja->va", weights, moved)


def test_the_t_pose_is_the_inverse_of_skinning():
    """Bending a body, straightening it, and bending it back by what was found gives the same skin and bones."""
    body = Body.load()
    rng = np.random.default_rng(3)
    relative = np.tile(np.eye(3), (1, 24, 1, 1))
    for side, sign in (("left", 1), ("right", -1)):
        relative[0, INDEX[f"{side}_shoulder"]] = exp_so3(np.radians([5, -10 * sign, -45 * sign]))
        relative[0, INDEX[f"{side}_elbow"]] = exp_so3(np.radians([10, -40 * sign, 0]))
        relative[0, INDEX[f"{side}_hip"]] = exp_so3(np.radians([-4, 3 * sign, 5 * sign]))
        relative[0, INDEX[f"{side}_knee"]] = exp_so3(np.radians([8, 0, 0]))
    chosen = rng.choice(len(body.template), 500, replace=False)
    posed, joints = body.pose(relative, np.zeros(10), np.zeros((1, 3)))
    marks = np.einsum("nk,nkd->nd", body.landmark_values, posed[0][body.landmark_vertices])
    at = {name: marks[i : i + 1] for i, name in enumerate(body.landmark_names)}
    vertices, weights = posed[:, chosen], body.weights[chosen]

    straight, placed = tpose.straighten(joints, vertices, weights, at)
    back = tpose.rotations(joints, at, 0).transpose(0, 2, 1)
    np.testing.assert_allclose(skin(back, placed[0], joints[0], straight[0], weights), vertices[0], atol=1e-9)
    before, after = (np.linalg.norm(x[0, 1:] - x[0, PARENTS[1:]], axis=1) for x in (joints, placed))
    np.testing.assert_allclose(after, before, atol=1e-12)
    error = np.linalg.norm(straight[0] - body.template[chosen], axis=1)
    assert np.percentile(error, 90) < 0.015, f"{1000 * np.percentile(error, 90):.1f} mm from the rest pose"


def test_arms_reach_their_published_length():
    body = Body.load()
    chosen = np.arange(0, len(body.template), 20)
    joints = np.stack([body.joint_template * scale for scale in (0.9, 1.0, 1.15)])
    vertices = np.stack([body.template[chosen] * scale for scale in (0.9, 1.0, 1.15)])
    stature = np.array([1.5, 1.75, 1.9])
    longer, skin_after = proportions.lengthen_arms(joints, vertices, body.weights[chosen], stature)
    for (near, far), target in proportions.TARGETS.items():
        for side in ("left", "right"):
            length = np.linalg.norm(longer[:, INDEX[f"{side}_{far}"]] - longer[:, INDEX[f"{side}_{near}"]], axis=1)
            assert np.mean(length / stature) == pytest.approx(target)
    legs = body.weights[chosen][:, [INDEX["left_knee"], INDEX["right_knee"]]].sum(axis=1) > 0.99
    np.testing.assert_array_equal(skin_after[:, legs], vertices[:, legs])


def test_shape_space_finds_a_linear_population():
    rng = np.random.default_rng(5)
    basis = rng.normal(size=(40, 3, 4)) * [0.05, 0.03, 0.02, 0.01]
    weights = rng.normal(size=(300, 4))
    points = rng.normal(size=(40, 3)) + np.einsum("pdk,nk->npd", basis, weights)
    mass = rng.uniform(0.5, 2, 40)
    space = shape_space.fit_shape_space(points, mass)
    assert space.residual.max() < 1e-9
    assert space.explained[3] == pytest.approx(1)
    np.testing.assert_allclose(space.betas[:, :4].std(axis=0), 1, atol=1e-9)
    rebuilt = space.mean + np.einsum("pdk,nk->npd", space.basis, space.betas)
    np.testing.assert_allclose(rebuilt, points, atol=1e-9)
    # The order of the bodies must not decide a component's sign.
    again = shape_space.fit_shape_space(points[::-1], mass)
    np.testing.assert_allclose(again.basis[..., :4], space.basis[..., :4], atol=1e-6)


def small_sample() -> Sample:
    """Five vertices on a chain of rig bones; the last one hangs on a toe."""
    labels = ("root", "upperleg01.L", "upperleg02.L", "lowerleg01.L", "toe2-1.L", "toe2-2.L", "toe1-1.L")
    return Sample(
        vertices=np.zeros((1, 5, 3), np.float32),
        bones=np.zeros((1, 7, 3)),
        labels=labels,
        parents=np.array([-1, 0, 1, 2, 3, 4, 3]),
        faces=np.array([[0, 1, 2]]),
        inner_faces=np.array([False]),
        weights_index=np.array([[0, 0], [1, 2], [2, 3], [4, 5], [6, 3]]),
        weights_value=np.array([[1, 0], [0.5, 0.5], [0.25, 0.75], [0.5, 0.5], [1, 0]]),
    )


def test_twist_and_toe_bones_go_with_the_joint_above_them():
    dense = rig.merge_weights(small_sample())
    expected = np.zeros((5, 24))
    expected[0, 0] = expected[1, INDEX["left_hip"]] = 1
    expected[3:, INDEX["left_foot"]] = 1
    expected[2, INDEX["left_hip"]], expected[2, INDEX["left_knee"]] = 0.25, 0.75
    np.testing.assert_allclose(dense, expected, atol=1e-12)


def test_only_the_four_largest_weights_are_kept():
    dense = np.zeros((2, 24))
    dense[0, :6] = [0.3, 0.12, 0.2, 0.05, 0.25, 0.08]
    dense[1, :5] = [0.4, 0.1, 0.2, 0.2, 0.1]  # two sides' equal fourths: to keep one would break the symmetry
    kept = rig.top_weights(dense)
    np.testing.assert_allclose(kept[0, :6], np.array([0.3, 0.12, 0.2, 0, 0.25, 0]) / 0.87, atol=1e-12)
    np.testing.assert_allclose(kept[1, :5], [0.5, 0, 0.25, 0.25, 0], atol=1e-12)


def test_loose_parts_are_left_out_and_twins_found():
    vertices, faces = sphere(2)
    both = np.vstack([faces, sphere(1)[1] + len(vertices)])
    kept = rig.main_component(both, len(vertices) + len(sphere(1)[0]))
    np.testing.assert_array_equal(kept, np.arange(len(vertices)))
    twin = rig.mirror_vertices(vertices)
    np.testing.assert_allclose(vertices[twin] * [-1, 1, 1], vertices, atol=1e-6)
    with pytest.raises(ValueError, match="not symmetric"):
        rig.mirror_vertices(vertices + 0.1)


def test_normals_point_outwards():
    vertices, faces = sphere(3)
    np.testing.assert_allclose(markers.vertex_normals(vertices, faces), vertices, atol=0.02)


def test_the_elbow_lies_before_and_below_its_epicondyles():
    """Arms hanging, palms forward, both sides: forward, down and medial by the shares of Rajagopal's humerus."""
    for side in (1.0, -1.0):
        shoulder = np.array([[side * 0.2, 1.4, 0.0]])
        middle = shoulder + np.array([[0, -0.28, 0]])
        centre = joint_centres.elbow_centre(shoulder, middle, np.array([[side * 0.06, 0.01, 0]]), side)
        np.testing.assert_allclose(centre - middle, [[-side * 0.00532, -0.00644, 0.00644]], atol=1e-9)
