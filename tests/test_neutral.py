"""Angles counted from a neutral pose: a span of the trial, or a static trial without labels."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.angles.angles import AngleSettings, joint_angles, relative_to
from markerscope.solver.body.model import Body
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.request import parse_neutral
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.known.neutral import Neutral, NeutralSettings, facing, neutral_file, neutral_span
from markerscope.solver.fit.results import FittedMotion
from tests.fit.test_known import fitted, standing


@pytest.fixture(scope="module")
def trial() -> tuple[Body, Points, FittedMotion]:
    return fitted(21)


def stand_still(motion: FittedMotion, frames: slice, seed: int = 0) -> FittedMotion:
    """The trial with a person who stands still in some frames, but for a degree of sway."""
    rotations, placed = motion.rotations.copy(), motion.placed.copy()
    placed[frames] = placed[frames.start]
    sway = np.radians(0.7) * np.random.default_rng(seed).normal(0, 1, (*rotations[frames].shape[:2], 3))
    rotations[frames] = rotations[frames.start] @ exp_so3(sway)
    return replace(motion, rotations=rotations, placed=placed)


def angles_of(body: Body, motion: FittedMotion, rotations: np.ndarray, convention: str = "opensim") -> JointAngles:
    shaped = body.landmarks(motion.betas), body.joints(motion.betas)
    return joint_angles(np.arange(len(rotations)) / 10, rotations, *shaped, AngleSettings(convention))  # type: ignore[arg-type]


def column(angles: JointAngles, name: str) -> np.ndarray:
    return angles.degrees[:, angles.names.index(name)]


def test_a_span_of_the_trial_becomes_zero(trial: tuple[Body, Points, FittedMotion]) -> None:
    body, _, whole = trial
    motion = stand_still(whole, slice(10, 30))
    neutral = neutral_span(motion, NeutralSettings(motion.time[10], motion.time[29]))
    zero = angles_of(body, motion, facing(neutral, motion))
    found = relative_to(angles_of(body, motion, motion.rotations), zero, neutral.where, neutral.same_lab_heading)
    assert found.zero == "neutral"
    for name in ("hip_flexion_r", "knee_angle_l", "elbow_flex_r", "pelvis_rotation"):
        assert abs(column(found, name)[10:30].mean()) < 0.3, name
    known = ~found.singular
    assert np.allclose(found.as_recorded.degrees[known], angles_of(body, motion, motion.rotations).degrees[known])
    assert found.as_recorded.zero_pose == angles_of(body, motion, motion.rotations).zero_pose != found.zero_pose


@pytest.mark.parametrize("heading", [0.0, 2.0, 4.5])
def test_a_static_trial_is_matched_without_names_from_any_heading(
    heading: float, trial: tuple[Body, Points, FittedMotion]
) -> None:
    body, placement, motion = trial
    markers, rotations = static(body, placement, motion, heading)
    neutral = neutral_file(body, motion, markers, NeutralSettings())
    assert neutral.matched == (40, 40)
    assert neutral.notes == ()
    zero = angles_of(body, motion, facing(neutral, motion))
    turned = rotations[None].copy()
    turned[:, 0] = facing(Neutral("neutral", rotations, "", False), motion)[:, 0]
    truth = angles_of(body, motion, turned)
    for name in ("hip_flexion_r", "hip_flexion_l", "knee_angle_r", "ankle_angle_l", "elbow_flex_l", "pelvis_tilt"):
        assert abs(column(zero, name)[0] - column(truth, name)[0]) < 3, f"{name} (synthetic)"
    found = relative_to(angles_of(body, motion, motion.rotations), zero, neutral.where, neutral.same_lab_heading)
    recorded = angles_of(body, motion, motion.rotations)
    assert np.array_equal(column(found, "pelvis_rotation"), column(recorded, "pelvis_rotation")), "faces anywhere"
    assert not np.allclose(column(found, "knee_angle_r"), column(recorded, "knee_angle_r"))


def static(
    body: Body, placement: Points, motion: FittedMotion, heading: float = 1.0, betas: np.ndarray | None = None
) -> tuple[Markers, np.ndarray]:
    points, rotations = standing(body, placement, motion.betas if betas is None else betas, 5)
    turn = exp_so3(np.array([0, 0, heading]))
    rng = np.random.default_rng(6)
    order = rng.permutation(len(points))
    positions = (points @ turn.T)[order] + rng.normal(0, 0.001, (120, len(points), 3))
    rotations = rotations.copy()
    rotations[0] = turn @ rotations[0]
    return Markers(positions, 60.0, tuple(f"S{i}" for i in range(len(points))), source="/data/static.trc"), rotations


def test_an_angle_that_the_neutral_pose_cannot_tell_keeps_its_zero(trial: tuple[Body, Points, FittedMotion]) -> None:
    body, _, motion = trial
    recorded = angles_of(body, motion, motion.rotations, "isb")
    flags = np.zeros((1, len(recorded.names)), bool)
    flags[0, 3] = True
    zero = replace(recorded, degrees=np.full((1, len(recorded.names)), 7.0), singular=flags)
    found = relative_to(recorded, zero, "here", True)
    assert np.array_equal(found.degrees[:, 3], recorded.degrees[:, 3])
    assert np.allclose(found.degrees[:, 4], recorded.degrees[:, 4] - 7)


@pytest.mark.parametrize(
    ("start", "stop", "says"),
    [
        (-5.0, 0.4, "not inside the trial"),
        (0.2, 400.0, "not inside the trial"),
        (1.0, 1.02, "too short"),
        (0.0, 3.0, "moves"),
    ],
)
def test_a_span_that_is_none_is_said(
    start: float, stop: float, says: str, trial: tuple[Body, Points, FittedMotion]
) -> None:
    with pytest.raises(InputError, match=says):
        neutral_span(trial[2], NeutralSettings(start, stop))


def test_a_static_trial_that_is_none_is_said(trial: tuple[Body, Points, FittedMotion]) -> None:
    body, placement, motion = trial
    markers, _ = static(body, placement, motion)
    swaying = np.linspace(0, 0.4, 120)[:, None, None] * np.array([1.0, 0.3, 0])
    with pytest.raises(InputError, match="does not stand still"):
        neutral_file(body, motion, replace(markers, positions=markers.positions + swaying), NeutralSettings())
    other = motion.betas.copy()
    other[:3] += np.array([3.0, -3.0, 2.0])
    with pytest.raises(InputError, match="do not fit the person"):
        neutral_file(body, motion, static(body, placement, motion, betas=other)[0], NeutralSettings())
    with pytest.raises(InputError, match="do not fit the person"):
        neutral_file(body, motion, markers.select(markers=np.arange(15)), NeutralSettings())


def test_the_still_part_of_a_static_trial_is_taken(trial: tuple[Body, Points, FittedMotion]) -> None:
    body, placement, motion = trial
    markers, _ = static(body, placement, motion)
    walking = np.concatenate([np.linspace(-1, 0, 40), np.zeros(80)])[:, None, None] * np.array([1.0, 0, 0])
    neutral = neutral_file(body, motion, replace(markers, positions=markers.positions + walking), NeutralSettings())
    assert neutral.matched == (40, 40)
    with pytest.raises(InputError, match="does not stand still"):
        walk = replace(markers, positions=markers.positions + walking)
        neutral_file(body, motion, walk, NeutralSettings(0.0, 0.5))


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("0.5:1", (0.5, 1.0)),
        (":0.2", (None, 0.2)),
        ("recorded", "recorded"),
        ("static.trc", Path("static.trc")),
        ("C:\\data\\static.c3d", Path("C:\\data\\static.c3d")),
    ],
)
def test_what_neutral_can_be_said_as(text: str, means: object) -> None:
    assert parse_neutral(text) == means


def test_the_command_writes_both(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made, out = tmp_path / "made", tmp_path / "out"
    words = ["synth", "walk", "--out", str(made), "--frames", "60", "--markers", "24", "--seed", "1", "--still", "0.02"]
    assert main([*words, "--quiet"]) == 0
    solve = ["solve", str(made / "markers.c3d"), "--prior", str(made / "prior.npz"), "--out", str(out), "--quiet"]
    assert main([*solve, "--neutral", "9:10"]) == 2
    assert "not inside the trial" in capsys.readouterr().err
    assert not (out / "angles.csv").exists()
    assert main([*solve, "--neutral", "0:0.5"]) == 0
    about = json.loads((out / "angles.json").read_text())
    assert about["zero"] == "neutral"
    assert about["neutral_pose"] == "0 to 0.5 s of the trial"
    relative, recorded = (table(out / name) for name in ("angles.csv", "angles_as_recorded.csv"))
    assert list(relative) == list(recorded)
    offset = {row["column"]: row["neutral_degrees"] for row in about["angles"]}
    for name in ("hip_flexion_r", "knee_angle_l"):
        assert np.allclose(recorded[name] - relative[name], offset[name], atol=2e-4)
        assert abs(np.nanmean(relative[name][:15])) < 1
    assert main(["solve", str(out), "--neutral", "recorded", "--quiet"]) == 0
    assert json.loads((out / "angles.json").read_text())["zero"] == "recorded"
    assert not (out / "angles_as_recorded.csv").exists()
    assert np.allclose(table(out / "angles.csv")["knee_angle_l"], recorded["knee_angle_l"], atol=1e-4)


def table(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


@pytest.mark.parametrize("text", ["", " ", ":"])
def test_no_pose_at_all_is_one_clear_sentence(text: str) -> None:
    with pytest.raises(InputError, match="names no pose") as refused:
        parse_neutral(text)
    assert "--neutral" in str(refused.value) and "A:B" in str(refused.value)
