"""From files to files: everything that a solve leaves, read back and held against what was simulated."""

from __future__ import annotations

import csv
import hashlib
import json
import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.commands import solve_session
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveOutcome, SolveRequest
from markerscope.solver.core.skeleton import BONES, INDEX, JOINTS
from markerscope.solver.io import load_markers
from markerscope.solver.io.mot import read_mot
from tests.fit.conftest import simulate
from tests.synthetic import Recording, record, session, watched

ALWAYS = {
    "angles.csv", "angles.json", "angles.mot", "motion.npz", "motion.bvh", "markers_labelled.c3d",
    "markers_labelled.trc", "markers_labelled.filled.csv", "report.html", "session.toml", "results",
    "in_force.json",
}  # fmt: skip


@dataclass(frozen=True)
class Solved:
    recording: Recording
    out: Path
    outcome: SolveOutcome

    @property
    def motion(self) -> dict[str, np.ndarray]:
        with np.load(self.out / "motion.npz", allow_pickle=False) as file:
            return dict(file)

    @property
    def error_mm(self) -> float:
        """MPJPE of the 22 joints that markers or landmarks can show."""
        return 1000 * float(np.linalg.norm(self.motion["joints"] - self.recording.joints, axis=2)[:, :22].mean())


@pytest.fixture(scope="module")
def by_prior(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    """C3D and another program's poses; no video."""
    folder = tmp_path_factory.mktemp("prior")
    made = record(folder, simulate(with_bone_lengths(Body.load()), 5, frames=120))
    out = folder / "out"
    return Solved(made, out, solve_session(session(out, made, prior=made.prior), silent))


@pytest.fixture(scope="module")
def by_video(tmp_path_factory: pytest.TempPathFactory) -> Solved:
    """TRC, y up, and a video alone."""
    folder = tmp_path_factory.mktemp("video")
    made = record(folder, simulate(with_bone_lengths(Body.load()), 6, frames=120, markers=60), ".trc", up="y")
    out = folder / "out"
    return Solved(made, out, solve_session(session(out, made, video=made.video), silent))


def test_what_is_left(by_prior: Solved, by_video: Solved) -> None:
    assert {path.name for path in by_prior.out.iterdir()} == ALWAYS
    assert {path.name for path in by_video.out.iterdir()} == ALWAYS | {"camera.json"}


@pytest.mark.parametrize("name", ["by_prior", "by_video"])
def test_the_truth_is_found(name: str, request: pytest.FixtureRequest) -> None:
    solved: Solved = request.getfixturevalue(name)
    assert solved.error_mm < 20, f"{name}: joints are {solved.error_mm:.1f} mm off (synthetic)"
    found = solved.motion["marker_joint"]
    right = np.mean(found == solved.recording.bones)
    assert right > 0.85, f"{name}: {100 * right:.0f} % of the markers on the right bone"
    sides = [{JOINTS[a].split("_")[0], JOINTS[b].split("_")[0]} for a, b in zip(found, solved.recording.bones)]
    assert not any({"left", "right"} <= side for side in sides)
    offset = solved.outcome.summary["sync"]["offset_s"]
    assert abs(offset - solved.recording.offset) < 0.03, f"{name}: {offset:.3f} s for {solved.recording.offset:.3f} s"


def test_the_motion_file(by_prior: Solved) -> None:
    motion, frames, count = by_prior.motion, len(by_prior.recording.joints), len(by_prior.recording.bones)
    shapes = {
        "poses": (frames, 72), "trans": (frames, 3), "betas": (10,), "mocap_frame_rate": (), "joints": (frames, 24, 3),
        "R_lab_internal": (3, 3), "marker_joint": (count,), "marker_vertex": (count,), "time": (frames,),
    }  # fmt: skip
    assert {name: motion[name].shape for name in shapes} == shapes
    assert motion["marker_joint"].dtype.kind == motion["marker_vertex"].dtype.kind == "i"
    assert all(np.isfinite(motion[name]).all() for name in shapes)
    assert float(motion["mocap_frame_rate"]) == pytest.approx(by_prior.recording.rate)
    np.testing.assert_allclose(motion["time"], np.arange(frames) / by_prior.recording.rate, atol=1e-6)
    np.testing.assert_array_equal(motion["R_lab_internal"], np.eye(3))


def test_the_pose_gives_the_joints_again(by_video: Solved) -> None:
    """By scipy's rotations and plain forward kinematics: trans is added to a root that turns about its rest place."""
    from scipy.spatial.transform import Rotation

    motion, body = by_video.motion, with_bone_lengths(Body.load())
    rest = body.joints(np.concatenate([motion["betas"], motion["bone_lengths"]]))
    turns = Rotation.from_rotvec(motion["poses"].reshape(-1, 3)).as_matrix().reshape(-1, 24, 3, 3)
    parents = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
    for t in (0, 50, len(turns) - 1):
        world, place = [turns[t, 0]], [rest[0] + motion["trans"][t]]
        for j in range(1, 24):
            place.append(place[parents[j]] + world[parents[j]] @ (rest[j] - rest[parents[j]]))
            world.append(world[parents[j]] @ turns[t, j])
        np.testing.assert_allclose(place, motion["joints"][t], atol=1e-6)


def test_joints_turn_into_the_file_s_axes(by_video: Solved) -> None:
    motion = by_video.motion
    x, y, z = np.moveaxis(motion["joints"], 2, 0)
    np.testing.assert_allclose(motion["joints"] @ motion["R_lab_internal"].T, np.stack([x, z, -y], 2), atol=1e-9)


def test_the_angles(by_video: Solved) -> None:
    with open(by_video.out / "angles.csv", newline="") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "time"
    assert {f"{a}_{s}" for a in ("hip_flexion", "knee_angle", "ankle_angle", "elbow_flex", "arm_add") for s in "rl"} | {
        "pelvis_tilt", "lumbar_extension"
    } <= set(header)  # fmt: skip
    table = np.array([[float(cell or "nan") for cell in row] for row in rows])
    motion = by_video.motion
    np.testing.assert_allclose(table[:, 0], motion["time"], atol=1e-5)
    for side, end in (("left", "l"), ("right", "r")):
        hip, knee, ankle = (motion["joints"][:, INDEX[f"{side}_{name}"]] for name in ("hip", "knee", "ankle"))
        thigh, shank = knee - hip, ankle - knee
        cosine = (thigh * shank).sum(1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
        bend = np.degrees(np.arccos(cosine))
        bent = bend > 20  # straighter, the angle between the bones is mostly sideways
        differ = np.abs(table[:, header.index(f"knee_angle_{end}")]) - bend  # the simulated knee bends either way
        assert bent.sum() > 20 and np.std(differ[bent]) < 3, f"{side} knee: {np.std(differ[bent]):.1f} degrees"
    stored = read_mot(by_video.out / "angles.mot")
    for name in ("knee_angle_r", "pelvis_tilt"):
        np.testing.assert_allclose(stored.columns[name], table[:, header.index(name)], atol=1e-3)


def test_the_angles_say_where_they_come_from(by_video: Solved) -> None:
    about = json.loads((by_video.out / "angles.json").read_text())
    assert about["convention"] == "opensim" and about["units"]["angles"] == "degrees" and about["zero_pose"]
    assert about["program"].startswith("markerscope ") and about["method"] == "bundle" and about["seed"] == 0
    markers = by_video.recording.markers
    assert about["inputs"]["marker_file"] == {
        "file": "trial.trc",
        "sha256": hashlib.sha256(markers.read_bytes()).hexdigest(),
    }
    assert about["stages"]["localize"]["settings"]["yaws"] == 8
    assert set(about["stages"]) == set(by_video.outcome.summary["seconds"])


def test_named_markers_in_c3d(by_prior: Solved) -> None:
    ezc3d = pytest.importorskip("ezc3d", reason="the package ezc3d is not installed")
    points = ezc3d.c3d(str(by_prior.out / "markers_labelled.c3d"))
    labels = points["parameters"]["POINT"]["LABELS"]["value"]
    bones = [BONES[JOINTS[j]] for j in by_prior.motion["marker_joint"]]
    assert [label.rsplit("_", 1)[0] for label in labels] == bones
    for bone in set(bones):
        numbers = sorted(int(label.rsplit("_", 1)[1]) for label in labels if label.rsplit("_", 1)[0] == bone)
        assert numbers == list(range(1, len(numbers) + 1)), bone
    residual = points["data"]["meta_points"]["residuals"][0].T
    measured = load_markers(by_prior.recording.markers, up="z").present
    np.testing.assert_array_equal(residual > 0, measured)
    np.testing.assert_array_equal(residual == 0, ~measured)
    positions = points["data"]["points"][:3].T / 1000
    given = load_markers(by_prior.recording.markers, up="z").positions
    np.testing.assert_allclose(positions[measured], given[measured], atol=1e-6)
    hidden = by_prior.recording.hidden
    error = 1000 * np.linalg.norm(positions - hidden, axis=2)[np.isfinite(hidden[..., 0])]
    assert len(error) > 40 and np.median(error) < 8, f"gaps are filled {np.median(error):.1f} mm off (median)"


def test_named_markers_in_trc(by_video: Solved) -> None:
    c3d, trc = (load_markers(by_video.out / f"markers_labelled.{kind}", up="y") for kind in ("c3d", "trc"))
    assert c3d.labels == trc.labels
    np.testing.assert_allclose(c3d.positions, trc.positions, atol=2e-6)
    assert c3d.filled is not None and trc.filled is not None and c3d.filled.any()
    np.testing.assert_array_equal(c3d.filled, trc.filled)


def test_the_skeleton_in_another_program(by_video: Solved) -> None:
    bvhio = pytest.importorskip("bvhio", reason="the package bvhio is not installed")
    root = bvhio.readAsHierarchy(str(by_video.out / "motion.bvh"))
    x, y, z = np.moveaxis(by_video.motion["joints"], 2, 0)
    expected = np.stack([x, z, -y], axis=2) * 100  # y up, cm
    for t in (0, 60):
        root.loadPose(t)
        found = {joint.Name: np.array(joint.PositionWorld) for joint, _, _ in root.layout()}
        for j, name in enumerate(JOINTS):
            np.testing.assert_allclose(found[name], expected[t, j], atol=0.02, err_msg=f"{name}, frame {t}")


def test_the_camera(by_video: Solved) -> None:
    camera = json.loads((by_video.out / "camera.json").read_text())
    true, size = by_video.recording.scene.camera, by_video.recording.scene.seen.image_size
    assert camera["image_size_px"] == list(size)
    turn = np.degrees(np.arccos((np.trace(true.R_lab_cam.T @ np.array(camera["R_lab_cam"])) - 1) / 2))
    assert turn < 4, f"camera is turned by {turn:.1f} degrees"
    seen = (by_video.motion["joints"][:, :22] - camera["position_m"]) @ np.array(camera["R_lab_cam"])
    pixels = camera["focal_px"] * seen[..., :2] / seen[..., 2:] + np.array(camera["image_size_px"]) / 2
    expected = true.project(by_video.recording.joints[:, :22], size)
    error = np.linalg.norm(pixels - expected, axis=2).mean()
    assert error < 6, f"joints appear {error:.1f} px off"


def test_the_report(by_video: Solved) -> None:
    page = (by_video.out / "report.html").read_text()
    assert "trial.trc" in page and "Knee angle" in page and "left_shank_1" in page.replace(" ", "_")
    assert 'src="http' not in page and 'href="http' not in page


def test_the_session(by_video: Solved) -> None:
    content = tomllib.loads((by_video.out / "session.toml").read_text())
    assert content["inputs"]["marker_file"]["path"] == "../trial.trc"
    assert content["inputs"]["video_file"]["sha256"] == hashlib.sha256(b"no decoder reads this").hexdigest()
    assert content["run"] == {"method": "bundle", "seed": 0}


def test_the_summary(by_video: Solved) -> None:
    summary = json.loads(json.dumps(by_video.outcome.summary))
    assert summary["part"] == "whole body" and summary["frames"] == len(by_video.recording.joints)
    assert summary["energy"] == pytest.approx(sum(summary["energies"].values()))
    assert 5 < summary["m2s_mm"] < 15, "markers stand 9.5 mm off the skin"
    assert summary["computed"] == [name for name in summary["seconds"] if name != "landmarks"]


def test_a_leg_on_its_own_with_the_camera_of_the_whole_body(by_video: Solved, tmp_path: Path) -> None:
    whole = by_video.recording
    legs = np.isin(whole.scene.bones, [INDEX[f"left_{name}"] for name in ("hip", "knee", "ankle", "foot")])
    made = record(tmp_path, whole.scene, ".trc", up="y", only=legs)
    out = tmp_path / "leg"
    solved = Solved(made, out, solve_session(session(out, made, video=made.video, camera=by_video.out), silent))
    assert solved.outcome.summary["part"] == "left leg"
    sides = {JOINTS[j].split("_")[0] for j in solved.motion["marker_joint"]}
    assert sides == {"left"}
    error = 1000 * np.linalg.norm(solved.motion["joints"] - made.joints, axis=2)[:, [4, 7]].mean()
    assert error < 45, f"knee and ankle are {error:.1f} mm off (synthetic, {legs.sum()} markers)"


def test_a_range_with_a_given_offset(by_video: Solved, tmp_path: Path) -> None:
    made, out = by_video.recording, tmp_path / "part"
    asked = session(out, made, video=made.video, offset=made.offset, range=(1.0, 2.5))
    solved = Solved(made, out, solve_session(asked, silent))
    time = solved.motion["time"]
    assert 1.0 <= time[0] < 1.04 and 2.46 < time[-1] <= 2.5
    inside = np.flatnonzero((by_video.motion["time"] >= 1) & (by_video.motion["time"] <= 2.5))
    error = 1000 * np.linalg.norm(solved.motion["joints"] - made.joints[inside], axis=2)[:, :22].mean()
    assert error < 20, f"joints are {error:.1f} mm off"
    assert solved.outcome.summary["sync"] == {"offset_s": made.offset, "rate_ratio": 1.0, "confidence": 1.0}
    assert load_markers(out / "markers_labelled.c3d", up="y").time[0] == pytest.approx(time[0], abs=1e-3)


def test_a_user_s_own_body(by_prior: Solved, tmp_path: Path) -> None:
    """The embedded body's coarse mesh in the layout of an SMPL file is another body of nearly the same shape."""
    body = tmp_path / "SMPL_OWN.npz"
    _write_smpl(body, Body.load())
    made, out = by_prior.recording, tmp_path / "own"
    solved = Solved(made, out, solve_session(session(out, made, prior=made.prior, body=body), silent))
    assert solved.error_mm < 35, f"joints are {solved.error_mm:.1f} mm off"
    assert solved.motion["marker_vertex"].max() < len(Body.load().lod_index)
    about = json.loads((out / "angles.json").read_text())
    assert about["inputs"]["body_file"]["file"] == "SMPL_OWN.npz"


def _write_smpl(path: Path, body: Body) -> None:
    """Joints as a regressor over the coarse mesh: the least one that is exact for the mean and every shape."""
    own = body.lod_index
    template, dirs = body.template[own], body.shape_dirs[own]
    regressor = np.zeros((24, len(own)))
    for j in range(24):
        near = np.argsort(np.linalg.norm(template - body.joint_template[j], axis=1))[:300]
        rows = np.concatenate([template[near].T, dirs[near].reshape(len(near), -1).T, np.ones((1, len(near)))])
        wanted = np.concatenate([body.joint_template[j], body.joint_dirs[j].ravel(), [1.0]])
        regressor[j, near] = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    parents = np.array([2**32 - 1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21])
    np.savez(
        path, v_template=template, shapedirs=dirs, J_regressor=regressor, weights=body.weights[own], f=body.lod_faces,
        kintree_table=np.stack([parents, np.arange(24)]),
    )  # fmt: skip


def test_poses_and_a_video_together(by_video: Solved, tmp_path: Path) -> None:
    """Poses that do not say their rate are on the clock of the video's frames."""
    made = by_video.recording
    nameless = tmp_path / "poses.npz"
    with np.load(made.prior) as file:
        np.savez(nameless, **{name: file[name] for name in file if name != "mocap_frame_rate"})
    from markerscope.solver.pipeline.inputs import PriorSettings, pose_prior

    found = pose_prior(PriorSettings(), silent, prior_file=nameless, landmarks=watched(made))
    np.testing.assert_allclose(np.diff(found.time), 1 / made.rate, rtol=1e-6)
    assert not any("assumed" in note for note in found.notes)
    alone = pose_prior(PriorSettings(), silent, prior_file=nameless, landmarks=None)
    assert any("30 Hz is assumed" in note for note in alone.notes)


def test_the_folder_moves_with_its_inputs(by_prior: Solved, tmp_path: Path) -> None:
    there = tmp_path / "elsewhere"
    shutil.copytree(by_prior.out.parent, there)
    before = {path: path.stat().st_mtime_ns for path in there.rglob("*") if path.is_file()}
    outcome = solve_session(SolveRequest(there / "out"), silent)
    assert outcome.summary["computed"] == [] and outcome.out == there / "out"
    after = {path: path.stat().st_mtime_ns for path in there.rglob("*") if path.is_file()}
    after.pop(there / "out" / "results" / "digests.json", None)
    before.pop(there / "out" / "results" / "digests.json", None)
    assert after == before
