"""File names that are not UTF-8: carried through a solve and every file of it, and shown."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.commands.solve import session_of
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.io import load_markers
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import InputFile, Session, load_session, save_session
from markerscope.solver.report.outputs import FILES, write_formats
from markerscope.solver.synth.files import FILES as SYNTH
from tests.fit.conftest import simulate
from tests.synthetic import record

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="file names are text on this system")
BAD, SHOWN = os.fsdecode(b"tri\xffl"), "tri\\xffl"
TINY = {"localize": {"yaws": 6, "few": 4, "many": 6, "keep": 3}, "orient": {"refine": 1}}


@pytest.fixture(scope="module")
def session_of_names(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session to be solved, whose files and folder have such names."""
    folder = tmp_path_factory.mktemp("names")
    made = record(folder, simulate(with_bone_lengths(Body.load()), 5, frames=80, markers=24))
    markers, prior = folder / f"{BAD}.c3d", folder / f"{BAD}.npz"
    shutil.move(made.markers, markers)
    shutil.move(made.prior, prior)
    out = folder / f"{BAD}-solved"
    session = session_of(SolveRequest(markers, out=out, prior=prior, offset=made.offset))
    save_session(Session(out, session.inputs, {**session.settings, **TINY}))
    return out


def solve(out: Path, capsys: pytest.CaptureFixture[str]) -> tuple[str, dict[str, object]]:
    assert main(["solve", str(out), "--json"]) == 0
    printed = capsys.readouterr().out
    printed.encode("utf-8")
    return printed, json.loads(printed.splitlines()[-1])


def test_a_solve_writes_every_file_and_says_where(session_of_names: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = session_of_names
    printed, summary = solve(out, capsys)
    assert f"Results are in {out.parent}/{SHOWN}-solved." in printed and SHOWN in str(summary["out"])
    for path in out.iterdir():
        if path.suffix in (".csv", ".json", ".mot", ".bvh", ".trc", ".html", ".toml"):
            path.read_bytes().decode("utf-8")
    assert set(FILES) <= set(os.listdir(out))
    about = json.loads((out / "angles.json").read_text(encoding="utf-8"))
    assert about["inputs"]["marker_file"]["file"] == f"{SHOWN}.c3d"
    assert f"{SHOWN}.npz" in (out / "report.html").read_text(encoding="utf-8")
    assert len(load_markers(out / "markers_labelled.c3d").labels) == 24
    with np.load(out / "motion.npz") as motion:
        assert len(motion["marker_labels"]) == 24
    session = load_session(out)
    assert session.inputs["marker_file"].path == out.parent / f"{BAD}.c3d", "the file itself is found again"
    _, again = solve(out, capsys)
    assert again["computed"] == []


def test_a_path_written_over_by_hand_counts(session_of_names: Path, tmp_path: Path) -> None:
    out = tmp_path / "s"
    save_session(Session(out, {"marker_file": InputFile(tmp_path / f"{BAD}.c3d")}))
    assert load_session(out).inputs["marker_file"].path == tmp_path / f"{BAD}.c3d"
    file = out / "session.toml"
    file.write_text(file.read_text().replace(f"../{SHOWN}.c3d".replace("\\", "\\\\"), "../other.c3d"))
    assert load_session(out).inputs["marker_file"].path == tmp_path / "other.c3d"


def test_every_format_can_be_exported_into_such_a_folder(
    session_of_names: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = session_of_names
    session = load_session(out)
    written = write_formats(tmp_path / BAD, session, run_stages(session), ("angles", "angles_long", "mot", "trc"))
    assert all(path.is_file() for path in written) and len(written) >= 5


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_clean_writes_such_names(
    session_of_names: Path, tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / f"{BAD}{suffix}"
    assert main(["clean", str(session_of_names.parent / f"{BAD}.c3d"), "--out", str(out), "--json"]) == 0
    printed = capsys.readouterr().out
    assert f"{SHOWN}{suffix}" in json.loads(printed.splitlines()[-1])["out"]
    assert len(load_markers(out, up="z").labels) == 24
    about = json.loads((tmp_path / f"{BAD}.changes.json").read_text(encoding="utf-8"))
    assert about["input"]["file"] == f"{SHOWN}.c3d"


def test_synth_and_evaluate_write_such_names(
    session_of_names: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / BAD
    assert main(["synth", "walk", "--out", str(out), "--frames", "30", "--markers", "12", "--json"]) == 0
    json.loads(capsys.readouterr().out.splitlines()[-1])
    assert {path.name for path in out.iterdir()} == set(SYNTH)
    assert main(["evaluate", str(out / "reference.npz"), str(out / "reference.npz"), "--json"]) == 0
    json.loads(capsys.readouterr().out.splitlines()[-1])


def test_a_refusal_names_such_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", str(tmp_path / f"{BAD}.c3d"), "--prior", "x.npz", "--out", str(tmp_path / "out")]) == 2
    assert f"{SHOWN}.c3d: there is no such file" in capsys.readouterr().err


def test_a_mistake_about_such_a_file_is_logged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from markerscope.app.cli.endings import ended

    assert ended(ValueError(f"{BAD} cannot be understood")) == 1
    said = capsys.readouterr().err
    log = Path(said.split("details are in ")[1].split(" and shown")[0])
    assert "cannot be understood" in log.read_text(encoding="utf-8")
    log.unlink()
