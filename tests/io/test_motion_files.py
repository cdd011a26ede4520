"""MOT, BVH, ASF/AMC and SMPL parameters: other programs' reading, round trips, real recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.io import load_markers
from markerscope.solver.io.asf_amc import read_asf_amc
from markerscope.solver.io.bvh import read_bvh
from markerscope.solver.io.export_bvh import write_bvh
from markerscope.solver.io.export_mot import write_mot
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.mot import read_mot
from markerscope.solver.io.motion import euler_matrix

relaxed = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
Motion = tuple[np.ndarray, np.ndarray, np.ndarray]


def random_motion(seed: int, frames: int = 4, joints: int = 24) -> Motion:
    """Offsets (J, 3) m, rotations (T, J, 3, 3) of any size, root places (T, 3) m."""
    rng = np.random.default_rng(seed)
    rotations = Rotation.random(frames * joints, rng=rng).as_matrix().reshape(frames, joints, 3, 3)
    return rng.normal(scale=0.2, size=(joints, 3)), rotations, rng.normal(size=(frames, 3))


def joint_places(parents: np.ndarray, motion: Motion) -> np.ndarray:
    """(T, J, 3) m, each joint's place in the root's surroundings, by the definition of a chain."""
    offsets, rotations, root = motion
    places = np.empty((*rotations.shape[:2], 3))
    for t in range(len(rotations)):
        pose: list[np.ndarray] = []
        for j, parent in enumerate(parents):
            step = np.eye(4)
            step[:3, :3] = rotations[t, j]
            step[:3, 3] = root[t] if parent < 0 else offsets[j]
            pose.append(step if parent < 0 else pose[parent] @ step)
        places[t] = [matrix[:3, 3] for matrix in pose]
    return places


@relaxed
@given(seed=st.integers(0, 2**32))
def test_bvh_round_trip(tmp_path: Path, seed: int) -> None:
    motion = random_motion(seed)
    write_bvh(tmp_path / "a.bvh", JOINTS, PARENTS, *motion, 120)
    back = read_bvh(tmp_path / "a.bvh")
    assert back.rate == 120
    order = [back.names.index(name) for name in JOINTS]
    error = np.abs(back.joint_positions()[:, order] - joint_places(PARENTS, motion)).max()
    assert error < 2e-6, f"{error} m"
    error = np.abs(back.rotations[:, order] - motion[1]).max()
    assert error < 1e-6, f"{error}"
    ends = np.linalg.norm(back.ends, axis=1)[order]
    leaves = ~np.isin(np.arange(24), PARENTS)
    assert (ends[leaves] > 0.01).all() and (ends[~leaves] == 0).all()


def test_bvhio_finds_the_same_joints(tmp_path: Path) -> None:
    bvhio = pytest.importorskip("bvhio", reason="the package bvhio is not installed")
    motion = random_motion(7)
    write_bvh(tmp_path / "a.bvh", JOINTS, PARENTS, *motion, 50)
    assert bvhio.readAsBvh(str(tmp_path / "a.bvh")).FrameTime == pytest.approx(0.02)
    root = bvhio.readAsHierarchy(str(tmp_path / "a.bvh"))
    x, y, z = np.moveaxis(joint_places(PARENTS, motion), 2, 0)
    expected = np.stack([x, z, -y], axis=2) * 100  # y up, cm
    for t in range(4):
        root.loadPose(t)
        found = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root.layout()}
        for j, name in enumerate(JOINTS):
            np.testing.assert_allclose(found[name], expected[t, j], atol=1e-2, err_msg=f"{name}, frame {t}")


def test_bvh_at_the_singular_angle_and_with_odd_names(tmp_path: Path) -> None:
    offsets, _, root = random_motion(1, frames=2, joints=2)
    quarter = euler_matrix("zxy", np.array([[[0.3, np.pi / 2, 0.4]] * 2, [[0.3, -np.pi / 2, 0.4]] * 2]))
    write_bvh(tmp_path / "a.bvh", ["the hips {1}", "the hips {1}"], [-1, 0], offsets, quarter, root, 29.97)
    back = read_bvh(tmp_path / "a.bvh")
    assert back.names == ("the_hips_1_", "the_hips_1__2")
    assert back.rate == pytest.approx(29.97)
    np.testing.assert_allclose(back.rotations, quarter, atol=2e-6)


def test_bvh_with_positions_on_every_joint(shared_data: Path) -> None:
    bvhio = pytest.importorskip("bvhio", reason="the package bvhio is not installed")
    path = shared_data / "motion/bandai/dataset-1_run_normal_001.bvh"
    motion = read_bvh(path)
    assert motion.rate == 30
    heights = motion.joint_positions()[..., 2]
    assert -0.05 < heights.min() < 0.2 and 1.2 < heights.max() < 1.9
    root = bvhio.readAsHierarchy(str(path))
    root.loadPose(11)
    found = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root.layout()}
    x, y, z = np.moveaxis(motion.joint_positions()[11], 1, 0)
    for name, place in zip(motion.names, np.stack([x, z, -y], axis=1)):
        np.testing.assert_allclose(found[name] / 100, place, atol=1e-4, err_msg=name)


@given(st.permutations("xyz"), st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_euler_products(axes: list[str], angles: list[float]) -> None:
    expected = Rotation.from_euler("".join(axes).upper(), angles).as_matrix()
    np.testing.assert_allclose(euler_matrix(axes, np.array(angles)), expected, atol=1e-12)


def test_acclaim_skeleton_carries_the_markers_of_the_same_trial(shared_data: Path) -> None:
    folder = shared_data / "motion/cmu"
    motion = read_asf_amc(folder / "02.asf", folder / "02_05.amc")
    markers = load_markers(shared_data / "fullbody/cmu_02_05.c3d")
    assert len(motion.rotations) == len(markers.positions)
    # The laboratory's (x, y, z) is the skeleton's (z, x, y): a quarter turn about the vertical in our frame.
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    ends = motion.end_positions() @ quarter.T
    for bone, label, near in (
        ("rtibia", "RANK", 0.06), ("ltibia", "LANK", 0.06), ("rfemur", "RKNE", 0.09), ("lfemur", "LKNE", 0.09),
        ("rhumerus", "RELB", 0.08), ("lhumerus", "LELB", 0.08),
    ):  # fmt: skip
        marker = markers.positions[:, markers.labels.index(label)]
        distance = np.linalg.norm(marker - ends[:, motion.names.index(bone)], axis=1)
        assert np.nanmean(distance) < near, f"{label} is {np.nanmean(distance):.3f} m from the end of {bone}"
        assert np.nanstd(distance) < 0.015, f"{label} moves {np.nanstd(distance):.3f} m against {bone}"


def test_motion_of_another_skeleton_is_refused(shared_data: Path, tmp_path: Path) -> None:
    (tmp_path / "a.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n1\nroot 0 0 0 0 0 0\ntail 1\n")
    with pytest.raises(InputError, match="AMC motion of that skeleton"):
        read_asf_amc(shared_data / "motion/cmu/02.asf", tmp_path / "a.amc")
    with pytest.raises(InputError, match="ASF skeleton"):
        read_asf_amc(tmp_path / "a.amc", tmp_path / "a.amc")


@pytest.mark.parametrize("degrees", [True, False])
def test_mot_round_trip_and_opensim(tmp_path: Path, degrees: bool) -> None:
    rng = np.random.default_rng(3)
    time = 2.5 + np.arange(40) / 59.94
    columns = {"pelvis_tilt": rng.normal(size=40) * 30, "pelvis_tx": rng.normal(size=40), "knee_angle_r": time * 7}
    columns["knee_angle_r"][5] = np.nan
    write_mot(tmp_path / "a.mot", time, columns, degrees)
    write_mot(tmp_path / "b.mot", time, (list(columns), np.stack([*columns.values()], axis=1)), degrees)
    assert (tmp_path / "a.mot").read_bytes() == (tmp_path / "b.mot").read_bytes()
    lines = (tmp_path / "a.mot").read_text().split("\n")
    assert lines[:5] == [
        "Coordinates",
        "version=1",
        "nRows=40",
        "nColumns=4",
        f"inDegrees={'yes' if degrees else 'no'}",
    ]
    back = read_mot(tmp_path / "a.mot")
    assert back.degrees is degrees
    np.testing.assert_allclose(back.time, time, rtol=1e-8)
    for name, values in columns.items():
        np.testing.assert_allclose(back.columns[name], values, rtol=1e-8, atol=1e-12)
    turned = back.in_degrees()
    np.testing.assert_allclose(turned["pelvis_tx"], columns["pelvis_tx"], rtol=1e-8)
    expected = columns["pelvis_tilt"] if degrees else np.degrees(columns["pelvis_tilt"])
    np.testing.assert_allclose(turned["pelvis_tilt"], expected, rtol=1e-8)
    opensim = pytest.importorskip("opensim", reason="the package opensim is not installed")
    table = opensim.TimeSeriesTable(str(tmp_path / "a.mot"))
    assert list(table.getColumnLabels()) == list(columns)
    assert table.getTableMetaDataString("inDegrees") == ("yes" if degrees else "no")
    np.testing.assert_allclose(table.getIndependentColumn(), time, rtol=1e-8)
    for name, values in columns.items():
        np.testing.assert_allclose(table.getDependentColumn(name).to_numpy(), values, rtol=1e-8, err_msg=name)


def test_mot_of_opensim(shared_data: Path) -> None:
    storage = read_mot(shared_data / "squat_video/squats1_ik.mot")
    assert storage.degrees is False
    assert len(storage.time) == 1346
    assert storage.in_degrees()["knee_angle_r"].max() == pytest.approx(99.0, abs=0.1)
    assert storage.in_degrees()["pelvis_ty"].max() == pytest.approx(0.972, abs=1e-3)


def test_smpl_npz_is_plain(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    poses, trans, betas = rng.normal(size=(5, 72)), rng.normal(size=(5, 3)), rng.normal(size=10)
    write_smpl_npz(tmp_path / "a.npz", poses, trans, betas, 59.94, {"time": np.arange(5), "note": "hello"})
    with np.load(tmp_path / "a.npz", allow_pickle=False) as back:
        np.testing.assert_array_equal(back["poses"], poses)
        np.testing.assert_array_equal(back["trans"], trans)
        np.testing.assert_array_equal(back["betas"], betas)
        assert float(back["mocap_frame_rate"]) == 59.94
        assert str(back["gender"]) == "neutral" and str(back["note"]) == "hello"
        assert back["time"].tolist() == [0, 1, 2, 3, 4]
    with pytest.raises(InputError, match="plain arrays"):
        write_smpl_npz(tmp_path / "b.npz", poses, trans, betas, 60, {"what": np.array([{}])})
    assert [p.name for p in tmp_path.iterdir()] == ["a.npz"]


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (read_mot, "time\ta\n0\t1\n"),
        (read_mot, "x\nendheader\n"),
        (read_mot, "x\nendheader\na\tb\n1\t2\n"),
        (read_mot, "nRows=3\nendheader\ntime\tb\n1\t2\n2\t3\n"),
        (read_bvh, "HIERARCHY\n"),
        (read_bvh, "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0"),
        (read_bvh, "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Xrotation } MOTION Frames: 2 Frame Time: 0.1 5"),
        (read_bvh, "HIERARCHY ROOT a { OFFSET 0 0 0 CHANNELS 1 Wrotation } MOTION Frames: 1 Frame Time: 0.1 5"),
    ],
)
def test_refusals(tmp_path: Path, read: Callable[[Path], object], text: str) -> None:
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError, match=r"a\.txt"):
        read(tmp_path / "a.txt")
