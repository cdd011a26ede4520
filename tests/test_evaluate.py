"""Evaluating a result: known differences put in, the same figures read out."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import EvaluateRequest
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.evaluate.evaluate import evaluate, evaluate_result, lines_of, summary_of
from markerscope.solver.io.motion_in import read_motion

RATE, FRAMES = 50.0, 60


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


def moving(frames: int = FRAMES, rate: float = RATE) -> tuple[np.ndarray, np.ndarray]:
    """Smooth poses (T, 24, 3) rad, root upright in a z-up room, and places (T, 3) m."""
    time = np.arange(frames)[:, None, None] / rate
    rng = np.random.default_rng(0)
    poses = 0.3 * np.sin(2 * time + rng.uniform(0, 6, (1, 24, 3))) * rng.uniform(0, 1, (1, 24, 3))
    turn = Rotation.from_euler("z", 30 * time[:, 0], degrees=True) * Rotation.from_euler("x", 90, degrees=True)
    poses[:, 0] = turn.as_rotvec()
    return poses, np.stack([0.5 * time[:, 0, 0], 0 * time[:, 0, 0], 0.9 + 0 * time[:, 0, 0]], axis=1)


def write(
    path: Path, body: Body, poses: np.ndarray, trans: np.ndarray, changes: dict[str, Any] | None = None, **more: Any
) -> Path:
    rotations = Rotation.from_rotvec(poses.reshape(-1, 3)).as_matrix().reshape(*poses.shape, 3)
    betas = np.linspace(-1, 1, 10)
    arrays: dict[str, Any] = {
        "poses": poses.reshape(len(poses), -1),
        "trans": trans,
        "betas": betas,
        "mocap_frame_rate": RATE,
        "joints": body.pose(rotations, betas, trans, want_vertices=False)[1],
        "time": 2.0 + np.arange(len(poses)) / RATE,
    }
    arrays = {name: value for name, value in {**arrays, **more, **(changes or {})}.items() if value is not None}
    path.parent.mkdir(exist_ok=True)
    np.savez(path, **arrays)
    return path


def test_a_result_equals_itself(tmp_path: Path, body: Body) -> None:
    path = write(tmp_path / "out" / "motion.npz", body, *moving())
    found = evaluate(path.parent, path)
    figures = summary_of(found)
    for name in ("mpjpe_mm", "pa_mpjpe_mm", "mpjve_mm_s", "v2v_mm"):
        assert figures[name] < 1e-6, f"{name} {figures[name]}"
    assert all(a.rmse < 1e-9 for a in found.angles.values())
    assert np.isnan(found.m2s), "there are no markers in that folder"


def test_a_shift_is_found_in_joints_and_surface_alone(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    result = write(tmp_path / "a.npz", body, poses, trans + np.array([0.003, 0.0, 0.004]))
    reference = write(tmp_path / "b.npz", body, poses, trans)
    figures = summary_of(evaluate(result, reference))
    assert figures["mpjpe_mm"] == pytest.approx(5)
    assert figures["v2v_mm"] == pytest.approx(5)
    assert figures["pa_mpjpe_mm"] == pytest.approx(0, abs=1e-6)
    assert figures["mpjve_mm_s"] == pytest.approx(0, abs=1e-6)


def test_a_drift_is_a_velocity_in_every_joint(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    drift = np.arange(FRAMES)[:, None] / RATE * np.array([0.03, 0.0, 0.04])
    result = write(tmp_path / "a.npz", body, poses, trans + drift)
    figures = summary_of(evaluate(result, write(tmp_path / "b.npz", body, poses, trans)))
    assert figures["mpjve_mm_s"] == pytest.approx(50)
    assert figures["mpjpe_mm"] == pytest.approx(50 * (FRAMES - 1) / RATE / 2)


def test_a_bent_knee_is_found_in_its_angle(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    poses[:, INDEX["left_knee"]] = 0
    bent = poses.copy()
    poses[:, INDEX["left_knee"], 0], bent[:, INDEX["left_knee"], 0] = 0.6, 0.6 + np.radians(7)
    found = evaluate(write(tmp_path / "a.npz", body, bent, trans), write(tmp_path / "b.npz", body, poses, trans))
    knee = found.angles["knee_angle_l"]
    assert np.degrees(knee.rmse) == pytest.approx(7, abs=0.3), np.degrees(knee.rmse)
    assert np.degrees(knee.rmse_less_offset) < 0.3
    assert np.degrees(found.angles["knee_angle_r"].rmse) < 1e-6
    assert found.mpjpe.per_point[INDEX["left_ankle"]] > 0.02 > found.mpjpe.per_point[INDEX["right_ankle"]] + 0.019


def test_another_frame_rate_and_a_shorter_reference(tmp_path: Path, body: Body) -> None:
    result = write(tmp_path / "a.npz", body, *moving())
    poses, trans = moving(240, 250.0)
    reference = write(
        tmp_path / "b.npz", body, poses[60:], trans[60:], mocap_frame_rate=250.0, time=2.0 + np.arange(60, 240) / 250
    )
    found = evaluate(result, reference)
    assert found.time[0] == pytest.approx(2.24) and found.time[-1] <= 2 + 239 / 250
    assert found.mpjpe.mean < 2e-4, f"{found.mpjpe.mean * 1000:.3f} mm"
    assert max(a.rmse for a in found.angles.values()) < np.radians(0.3)


def test_a_reference_with_neither_clock_nor_joints(tmp_path: Path, body: Body) -> None:
    result = write(tmp_path / "a.npz", body, *moving())
    found = evaluate(result, write(tmp_path / "b.npz", body, *moving(), time=None, joints=None))
    assert found.mpjpe.mean < 1e-9 and len(found.time) == FRAMES
    assert any("start with the result" in n for n in found.notes) and any("embedded body" in n for n in found.notes)


def test_bone_lengths_of_a_result_are_used(tmp_path: Path, body: Body) -> None:
    from markerscope.solver.body.bones import with_bone_lengths

    longer = np.zeros(with_bone_lengths(body).shape_count - body.betas_count)
    longer[0] = 2
    result = write(tmp_path / "a.npz", body, *moving(), joints=None, bone_lengths=longer)
    found = evaluate(result, write(tmp_path / "b.npz", body, *moving()))
    assert found.mpjpe.per_point[INDEX["left_ankle"]] > 0.01 and found.mpjpe.per_point[INDEX["left_hip"]] < 0.01


def test_markers_are_measured_to_both_surfaces(tmp_path: Path, body: Body, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("open3d")
    from markerscope.solver.core.markers import Markers

    poses, trans = moving()
    result = write(tmp_path / "out" / "motion.npz", body, poses, trans)
    reference = write(tmp_path / "b.npz", body, poses, trans + np.array([0, 0, 0.2]))
    motion = read_motion(result)
    mesh = body.pose(motion.rotations, motion.betas, motion.trans)[0]
    picked = np.linspace(0, len(body.template) - 1, 30).astype(int)
    filled = np.zeros((FRAMES, 30), bool)
    filled[::2, 3] = True
    positions = np.where(filled[..., None], 99.0, mesh[:, picked])
    markers = Markers(positions, RATE, tuple(map(str, range(30))), first_time=2.0, filled=filled)
    monkeypatch.setattr("markerscope.solver.io.markers_in.load_markers", lambda path: markers)
    (result.parent / "markers_labelled.c3d").touch()
    found = evaluate(result, reference)
    assert found.m2s < 1e-5, f"{found.m2s * 1000:.3f} mm from vertices of the surface itself"
    assert 0.01 < found.m2s_reference < 0.2


def test_what_is_printed(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    result = write(tmp_path / "a.npz", body, poses, trans + np.array([0.0, 0.0, 0.0121]))
    outcome = evaluate_result(EvaluateRequest(result, write(tmp_path / "b.npz", body, poses, trans)))
    text = "\n".join(outcome.lines)
    assert "12.1 mm" in text and "knee_angle_r: 0.0 degrees RMSE" in text, text
    assert json.loads(json.dumps(outcome.summary))["mpjpe_mm"] == pytest.approx(12.1)
    silent = replace(evaluate(result, result), v2v=None)
    assert not any("V2V" in line for line in lines_of(silent))


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no poses": ({"poses": None}, "lacks 'poses'"),
    "no places": ({"trans": None}, "lacks 'poses' or 'trans'"),
    "places of another length": ({"trans": np.zeros((3, 3))}, "3 x 3, not 60 x 3"),
    "joints of another shape": ({"joints": np.zeros((60, 23, 3))}, "60 x 23 x 3"),
    "no rate": ({"mocap_frame_rate": None, "time": None}, "frame rate"),
    "negative rate": ({"mocap_frame_rate": -5.0}, "not possible"),
    "time that stands still": ({"time": np.zeros(60)}, "ascend"),
    "shape of text": ({"betas": np.array(["a"])}, "not an array of numbers"),
    "another trial": ({"time": 100 + np.arange(60) / RATE}, "do not overlap"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_references_say_what_is_wrong(tmp_path: Path, body: Body, name: str) -> None:
    changes, sentence = BAD[name]
    good = write(tmp_path / "a.npz", body, *moving())
    bad = write(tmp_path / "bad.npz", body, *moving(), changes=changes)
    with pytest.raises(InputError, match=sentence) as caught:
        evaluate(good, bad)
    assert "bad.npz" in str(caught.value)


def test_files_that_are_no_motion(tmp_path: Path, body: Body) -> None:
    good = write(tmp_path / "a.npz", body, *moving())
    (tmp_path / "text.npz").write_text("hello")
    (tmp_path / "empty").mkdir()
    for name in ("text.npz", "empty", "nowhere.npz"):
        with pytest.raises(InputError, match=name):
            evaluate(good, tmp_path / name)
