"""The embedded body: is it whole, symmetric, of human measure, and are its joints where anatomy has them?"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from markerscope.resources import resource
from markerscope.solver.body.model import Body
from markerscope.solver.core.landmarks import LANDMARKS
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS, mirror_index

FILE = resource("body", "anny_24.npz")
MIRROR = np.array([-1.0, 1, 1])
NOTHING = np.zeros(10)


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def shapes() -> np.ndarray:
    """Ten bodies of the population the shapes were learnt from."""
    return np.random.default_rng(7).normal(size=(10, 10))


def distance(points: dict[str, np.ndarray], one: str, other: str) -> float:
    return float(np.linalg.norm(points[one] - points[other]))


def stature(body: Body, betas: np.ndarray) -> float:
    return float(np.ptp(body.surface(betas)[:, 1]))


def volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("fd,fd->", a, np.cross(b, c)) / 6)


def directed_edges(faces: np.ndarray) -> tuple[set[tuple[int, int]], int]:
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return {(int(a), int(b)) for a, b in edges}, len(edges)


def test_the_file_is_small_and_holds_no_pickles():
    assert FILE.stat().st_size < 4e6
    with np.load(FILE, allow_pickle=False) as data:
        assert all(data[name].dtype.kind in "fiubU" for name in data.files)
        np.testing.assert_array_equal(data["parents"], PARENTS)
        assert data["joint_names"].tolist() == list(JOINTS)
        assert all(np.isfinite(data[name]).all() for name in data.files if data[name].dtype.kind == "f")


@pytest.mark.parametrize("which", ["full", "coarse"])
def test_the_meshes_are_closed_and_turned_outwards(body: Body, which: str):
    vertices = body.template if which == "full" else body.template[body.lod_index]
    faces = body.faces if which == "full" else body.lod_faces
    edges, count = directed_edges(faces)
    assert len(edges) == count, "an edge is used twice in the same direction"
    assert all((b, a) in edges for a, b in edges), "an edge has a face on one side only"
    assert len(vertices) - count // 2 + len(faces) == 2, "not a sphere's topology"
    assert np.array_equal(np.unique(faces), np.arange(len(vertices))), "a vertex belongs to no face"
    # A body of 1.69 m weighs 60 to 80 kg at about 1 kg/l.
    assert 0.058 < volume(vertices, faces) < 0.08


def test_the_coarse_mesh_lies_on_the_full_one_and_is_even(body: Body):
    assert 1200 <= len(body.lod_index) <= 1500
    assert len(np.unique(body.lod_index)) == len(body.lod_index)
    corners = body.template[body.lod_index][body.lod_faces]
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    on_trunk = (body.weights[body.lod_index][:, [INDEX[f"spine{i}"] for i in (1, 2, 3)]].sum(1) > 0.9)[body.lod_faces]
    edges = length[on_trunk.all(axis=1)]
    assert np.percentile(edges, 95) < 2.5 * np.percentile(edges, 5), np.percentile(edges, [5, 50, 95])
    gaps = cKDTree(corners.mean(axis=1)).query(body.template[body.marker_mask])[0]
    assert np.percentile(gaps, 99) < 0.04


def test_weights_sum_to_one_and_change_smoothly(body: Body):
    np.testing.assert_allclose(body.weights_value.sum(axis=1), 1, atol=1e-6)
    assert body.weights_value.min() >= 0
    edges = body.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    step = np.abs(body.weights[edges[:, 0]] - body.weights[edges[:, 1]]).max(axis=1)
    length = np.linalg.norm(body.template[edges[:, 0]] - body.template[edges[:, 1]], axis=1)
    slope = np.percentile(step / np.maximum(length, 0.008), 99.9)
    assert slope < 70, f"skin passes from one bone to another within {1000 / slope:.0f} mm"


def test_left_mirrors_right_in_every_shape(body: Body, shapes: np.ndarray):
    for betas in shapes[:3]:
        skin, joints, marks = body.surface(betas), body.joints(betas), body.landmarks(betas)
        gap, twin = cKDTree(skin).query(skin * MIRROR)
        assert gap.max() < 5e-4, f"skin is {gap.max() * 1000:.2f} mm from its mirror image"
        np.testing.assert_allclose(body.weights[twin][:, mirror_index()], body.weights, atol=2e-2)
        np.testing.assert_allclose(joints[mirror_index()] * MIRROR, joints, atol=1e-6)
        for name, point in marks.items():
            other = name.replace("left", "RIGHT").replace("right", "left").replace("RIGHT", "right")
            np.testing.assert_allclose(marks[other] * MIRROR, point, atol=5e-4, err_msg=name)


def test_the_root_does_not_move_with_shape(body: Body, shapes: np.ndarray):
    assert np.abs([body.joints(betas)[0] for betas in shapes]).max() < 1e-6


def test_shapes_are_a_population_of_adults(body: Body):
    """Betas of N(0, 1): ANSUR's men and women (1.756, sd 0.067; 1.629, 0.064 m) pooled have 1.69 and 0.09 m."""
    heights = [stature(body, betas) for betas in np.random.default_rng(1).normal(size=(300, 10))]
    assert np.mean(heights) == pytest.approx(1.69, abs=0.02)
    assert np.std(heights) == pytest.approx(0.10, abs=0.02)
    # The sign of each component is chosen so that it makes the body larger.
    assert stature(body, np.eye(10)[0]) > stature(body, NOTHING)


# Joint-to-joint lengths over stature: least and most of de Leva (1996), Winter (2009) and the ANSUR surveys.
PROPORTIONS = {
    ("left_hip", "left_knee"): (0.230, 0.255),
    ("left_knee", "left_ankle"): (0.230, 0.255),
    ("left_shoulder", "left_elbow"): (0.150, 0.175),
    ("left_elbow", "left_wrist"): (0.145, 0.160),
    ("left_hip", "right_hip"): (0.090, 0.112),
    ("left_shoulder", "right_shoulder"): (0.185, 0.230),
}


@pytest.mark.parametrize(("pair", "bounds"), PROPORTIONS.items(), ids=lambda value: str(value))
def test_bones_have_human_proportions(body: Body, pair: tuple[str, str], bounds: tuple[float, float]):
    joints = dict(zip(JOINTS, body.joints(NOTHING), strict=True))
    share = distance(joints, *pair) / stature(body, NOTHING)
    assert bounds[0] < share < bounds[1], f"{share:.3f} of stature"


def test_hips_agree_with_another_regression_than_the_one_used(body: Body):
    """Bell et al. (1990): 14 % of the pelvis' width medial of the front iliac spine, 30 % distal, 22 % behind."""
    marks, joints = body.landmarks(NOTHING), body.joints(NOTHING)
    right = marks["right_asis"] - marks["left_asis"]
    width = np.linalg.norm(right)
    right = right / width
    front = marks["left_asis"] + marks["right_asis"] - marks["left_psis"] - marks["right_psis"]
    front = front - right * (front @ right)
    front = front / np.linalg.norm(front)
    bell = marks["left_asis"] + width * (0.14 * right - 0.30 * np.cross(right, front) - 0.22 * front)
    error = np.linalg.norm(joints[INDEX["left_hip"]] - bell)
    assert error < 0.025, f"{error * 1000:.0f} mm from Bell's hip centre"


@pytest.mark.parametrize(
    ("joint", "one", "other"),
    [
        ("knee", "knee_lateral", "knee_medial"),
        ("wrist", "wrist_radius", "wrist_ulna"),
    ],
)
def test_joints_lie_midway_between_their_landmarks_in_every_shape(
    body: Body, shapes: np.ndarray, joint: str, one: str, other: str
):
    for betas in (NOTHING, *shapes):
        marks = body.landmarks(betas)
        middle = (marks[f"left_{one}"] + marks[f"left_{other}"]) / 2
        error = np.linalg.norm(middle - body.joints(betas)[INDEX[f"left_{joint}"]])
        assert error < 0.006, f"{error * 1000:.1f} mm"


def test_the_ankle_lies_below_the_middle_of_the_malleoli_in_every_shape(body: Body, shapes: np.ndarray):
    """By 10 mm; its height over stature is 0.039 in Winter's table, whose subjects are thinner under the heel."""
    for betas in (NOTHING, *shapes):
        marks, ankle = body.landmarks(betas), body.joints(betas)[INDEX["left_ankle"]]
        middle = (marks["left_ankle_lateral"] + marks["left_ankle_medial"]) / 2
        assert 0.007 < (middle - ankle)[1] < 0.013
        np.testing.assert_allclose((middle - ankle)[[0, 2]], 0, atol=0.004)
        height = (ankle[1] - body.surface(betas)[:, 1].min()) / stature(body, betas)
        assert height == pytest.approx(0.040, abs=0.008)


def test_the_elbow_lies_before_and_below_the_epicondyles_in_every_shape(body: Body, shapes: np.ndarray):
    """In the T-pose, palms down: down the arm is outward, its front is forward, and medial is down."""
    for betas in (NOTHING, *shapes):
        marks, joints = body.landmarks(betas), body.joints(betas)
        middle = (marks["left_elbow_lateral"] + marks["left_elbow_medial"]) / 2
        off = joints[INDEX["left_elbow"]] - middle
        length = np.linalg.norm(joints[INDEX["left_elbow"]] - joints[INDEX["left_shoulder"]])
        np.testing.assert_allclose(off / length, [0.023, -0.019, 0.023], atol=0.012)


def test_the_shoulder_lies_under_the_edge_of_the_acromion(body: Body):
    """Rajagopal's model: 3 mm lateral of the acromion's edge, 33 mm below its bone; de Leva: 35 mm below the skin.

    With the arms down: the T-pose lifts the skin beside the acromion, not the acromion.
    """
    marks, shoulder = body.landmarks(NOTHING), body.joints(NOTHING)[INDEX["left_shoulder"]]
    off = shoulder - marks["left_acromion"]
    assert 0 < off[0] < 0.012
    assert 0.030 < -off[1] < 0.045


def test_the_rest_pose_is_a_t_with_straight_limbs(body: Body, shapes: np.ndarray):
    for betas in (NOTHING, *shapes):
        joints = dict(zip(JOINTS, body.joints(betas), strict=True))
        marks = body.landmarks(betas)
        for side, sign in (("left", 1), ("right", -1)):
            arm = [joints[f"{side}_{name}"] for name in ("shoulder", "elbow", "wrist", "hand")]
            assert np.ptp(np.array(arm)[:, 1:], axis=0).max() < 2e-3, "the arm is not horizontal"
            assert sign * arm[3][0] > sign * arm[0][0]
            thigh = joints[f"{side}_hip"] - joints[f"{side}_knee"]
            shank = joints[f"{side}_knee"] - joints[f"{side}_ankle"]
            bend = np.degrees(np.arctan2(np.linalg.norm(np.cross(thigh, shank)), thigh @ shank))
            assert bend < 0.5, f"the knee is bent by {bend:.2f} degrees"
            palm = np.cross(marks[f"{side}_wrist_radius"] - marks[f"{side}_wrist_ulna"], arm[3] - arm[2])
            assert sign * palm[1] / np.linalg.norm(palm) > 0.99, "the palm does not face down"
            foot = marks[f"{side}_toe"] - marks[f"{side}_calcaneus"]
            assert abs(np.degrees(np.arctan2(foot[0], foot[2]))) < 1.5, "the foot does not point ahead"


def test_every_joint_lies_inside_the_skin(body: Body, shapes: np.ndarray):
    import open3d as o3d

    for betas in (NOTHING, *shapes[:4]):
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(body.surface(betas).astype(np.float32), body.faces.astype(np.uint32))
        depth = -scene.compute_signed_distance(body.joints(betas).astype(np.float32)).numpy()
        assert depth.min() > 0.003, f"{JOINTS[int(depth.argmin())]} is {1000 * depth.min():.0f} mm deep"


def test_landmarks_are_all_there_and_where_their_names_say(body: Body):
    marks = body.landmarks(NOTHING)
    assert list(body.landmark_names[:33]) == [f"bp_{name}" for name in LANDMARKS]
    assert all(np.isfinite(point).all() for point in marks.values())
    np.testing.assert_allclose(body.landmark_values.sum(axis=1)[body.landmark_joint < 0], 1, atol=1e-6)
    assert marks["bp_nose"][2] > marks["bp_left_ear"][2] + 0.08
    assert abs(marks["bp_nose"][1] - marks["bp_left_ear"][1]) < 0.04, "ears are level with the nose"
    assert marks["bp_left_eye_outer"][0] > marks["bp_left_eye"][0] > marks["bp_left_eye_inner"][0] > 0
    assert marks["bp_nose"][1] > marks["bp_mouth_left"][1]
    assert marks["left_meta5"][0] > marks["left_toe"][0] > marks["left_meta1"][0]
    assert marks["left_ankle_lateral"][1] < marks["left_ankle_medial"][1], "the outer malleolus is the lower one"
    assert marks["left_ankle_lateral"][2] < marks["left_ankle_medial"][2], "and lies further back"
    assert marks["bp_left_index"][2] > marks["bp_left_pinky"][2], "thumbs forward"
    assert marks["head_top"][1] > marks["c7"][1] > marks["t8"][1] > marks["sacrum"][1]
    foot = marks["bp_left_foot_index"][2] - marks["left_calcaneus"][2]
    assert foot / stature(body, NOTHING) == pytest.approx(0.152, abs=0.01)  # foot length, ANSUR
    assert distance(marks, "left_asis", "right_asis") / stature(body, NOTHING) == pytest.approx(0.14, abs=0.01)


def test_markers_may_sit_on_bones_but_not_on_fingers_soles_or_in_the_mouth(body: Body):
    mask, skin = body.marker_mask, body.template
    palpable = [name for name in body.landmark_names if not name.startswith("bp_")]
    bony = [body.landmark_names.index(name) for name in palpable if not name.endswith(("plantar", "palmar"))]
    corners = body.landmark_vertices[bony][body.landmark_values[bony] > 0.3]
    assert mask[corners].mean() > 0.95
    fingers = (body.weights[:, [INDEX["left_hand"], INDEX["right_hand"]]].sum(axis=1)) > 0.7
    assert not mask[fingers].any()
    soles = (skin[:, 1] < skin[:, 1].min() + 0.01) & (body.normals(NOTHING)[:, 1] < -0.7)
    assert soles.sum() > 50 and not mask[soles].any()
    mouth = body.landmarks(NOTHING)["bp_mouth_left"] * [0, 1, 1] - [0, 0, 0.06]
    inside = np.linalg.norm(skin - mouth, axis=1) < 0.035
    assert inside.any() and not mask[inside].any(), "markers in the mouth"


BENDS = {
    "elbow": ("left_elbow", (0, -90, 0)),
    "knee": ("left_knee", (90, 0, 0)),
    "hip": ("left_hip", (-90, 0, 0)),
    "arm down": ("left_shoulder", (0, 0, -80)),
    "arm up": ("left_shoulder", (0, 0, 60)),
}


@pytest.mark.parametrize("bend", BENDS)
def test_skinning_keeps_the_volume(body: Body, bend: str):
    """Linear blending loses volume at a bend, but a body should lose no more than a bent limb's crease."""
    joint, degrees = BENDS[bend]
    rotations = np.tile(np.eye(3), (1, 24, 1, 1))
    rotations[0, INDEX[joint]] = exp_so3(np.radians(np.array(degrees, dtype=float)))
    posed, _ = body.pose(rotations, NOTHING, np.zeros((1, 3)))
    change = volume(posed[0], body.faces) / volume(body.template, body.faces) - 1
    assert abs(change) < 0.02, f"{100 * change:+.1f} % of the body"
