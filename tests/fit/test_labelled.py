"""The labelled baseline finds a known body again from markers whose places it is told."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import BONES, INDEX, JOINTS, PARTS
from markerscope.solver.fit.kinematics import Pose, forward, place_points
from markerscope.solver.fit.labelled.places import places_of, read_places
from markerscope.solver.fit.labelled.solve import LabelledSettings, solve_labelled
from markerscope.solver.fit.labelled.start import rigid_starts
from markerscope.solver.fit.placement import Skin
from markerscope.solver.synth import place_markers, vary_body
from tests.fit.conftest import Scene

RATE = 15.0


def recorded(
    scene: Scene, *, counts: dict[str, int] | None = None, body: Body | None = None
) -> tuple[Markers, dict[str, int], np.ndarray]:
    """The scene's motion with markers on known vertices: the recording, label -> vertex, and the (T, 24, 3) m joints.

    Parameters
    ----------
    counts : markers on each bone, by the joint's name; a whole body where it is None
    body : moves as the scene does, where it is another one than the solver has
    """
    true = body or scene.body
    rng = np.random.default_rng(1)
    vertices = place_markers(true, scene.pose.betas, rng, counts=counts).vertex
    placement, _ = Skin(true, scene.pose.betas).on_vertices(vertices, 0.0095)
    links = forward(true, scene.pose)
    positions = place_points(placement, links, scene.pose.betas)
    positions = positions + rng.normal(0, 5e-4, positions.shape)
    labels = tuple(f"L{i:02d}" for i in range(len(vertices)))
    return Markers(positions, RATE, labels), dict(zip(labels, vertices.tolist(), strict=True)), links.place


def errors_mm(found: np.ndarray, joints: np.ndarray, names: tuple[str, ...] | list[str] = JOINTS[:22]) -> np.ndarray:
    """(T, n) mm."""
    index = [INDEX[name] for name in names]
    return np.asarray(1000 * np.linalg.norm(found - joints, axis=2)[:, index])


def test_a_body_within_the_shapes_is_found(scene: Scene) -> None:
    markers, known, joints = recorded(scene)
    motion = solve_labelled(scene.body, markers, known)
    error = errors_mm(motion.joints, joints)
    assert error.mean() < 10, f"joints are {error.mean():.1f} mm off"
    assert error.mean(axis=1).max() < 15, f"in the worst frame joints are {error.mean(axis=1).max():.1f} mm off"
    miss = 1000 * np.nanmedian(motion.residual)
    assert miss < 2, f"markers are {miss:.1f} mm from their places"
    assert np.array_equal(motion.time, markers.time)
    assert motion.warnings == ()


def test_a_body_outside_the_shapes_is_found(scene: Scene) -> None:
    other = vary_body(scene.body, np.random.default_rng(3))
    markers, known, joints = recorded(scene, body=other)
    motion = solve_labelled(scene.body, markers, known)
    error = errors_mm(motion.joints, joints)
    assert error.mean() < 20, f"joints are {error.mean():.1f} mm off"


def test_bones_alone_are_enough(scene: Scene) -> None:
    markers = Markers(scene.seen.markers, RATE, tuple(f"M{i}" for i in range(len(scene.bones))))
    known = {label: BONES[JOINTS[bone]] for label, bone in zip(markers.labels, scene.bones, strict=True)}
    motion = solve_labelled(scene.body, markers, known)
    error = errors_mm(motion.joints, scene.joints)
    assert error.mean() < 25, f"joints are {error.mean():.1f} mm off"
    assert np.array_equal(motion.marker_joint, scene.bones)
    on = scene.body.weights[motion.marker_vertex].argmax(axis=1)
    share = (on == scene.bones).mean()
    assert share > 0.75, f"only {share:.2f} of the markers end above their bone"


@pytest.mark.parametrize("part", ["right_arm", "left_leg"])
def test_a_part_of_the_body_is_found(scene: Scene, part: str) -> None:
    markers, known, joints = recorded(scene, counts=dict.fromkeys(PARTS[part], 4))
    motion = solve_labelled(scene.body, markers, known)
    error = errors_mm(motion.joints, joints, PARTS[part])
    assert error.mean() < 30, f"joints of the {part} are {error.mean():.1f} mm off"
    assert np.isfinite(motion.joints).all()


def test_lost_markers_are_bridged_by_the_others(scene: Scene) -> None:
    markers, known, joints = recorded(scene)
    rng = np.random.default_rng(5)
    lost = rng.random(markers.present.shape) < 0.3
    lost[20:23] = True
    lost[:, 7] = True
    lost[:, 7][:2] = False
    gappy = replace(markers, positions=np.where(lost[..., None], np.nan, markers.positions))
    motion = solve_labelled(scene.body, gappy, known)
    seen = np.ones(len(joints), bool)
    seen[20:23] = False
    error = errors_mm(motion.joints, joints)[seen]
    assert error.mean() < 14, f"joints are {error.mean():.1f} mm off with 30 % of the samples lost"
    assert np.isfinite(motion.rotations).all()
    unseen = errors_mm(motion.joints, joints)[20:23].mean()
    assert unseen < 150, f"joints are {unseen:.0f} mm off where nothing was seen"


def test_markers_of_unknown_place_are_left_out_and_said_to_be(scene: Scene) -> None:
    markers, known, joints = recorded(scene)
    thrown = replace(markers, positions=np.where(np.arange(len(known))[:, None] < 4, 30.0, markers.positions))
    kept = {label: vertex for label, vertex in known.items() if int(label[1:]) >= 4} | {"GONE": 7}
    motion = solve_labelled(scene.body, thrown, kept)
    assert (motion.marker_joint[:4] == -1).all()
    assert np.isnan(motion.residual[:, :4]).all()
    assert (motion.marker_joint[4:] >= 0).all()
    assert errors_mm(motion.joints, joints).mean() < 12
    assert motion.warnings == (
        "Markers without a known place were left out: L00, L01, L02, L03.",
        "Not among the recorded markers: GONE.",
    )


def test_one_start_is_exact_for_a_rigid_body_that_lies_down(free_body: Body) -> None:
    from markerscope.solver.core.rotations import exp_so3
    from markerscope.solver.fit import anatomical

    rng = np.random.default_rng(2)
    skin = Skin(free_body, np.zeros(free_body.shape_count))
    points, _ = skin.on_vertices(rng.choice(skin.index, 20, replace=False), 0.0095)
    rotations = np.repeat(anatomical.mean_pose()[None], 5, axis=0)
    rotations[:, 0] = exp_so3(rng.normal(0, 1.5, (5, 3)))
    pose = Pose(rotations, rng.normal(0, 1, (5, 3)), skin.betas)
    positions = place_points(points, forward(free_body, pose), skin.betas)
    positions[2] = np.nan
    free, upright = rigid_starts(free_body, points, positions, skin.betas)
    for frame in (0, 1, 3, 4):
        assert np.allclose(free.rotations[frame], rotations[frame], atol=1e-9)
        assert np.allclose(free.trans[frame], pose.trans[frame], atol=1e-9)
    up = upright.rotations[:, 0] @ np.array([0.0, 1, 0])
    assert np.allclose(up, [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("known", "message"),
    [
        ({"L00": "elbow", "L01": 5, "L02": 6}, '"elbow" of L00 is no bone'),
        ({"L00": 10**6, "L01": 5, "L02": 6}, "L00 is on vertex 1000000"),
        ({"L00": -1, "L01": 5, "L02": 6}, "L00 is on vertex -1"),
        ({"L00": 1.5, "L01": 5, "L02": 6}, "neither a bone's name nor a vertex"),
        ({"L00": True, "L01": 5, "L02": 6}, "neither a bone's name nor a vertex"),
        ({"L00": 4, "X": 5, "Y": 6}, "names only 1 of the 4 recorded markers"),
        ({}, "names only 0"),
    ],
)
def test_a_bad_mapping_ends_in_one_sentence(free_body: Body, known: dict[str, str | int], message: str) -> None:
    with pytest.raises(InputError) as told:
        places_of(free_body, ("L00", "L01", "L02", "L03"), known)
    assert message in str(told.value)
    assert "\n" not in str(told.value)


def test_a_bone_can_be_named_by_its_joint_unless_another_bone_is_called_so(free_body: Body) -> None:
    labels = ("A", "B", "C")
    by_joint = places_of(free_body, labels, {"A": "left_knee", "B": "left_ankle", "C": "left_hand"})
    by_bone = places_of(free_body, labels, {"A": "left_shank", "B": "left_foot", "C": "left_hand"})
    wanted = [INDEX["left_knee"], INDEX["left_ankle"], INDEX["left_wrist"]]
    assert by_joint.bone.tolist() == by_bone.bone.tolist() == wanted


def test_vertices_that_are_a_thumb_off_cost_little(scene: Scene) -> None:
    markers, known, joints = recorded(scene)
    skin = Skin(scene.body, np.zeros(scene.body.shape_count))
    rng = np.random.default_rng(8)
    missed, off = {}, []
    for label, vertex in known.items():
        near = np.linalg.norm(skin.surface[skin.index] - skin.surface[vertex], axis=1)
        missed[label] = int(rng.choice(skin.index[np.argsort(near)[1:7]]))
        off.append(np.linalg.norm(skin.surface[missed[label]] - skin.surface[vertex]))
    assert np.mean(off) > 0.012
    motion = solve_labelled(scene.body, markers, missed)
    error = errors_mm(motion.joints, joints)
    assert error.mean() < 20, f"joints are {error.mean():.1f} mm off where hands missed by {1000 * np.mean(off):.0f} mm"


@pytest.mark.parametrize("content", ["", "[1, 2]", "{", '{"a": NaN'])
def test_a_file_that_is_no_mapping_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "labels.json"
    path.write_text(content)
    with pytest.raises(InputError, match=r"JSON|labels|empty"):
        read_places(path)


def test_a_mapping_is_read(tmp_path: Path) -> None:
    path = tmp_path / "labels.json"
    path.write_text(json.dumps({"C7": 5120, "LKNE": "left_shank"}))
    assert read_places(path) == {"C7": 5120, "LKNE": "left_shank"}


def test_nothing_in_sight_is_refused(scene: Scene) -> None:
    markers, known, _ = recorded(scene)
    empty = replace(markers, positions=np.full_like(markers.positions, np.nan))
    with pytest.raises(InputError, match="at no time are 3 of the markers in sight"):
        solve_labelled(scene.body, empty, known)


@pytest.mark.parametrize("name", ["keyframes", "offset_spread_mm", "stray_mm", "shape", "anatomical"])
def test_settings_that_cannot_work_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=name):
        LabelledSettings(**{name: 0})
