"""``events`` and ``cycles`` as a user runs them, on a walk whose body is known, written down as a result."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import ezc3d
import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.angles.angles import AngleSettings, joint_angles
from markerscope.solver.body.model import Body
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.io.export_angles import write_angles
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.synth.acts import act

RATE = 50.0
START = 2.0


def write_result(folder: Path, seed: int) -> Path:
    """The files of a solve that events and cycles read."""
    folder.mkdir()
    body = Body.load()
    betas = np.zeros(body.shape_count)
    motion = act("walk", body, betas, seconds=6, rate=RATE, rng=np.random.default_rng(seed))
    _, joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)
    time = START + motion.time
    on = np.array([INDEX[name] for name in ("left_ankle", "left_foot", "right_ankle", "right_foot", "pelvis")])
    write_smpl_npz(
        folder / "motion.npz",
        poses=log_so3(motion.rotations).reshape(len(time), -1),
        trans=motion.trans,
        betas=betas[: body.betas_count],
        rate=RATE,
        extra={"bone_lengths": betas[body.betas_count :], "joints": joints, "time": time, "marker_joint": on},
    )
    angles = joint_angles(time, motion.rotations, body.landmarks(betas), body.joints(betas), AngleSettings())
    write_angles(folder, angles, {})
    names = ("left_foot_1", "left_toes_1", "right_foot_1", "right_toes_1", "pelvis_1")
    write_c3d(folder / "markers_labelled.c3d", Markers(joints[:, on], RATE, names, first_time=START))
    return folder


@pytest.fixture(scope="module")
def walks(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    place = tmp_path_factory.mktemp("walks")
    return write_result(place / "ann-1", 1), write_result(place / "ann-2", 2)


def summary(words: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> dict:
    capsys.readouterr()
    assert main([*words, "--json", "--quiet"]) == code
    printed = capsys.readouterr()
    return json.loads(printed.out.splitlines()[-1]) if code == 0 else {"error": printed.err}


def test_events_are_written_as_table_and_into_a_c3d(walks, tmp_path: Path, capsys) -> None:
    found = summary(["events", str(walks[0]), "--out", str(tmp_path / "e.csv"), str(tmp_path / "e.c3d")], capsys)
    strikes = [e["time_s"] for e in found["events"] if e["event"] == "foot strike"]
    assert len(strikes) >= 8 and min(strikes) > START
    rows = list(csv.DictReader((tmp_path / "e.csv").open()))
    assert len(rows) == len(found["events"]) and {row["source"] for row in rows} == {"body"}
    section = ezc3d.c3d(str(tmp_path / "e.c3d"))["parameters"]["EVENT"]
    assert np.allclose(section["TIMES"]["value"][1], [float(row["time"]) for row in rows], atol=1e-3)
    by_markers = summary(["events", str(walks[0]), "--from", "markers", "--out", str(tmp_path / "m.csv")], capsys)
    others = [e["time_s"] for e in by_markers["events"] if e["event"] == "foot strike"]
    assert len(others) >= 8


def test_what_stands_in_the_table_is_believed(walks, tmp_path: Path, capsys) -> None:
    table = tmp_path / "events.csv"
    table.write_text("time,side,event\n3.0,left,foot strike\n3.6,left,foot off\n4.1,left,foot strike\n")
    out = tmp_path / "out"
    found = summary(["cycles", str(walks[0]), "--events", str(table), "--out", str(out)], capsys)
    assert found["trials"][0]["cycles_used"] == ["left 1"] and found["trials"][0]["events"] == "events.csv"
    stride = next(row for row in found["steps"] if row["quantity"] == "stride time")
    assert stride["left"]["mean"] == pytest.approx(1.1)
    at = [row for row in csv.DictReader((out / "cycles.csv").open()) if row["quantity"] == "opensim/knee_angle"]
    angles = list(csv.DictReader((walks[0] / "angles.csv").open()))
    near = min(angles, key=lambda row: abs(float(row["time"]) - 3.0))
    assert float(at[0]["value"]) == pytest.approx(float(near["knee_angle_l"]), abs=1.0)


def test_trials_of_one_person_against_controls(walks, tmp_path: Path, capsys) -> None:
    out = tmp_path / "ann"
    words = ["cycles", *map(str, walks), "--out", str(out), "--leave-out", "ann-1/left 1: first step"]
    first = summary([*words, "--filter", "butterworth:6"], capsys)
    assert first["trials"][0]["left_out"][0] == {"cycle": "left 1", "why": "first step"}
    assert "6 Hz" in first["filter"]
    assert {"gait.svg", "gait.pdf", "mean.csv", "cycles.csv", "figures.csv", "cycles.json"} == set(first["files"])
    assert (out / "gait.svg").read_text().count("Foot progression") == 1
    own = summary([*words, "--controls", str(out / "mean.csv"), "--filter", "butterworth:6"], capsys)
    assert own["controls"]["gait_profile_score"]["both"] == pytest.approx(0, abs=1e-3)
    assert "controls.csv" in own["files"]
    people = summary(["cycles", str(walks[0]), "--out", str(out), "--controls", *map(str, walks)], capsys)
    assert people["controls"]["people"] == 2 and people["controls"]["gait_profile_score"]["left"] > 0


def test_everything_can_be_cut(walks, tmp_path: Path, capsys) -> None:
    words = [
        "cycles",
        str(walks[0]),
        "--out",
        str(tmp_path),
        "--what",
        "velocities,joints,markers",
        "--filter",
        "spline",
    ]
    found = summary(words, capsys)
    units = {row["unit"] for row in found["quantities"]}
    assert units == {"degrees/s", "m"}
    assert {"joint pelvis z", "marker pelvis_1 x"} <= {row["quantity"] for row in found["quantities"]}
    assert "gait.svg" not in found["files"]


def test_repetitions_are_found_and_cut(walks, tmp_path: Path, capsys) -> None:
    found = summary(
        ["events", str(walks[0]), "--repetitions", "knee_angle_r", "--out", str(tmp_path / "r.csv")], capsys
    )
    starts = [e for e in found["events"] if e["event"].endswith("start")]
    assert len(starts) >= 4
    words = ["cycles", str(walks[0]), "--repetitions", "knee_angle_r", "--out", str(tmp_path / "r"), "--what", "angles"]
    assert len(summary(words, capsys)["trials"][0]["cycles_used"]) == len(starts)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("events absent", "absent: there is no such file or folder; check the name."),
        ("events WALK --from plates", "holds no force plates; give a file with --plates."),
        ("events WALK --from file", "holds no events"),
        ("events WALK --repetitions knee", "has no angle 'knee'; choose from"),
        ("events WALK --out OUT/e.txt", "names no format that events are written in; end it in .csv, .c3d."),
        ("events WALK --threshold 0", "--threshold: 0 is not possible"),
        ("cycles WALK --filter butterworth:30", "a cut-off of 30 Hz cannot be had at 50 frames a second"),
        ("cycles WALK --filter box", '--filter: "box" is not understood'),
        ("cycles WALK --events absent.csv", "absent.csv: there is no such file"),
        ("cycles WALK --controls absent.csv", "absent.csv"),
        ("cycles WALK WALK --out OUT", "two trials are called 'ann-1'; rename one of their folders."),
        ("cycles WALK --what gait,legs", '"legs" is no quantity; choose from gait, angles'),
        ("cycles WALK --width 5", "--width: 5 mm is not possible"),
        ("cycles WALK --events TWICE", "the left foot strike at 1.000 s is there twice"),
        ("cycles WALK --events ONE", "holds no whole cycle"),
        ("cycles WALK --events BAD", "has no time in line 2"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(walks, words: str, says: str, tmp_path: Path, capsys) -> None:
    tables = {
        "TWICE": "time,side,event\n1.0,left,foot strike\n1.0,left,foot strike\n",
        "ONE": "time,side,event\n3.0,left,foot strike\n",
        "BAD": "time,side,event\nsoon,left,foot strike\n",
    }
    for name, text in tables.items():
        (tmp_path / f"{name}.csv").write_text(text)
        words = words.replace(name, str(tmp_path / f"{name}.csv"))
    words = words.replace("WALK", str(walks[0])).replace("OUT", str(tmp_path / "out"))
    before = sorted(walks[0].iterdir())
    error = summary(words.split(), capsys, code=2)["error"]
    assert says in error and len(error.splitlines()) == 1
    assert sorted(walks[0].iterdir()) == before
