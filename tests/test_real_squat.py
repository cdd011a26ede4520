"""The main job on a real recording: unlabelled markers and a video in, joint angles out; labels only judge."""

from __future__ import annotations

import json
import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.solver.commands import solve_session
from markerscope.solver.core.markers import Markers, lab_rotation
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.mot import read_mot

TRUE_OFFSET_S = -0.010
BODIES = {"hip": "femur", "knee": "tibia", "ankle": "talus", "shoulder": "humerus", "elbow": "ulna", "wrist": "hand"}
PARTS = {
    "left leg": ("left_thigh", "left_knee", "left_shank", "left_ankle", "left_foot"),
    "right arm": ("right_shoulder", "right_upper_arm", "right_elbow", "right_forearm", "right_wrist"),
}


@dataclass(frozen=True)
class Trial:
    """A solve of the trial with its names taken off, and the names."""

    data: Path
    out: Path
    segments: tuple[str, ...]
    summary: dict[str, Any]

    @property
    def bones(self) -> list[str]:
        with np.load(self.out / "motion.npz", allow_pickle=False) as motion:
            return [JOINTS[j] for j in motion["marker_joint"]]

    def on_right_bone(self) -> float:
        allowed = tomllib.loads((self.data / "segments_squat.toml").read_text())["joints"]
        return float(np.mean([bone in allowed[name] for bone, name in zip(self.bones, self.segments)]))

    def on_right_side(self) -> float:
        sides = [{bone.split("_")[0], name.split("_")[0]} for bone, name in zip(self.bones, self.segments)]
        return float(np.mean([not {"left", "right"} <= side for side in sides]))

    def joint_error_mm(self) -> float:
        """Mean over the 12 joints that another laboratory's inverse kinematics has too."""
        bodies = json.loads((self.data / "squat_video" / "bodies_mocap.json").read_text())
        with np.load(self.out / "motion.npz", allow_pickle=False) as motion:
            lab, time = motion["joints"] @ motion["R_lab_internal"].T, motion["time"]
        errors = []
        for side in ("left", "right"):
            for joint, body in BODIES.items():
                path = np.array(bodies["bodies"][f"{body}_{side[0]}"]["translation"])
                there = np.stack([np.interp(time, bodies["time"], path[:, k]) for k in range(3)], axis=1)
                errors.append(np.linalg.norm(lab[:, INDEX[f"{side}_{joint}"]] - there, axis=1).mean())
        return 1000 * float(np.mean(errors))

    def angle_error(self, name: str) -> tuple[float, float]:
        """RMSE in degrees against the labelled markers' inverse kinematics, and that less a constant offset."""
        reference = read_mot(self.data / "squat_video" / "squats1_ik.mot")
        ours = np.genfromtxt(self.out / "angles.csv", delimiter=",", names=True)
        differ = ours[name] - np.interp(ours["time"], reference.time, reference.in_degrees()[name])
        assert np.isfinite(differ).mean() > 0.95
        return float(np.sqrt(np.nanmean(differ**2))), float(np.nanstd(differ))


def solve(data: Path, folder: Path, part: str | None = None, like: Trial | None = None, camera: bool = False) -> Trial:
    """Solve the trial, or a part of its markers; ``like`` has watched the video already."""
    table = tomllib.loads((data / "segments_squat.toml").read_text())
    segment_of = {name: segment for segment, names in table.items() if segment != "joints" for name in names}
    full = load_markers(data / "squat_video" / "squats1.trc", up="y")
    wanted = [
        i for i, name in enumerate(full.labels)
        if name in segment_of and (part is None or segment_of[name] in PARTS[part])
    ]  # fmt: skip
    order = np.random.default_rng(1).permutation(wanted)
    names = tuple(f"M{i:03d}" for i in range(len(order)))
    bare = Markers(full.positions[:, order], full.rate, names, full.first_time, lab_rotation("y"))
    folder.mkdir()
    write_trc(folder / "m.trc", bare)
    out = folder / "out"
    if like is not None:
        shutil.copytree(like.out / "results" / "landmarks", out / "results" / "landmarks")
    request = SolveRequest(
        folder / "m.trc",
        out=out,
        video=data / "squat_video" / "video.mp4",
        camera=like.out if camera and like is not None else None,
    )
    summary = dict(solve_session(request, silent).summary)
    return Trial(data, out, tuple(segment_of[full.labels[i]] for i in order), summary)


@pytest.fixture(scope="module")
def whole(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Trial:
    return solve(shared_data, tmp_path_factory.mktemp("squat") / "whole")


def test_the_whole_body(whole: Trial) -> None:
    assert whole.on_right_side() == 1
    assert whole.on_right_bone() >= 0.95, f"{100 * whole.on_right_bone():.0f} % of the markers on the right bone"
    assert whole.joint_error_mm() <= 30, f"joints are {whole.joint_error_mm():.1f} mm off"
    assert abs(whole.summary["sync"]["offset_s"] - TRUE_OFFSET_S) <= 0.05


@pytest.mark.parametrize(
    ("angle", "most", "most_less_offset"),
    [("knee_angle", 5.5, 2.5), ("hip_flexion", None, 4.5), ("ankle_angle", None, 5.0), ("elbow_flex", None, 7.0)],
)
def test_the_angles_of_the_whole_body(whole: Trial, angle: str, most: float | None, most_less_offset: float) -> None:
    for side in "rl":
        rmse, less_offset = whole.angle_error(f"{angle}_{side}")
        found = f"{angle}_{side}: {rmse:.1f} degrees RMSE, {less_offset:.1f} less offset"
        assert (most is None or rmse <= most) and less_offset <= most_less_offset, found


def test_asked_again_it_computes_nothing(whole: Trial) -> None:
    assert solve_session(SolveRequest(whole.out), silent).summary["computed"] == []


@pytest.mark.parametrize(
    ("part", "angles"),
    [("left leg", {"knee_angle_l": 5.0, "ankle_angle_l": 5.0}), ("right arm", {"elbow_flex_r": 8.0})],
)
def test_a_part_alone(whole: Trial, tmp_path: Path, part: str, angles: dict[str, float]) -> None:
    """The right part and side, or where the data cannot tell, the other side named beside it."""
    found = solve(whole.data, tmp_path / "part", part, whole)
    answers = [found.summary["part"]] + [answer["part"] for answer in found.summary["alternatives"]]
    assert part in answers, f"{part}: {answers}"
    if found.summary["part"] == part:
        assert found.on_right_side() == 1
        for name, most in angles.items():
            assert found.angle_error(name)[1] <= most, f"{name}: {found.angle_error(name)[1]:.1f} degrees less offset"
    else:
        assert any("Left and right" in warning for warning in found.summary["warnings"]), found.summary


@pytest.mark.parametrize("part", PARTS)
def test_a_part_with_the_camera_of_the_whole_body(whole: Trial, tmp_path: Path, part: str) -> None:
    found = solve(whole.data, tmp_path / "part", part, whole, camera=True)
    assert found.summary["part"] == part and found.on_right_side() == 1
