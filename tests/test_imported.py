"""Other programs' results, as they write them, beside ours."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.request import EvaluateRequest
from markerscope.solver.evaluate.evaluate import evaluate, evaluate_result
from markerscope.solver.evaluate.evaluate_angles import evaluate_angles
from markerscope.solver.evaluate.posed import angles_of, imported_result
from markerscope.solver.io.export_mot import write_mot
from markerscope.solver.io.motion_in import read_motion
from tests.test_evaluate import FRAMES, RATE, moving, write


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


class Node:
    """Stands in for the settings that MoSh++ pickles beside its results: a tree that knows its parents."""

    def __init__(self, parent: Node | None, **content: Any) -> None:
        self.__dict__.update(_parent=parent, _content=content, _metadata=Any)


def settings(monkeypatch: pytest.MonkeyPatch) -> Node:
    """A tree of settings whose class is called as omegaconf calls it."""
    module = ModuleType("omegaconf.dictconfig")
    kind = type("DictConfig", (Node,), {"__module__": module.__name__})
    module.DictConfig = kind  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "omegaconf", ModuleType("omegaconf"))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    root: Node = kind(None)
    root.__dict__["_content"] = {"surface_model": kind(root, gender="female", type="smplx")}
    return root


def smplx(poses: np.ndarray, joints: int = 55) -> np.ndarray:
    """(T, 24, 3) rad as SMPL-X or SMPL-H has them, fingers and jaw somehow."""
    full = np.full((len(poses), joints, 3), 0.1)
    full[:, :22] = poses[:, :22]
    return full.reshape(len(poses), -1)


def stage_two(path: Path, poses: np.ndarray, trans: np.ndarray, cfg: object = None) -> Path:
    """As MoSh++ leaves it, and so SOMA."""
    labels = ["C7", "LKNE"]
    content = {
        "fullpose": smplx(poses),
        "trans": trans,
        "betas": np.linspace(-1, 1, 16),
        "markers_latent": np.zeros((2, 3)),
        "latent_labels": labels,
        "marker_meta": {"marker_vids": {"C7": 3832, "LKNE": 3682}},
        "stageii_debug_details": {"mocap_frame_rate": RATE, "labels_obs": [labels] * len(poses), "cfg": cfg},
    }
    path.write_bytes(pickle.dumps(content))
    return path


def test_a_stage_two_result_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    poses, trans = moving()
    with_settings = stage_two(tmp_path / "with_stageii.pkl", poses, trans, settings(monkeypatch))
    assert b"omegaconf.dictconfig" in with_settings.read_bytes()
    for path in (stage_two(tmp_path / "a_stageii.pkl", poses, trans), with_settings):
        found = read_motion(path)
        plain = read_motion(write(tmp_path / "b.npz", Body.load(), poses, trans))
        assert found.rate == RATE
        assert found.model == "smplx"
        assert np.allclose(found.rotations[:, :22], plain.rotations[:, :22])
        assert np.allclose(found.rotations[:, 22:], np.eye(3)), "SMPL's hands are not SMPL-X' jaw and eyes"
        assert np.allclose(found.trans, trans)


def test_code_beside_the_settings_is_still_refused(tmp_path: Path) -> None:
    path = stage_two(tmp_path / "a_stageii.pkl", *moving(), cfg=print)
    with pytest.raises(InputError, match=r"a_stageii\.pkl"):
        read_motion(path)


def test_a_stage_two_result_is_compared_in_its_angles_and_on_the_mean_shape(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    ours = write(tmp_path / "a.npz", body, poses, trans, betas=np.zeros(10), joints=None)
    theirs = stage_two(tmp_path / "b_stageii.pkl", poses, trans)
    for pair in ((ours, theirs), (theirs, ours)):
        found = evaluate(*pair)
        assert found.mpjpe.per_point[:22].max() < 1e-9
        for name, angle in found.angles.items():
            assert not angle.rmse > 1e-9, f"{name} is off by {np.degrees(angle.rmse)} degrees"
        assert any("belongs to another body model and is left out" in note for note in found.notes)


@pytest.mark.parametrize(
    ("layout", "gone"),
    [
        ({"poses": "h", "mocap_framerate": RATE, "gender": "male", "dmpls": np.zeros((FRAMES, 8))}, "mocap_frame_rate"),
        ({"poses": "x", "mocap_frame_rate": RATE, "surface_model_type": "smplx", "gender": "neutral"}, ""),
        ({"root_orient": 0, "pose_body": 0, "mocap_frame_rate": RATE, "surface_model_type": "smplx"}, "poses"),
    ],
)
def test_every_layout_of_amass(tmp_path: Path, body: Body, layout: dict[str, Any], gone: str) -> None:
    poses, trans = moving()
    flat = poses.reshape(FRAMES, -1)
    filled = {"poses": {"h": smplx(poses, 52), "x": smplx(poses)}.get(str(layout.get("poses")))}
    if "root_orient" in layout:
        filled = {"root_orient": flat[:, :3], "pose_body": flat[:, 3:66]}
    changes = {
        **layout,
        **filled,
        "joints": None,
        "time": None,
        "betas": np.arange(16.0),
        **({gone: None} if gone else {}),
    }
    motion, notes = imported_result(write(tmp_path / "amass.npz", body, poses, trans, changes=changes), first_time=2.0)
    assert np.allclose(motion.time, 2 + np.arange(FRAMES) / RATE)
    plain = body.pose(read_motion(write(tmp_path / "b.npz", body, poses, trans)).rotations, np.zeros(10), trans)[1]
    assert np.allclose(motion.joints[:, :22], plain[:, :22])
    assert "left out" in notes[0]


def table(path: Path, motion: Path, sign: dict[str, float] | None = None) -> Path:
    """The angles of a motion as OpenSim writes them, and a translation."""
    posed, _ = imported_result(motion)
    angles = {name: np.degrees(v) * (sign or {}).get(name, 1.0) for name, v in angles_of(posed).items()}
    angles["pelvis_tx"] = np.arange(len(posed.time), dtype=float)
    write_mot(path, posed.time, (tuple(angles), np.stack(list(angles.values()), axis=1)))
    return path


def test_a_table_of_angles_is_a_reference_and_a_result(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    ours = write(tmp_path / "a.npz", body, poses, trans)
    bent = poses.copy()
    bent[:, 4] = 0
    poses = bent.copy()
    poses[:, 4, 0], bent[:, 4, 0] = 0.6, 0.7
    ours, other = (write(tmp_path / f"{n}.npz", body, p, trans) for n, p in (("a", bent), ("b", poses)))
    theirs = table(tmp_path / "ik.mot", other)
    for pair, offset in (((ours, theirs), 0.1), ((theirs, ours), -0.1)):
        found = evaluate_angles(*pair)
        assert len(found.time) == FRAMES
        assert "pelvis_tx" not in found.angles
        assert found.angles["knee_angle_l"].offset == pytest.approx(offset, abs=2e-3)
        assert found.angles["knee_angle_r"].rmse < 1e-6, "the file holds millionths of a degree"
        assert len(found.angles) > 20
    outcome = evaluate_result(EvaluateRequest(ours, theirs))
    assert outcome.summary["frames"] == FRAMES
    assert any(line.startswith("knee_angle_l: 5.7 degrees RMSE") for line in outcome.lines), outcome.lines
    both = evaluate_angles(theirs, theirs)
    assert all(not a.rmse > 1e-12 for a in both.angles.values())


def test_the_sense_of_the_knee_is_told_by_the_way_knees_bend(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    poses[:, [4, 5]] = 0
    poses[:, [4, 5], 0] = 0.8
    ours = write(tmp_path / "a.npz", body, poses, trans)
    turned = table(tmp_path / "gait2392.mot", ours, {"knee_angle_l": -1.0, "knee_angle_r": -1.0})
    found = evaluate_angles(ours, turned)
    assert found.angles["knee_angle_l"].rmse < 1e-6
    assert found.notes == ("gait2392.mot counts knee flexion as negative (gait2392); its sign was turned.",)


def test_radians_and_another_rate(tmp_path: Path, body: Body) -> None:
    ours = write(tmp_path / "a.npz", body, *moving())
    names, time = ("knee_angle_r", "hip_flexion_r"), 1.5 + np.arange(300) / 100
    motion, _ = imported_result(ours)
    angles = angles_of(motion)
    values = [np.interp(time, motion.time, angles[name]) for name in names]
    rows = "\n".join("\t".join(f"{v:.9f}" for v in row) for row in zip(time, *values, strict=True))
    head = f"Coordinates\nversion=1\nnRows=300\nnColumns=3\ninDegrees=no\nendheader\ntime\t{names[0]}\t{names[1]}\n"
    (tmp_path / "ik.sto").write_text(head + rows + "\n")
    found = evaluate_angles(ours, tmp_path / "ik.sto")
    assert set(found.angles) == set(names)
    for name in names:
        assert found.angles[name].rmse < np.radians(0.15), f"{name} {np.degrees(found.angles[name].rmse):.3f} degrees"


@pytest.mark.parametrize(
    ("names", "times", "message"),
    [
        (("knee", "hip"), (2.0, 2.1, 2.2), "no name in common"),
        (("knee_angle_r", "hip"), (90.0, 90.1, 90.2), "do not overlap"),
        (("knee_angle_r", "hip"), (2.0, 2.0, 2.2), "do not ascend"),
    ],
)
def test_tables_that_cannot_be_compared(
    tmp_path: Path, body: Body, names: tuple[str, ...], times: tuple[float, ...], message: str
) -> None:
    ours = write(tmp_path / "a.npz", body, *moving())
    write_mot(tmp_path / "bad.mot", np.array(times), (names, np.zeros((3, 2))))
    with pytest.raises(InputError, match=message) as told:
        evaluate_angles(ours, tmp_path / "bad.mot")
    assert "bad.mot" in str(told.value)


def test_a_table_is_compared_with_a_motion_that_has_no_clock(tmp_path: Path, body: Body) -> None:
    poses, trans = moving()
    ours = write(tmp_path / "a.npz", body, poses, trans, time=None)
    later = write(tmp_path / "b.npz", body, poses, trans)
    found = evaluate_angles(ours, table(tmp_path / "ik.mot", later))
    assert found.angles["hip_flexion_r"].rmse < 1e-6
    assert any("is taken to start with ik.mot, at 2.00 s" in note for note in found.notes)
