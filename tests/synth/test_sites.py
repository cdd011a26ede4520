"""Places of markers: equally over the skin's area, apart, nested, on the part asked for, at the height asked for."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARTS
from markerscope.solver.synth import demo_motion, vary_body
from markerscope.solver.synth.layouts import LAYOUTS, named_sites
from markerscope.solver.synth.misplaced import misplaced
from markerscope.solver.synth.sites import markable, site_paths, uniform_sites

FLAT = np.zeros(10)


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


def regions(body: Body) -> np.ndarray:
    """(F,) number of the bone of each face, front and back apart, -1 where no marker can sit."""
    middle = body.template[body.faces].mean(axis=1)
    bone = body.weights[body.faces].mean(axis=1).argmax(axis=1)
    joints = body.joint_template[bone]
    return np.where(markable(body), 2 * bone + (middle[:, 2] > joints[:, 2]), -1)


def p_value(body: Body, faces: np.ndarray) -> float:
    """Of as many markers in each region as there are, if they were spread over the area."""
    a, b, c = (body.template[body.faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    region = regions(body)
    shares = np.bincount(region[region >= 0], area[region >= 0], minlength=48)
    counts = np.bincount(region[faces], minlength=48)
    large = shares > 0.005 * shares.sum()
    counts = np.append(counts[large], counts[~large].sum())
    shares = np.append(shares[large], shares[~large].sum())
    return float(chisquare(counts, shares / shares.sum() * counts.sum()).pvalue)


def test_markers_are_spread_over_the_area_not_over_the_vertices(body: Body) -> None:
    number = {tuple(face): i for i, face in enumerate(body.faces)}
    faces = []
    for seed in range(10):
        sites = uniform_sites(body, FLAT, 250, np.random.default_rng(seed), apart=0)
        faces += [number[tuple(corners)] for corners in sites.corners]
    assert p_value(body, np.array(faces)) > 0.01
    every_face_alike = np.random.default_rng(0).choice(np.flatnonzero(markable(body)), len(faces))
    assert p_value(body, every_face_alike) < 1e-6, "the test could not tell"


def test_a_point_of_a_face_is_any_point_of_it(body: Body) -> None:
    shares = np.concatenate(
        [uniform_sites(body, FLAT, 250, np.random.default_rng(s), apart=0).shares for s in range(4)]
    )
    assert shares.min() >= 0
    np.testing.assert_allclose(shares.sum(axis=1), 1)
    np.testing.assert_allclose(shares.mean(axis=0), 1 / 3, atol=0.025)
    np.testing.assert_allclose(shares.var(axis=0), 1 / 18, atol=0.008)  # of the uniform law on a triangle


def test_markers_keep_their_distance_and_fewer_are_the_first_of_more(body: Body) -> None:
    fifty = uniform_sites(body, FLAT, 50, np.random.default_rng(3))
    twenty = uniform_sites(body, FLAT, 20, np.random.default_rng(3))
    np.testing.assert_array_equal(fifty.corners[:20], twenty.corners)
    np.testing.assert_array_equal(fifty.shares[:20], twenty.shares)
    points = np.einsum("mk,mka->ma", fifty.shares, body.template[fifty.corners])
    apart = np.linalg.norm(points[:, None] - points, axis=2) + np.eye(50)
    assert apart.min() >= 0.03
    assert body.marker_mask[fifty.corners].all()
    to_corners = np.linalg.norm(body.template[fifty.corners] - points[:, None], axis=2)
    own = np.linalg.norm(body.template[fifty.vertex] - points, axis=1)
    np.testing.assert_allclose(own, to_corners.min(axis=1))


@pytest.mark.parametrize("part", PARTS)
def test_a_part_has_markers_on_its_own_bones_alone_and_two_on_each(body: Body, part: str) -> None:
    for seed in range(4):
        bones = uniform_sites(body, FLAT, 10, np.random.default_rng(seed), part=part).joint
        counts = {JOINTS[j]: int(n) for j, n in enumerate(np.bincount(bones, minlength=24)) if n}
        assert set(counts) == set(PARTS[part]), counts
        assert min(counts.values()) >= 2, counts


def test_what_does_not_fit_is_refused(body: Body) -> None:
    with pytest.raises(InputError, match="do not fit 80 mm apart"):
        uniform_sites(body, FLAT, 40, np.random.default_rng(0), part="left_arm", apart=0.08)
    with pytest.raises(InputError, match="the left leg: 7 markers are too few for 4 bones; ask for 8 or more"):
        uniform_sites(body, FLAT, 7, np.random.default_rng(0), part="left_leg")


def test_the_height_is_the_distance_to_the_closest_point_of_the_skin(body: Body) -> None:
    triangles = pytest.importorskip("trimesh.triangles")
    varied = vary_body(body, np.random.default_rng(1))
    motion = demo_motion(varied, FLAT, rate=30)
    sites = uniform_sites(varied, FLAT, 50, np.random.default_rng(2)).raised(np.full(50, 9.5e-3))
    off, outside = [], []
    for frame in (0, 60):
        skin = varied.pose(motion.rotations[[frame]], FLAT, motion.trans[[frame]])[0][0][varied.faces]
        for marker in site_paths(varied, FLAT, motion, sites)[frame]:
            near = skin[np.argsort(np.linalg.norm(skin.mean(axis=1) - marker, axis=1))[:400]]
            closest = triangles.closest_point(near, np.tile(marker, (400, 1)))
            k = int(np.linalg.norm(closest - marker, axis=1).argmin())
            off.append(1000 * float(np.linalg.norm(closest[k] - marker)))
            a, b, c = near[k]
            outside.append((marker - closest[k]) @ np.cross(b - a, c - a) > 0)
    assert np.mean(outside) > 0.97, "markers are inside the body"
    assert np.median(off) == pytest.approx(9.5, abs=0.15), f"{np.median(off):.2f} mm"
    assert np.percentile(off, 10) > 8.5, f"a tenth is nearer than {np.percentile(off, 10):.1f} mm"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_named_layouts_are_on_both_sides_alike_or_on_their_part_alone(body: Body, layout: str) -> None:
    sites = named_sites(body, FLAT, layout)
    places = body.template[sites.vertex]
    apart = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(len(sites))
    assert apart.min() > 0.025, LAYOUTS[layout][int(apart.min(axis=1).argmin())]
    assert body.marker_mask[sites.vertex].all()
    if layout in PARTS:
        assert {JOINTS[j] for j in sites.joint} == set(PARTS[layout])
        return
    assert 26 <= len(sites) <= 47
    of = dict(zip(LAYOUTS[layout], places, strict=True))
    for name, place in of.items():
        if name.startswith("left_"):
            other = of["right_" + name[5:]] * [-1, 1, 1]
            assert np.linalg.norm(place - other) < 0.01, name


def test_named_places_are_where_their_names_say(body: Body) -> None:
    of = dict(zip(LAYOUTS["full_body"], body.template[named_sites(body, FLAT, "full_body").vertex], strict=True))
    joints = {name: body.joint_template[i] for name, i in INDEX.items()}
    assert of["left_front_head"][2] > of["left_back_head"][2] + 0.05
    assert of["left_asis"][2] > of["left_psis"][2] + 0.1
    assert of["sternum_ij"][2] > joints["spine3"][2] > of["t8"][2]
    assert of["left_thigh"][0] > joints["left_hip"][0] and of["left_shank"][0] > joints["left_knee"][0]
    assert joints["left_knee"][1] < of["left_thigh"][1] < joints["left_hip"][1]
    assert of["left_knee_lateral"][0] > joints["left_knee"][0] > of["left_knee_medial"][0]
    assert joints["left_shoulder"][0] < of["left_upper_arm"][0] < joints["left_elbow"][0] < of["left_forearm"][0]
    assert of["left_calcaneus"][2] < joints["left_ankle"][2] < of["left_meta1"][2]


def test_a_part_of_a_named_layout_is_what_lies_on_its_bones(body: Body) -> None:
    sites = named_sites(body, FLAT, "full_body", "right_leg")
    assert {JOINTS[j] for j in sites.joint} <= set(PARTS["right_leg"]) and len(sites) == 9


def test_misplaced_markers_are_as_far_from_their_places_as_was_asked(body: Body) -> None:
    sites = named_sites(body, FLAT, "full_body")
    before = np.einsum("mk,mka->ma", sites.shares, body.template[sites.corners])
    for by in (0.005, 0.02):
        moved = misplaced(body, FLAT, sites, by, np.random.default_rng(0))
        after = np.einsum("mk,mka->ma", moved.shares, body.template[moved.corners])
        off = np.linalg.norm(after - before, axis=1)
        assert np.median(off) == pytest.approx(by, rel=0.05) and off.max() < 1.3 * by
        assert body.marker_mask[moved.corners].all()
    away = after - before
    assert np.abs((away / np.linalg.norm(away, axis=1, keepdims=True)).mean(axis=0)).max() < 0.35
