"""What is exported is what is in force, with its settings, all of it or nothing."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models import edits
from markerscope.app.models.document import Document
from markerscope.app.models.exports import export, export_angles, formats, why_not, write_pictures, write_video
from markerscope.app.models.home import Home
from markerscope.app.models.stages import StageBoard
from markerscope.solver.core.errors import InputError
from markerscope.solver.io import load_markers
from markerscope.solver.pipeline.digest import file_digest
from markerscope.solver.pipeline.session import Session
from markerscope.solver.report.outputs import FILES, FORMATS, SOMETIMES, STANDARD
from markerscope.solver.report.report_data import Picture
from markerscope.solver.video.frames import index_video


@pytest.fixture
def board(session: Session, tmp_path: Path) -> StageBoard:
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    return StageBoard(document)


def test_every_format_leaves_its_files(board: StageBoard, tmp_path: Path) -> None:
    picture = Picture("From the front", b"\x89PNG")
    written = export(board, tmp_path / "out", [*FORMATS, "pictures"], [picture])
    assert written[-1] == tmp_path / "out" / "views" / "01_from_the_front.png"
    names = {path.name for path in written[:-1]} | {"views"}
    assert names == {path.name for path in (tmp_path / "out").iterdir()}
    assert names | set(SOMETIMES) == {name for format in formats() for name in format.files}
    assert "From the front</figcaption>" in (tmp_path / "out" / "report.html").read_text()
    markers = board.current["markers"]
    again = load_markers(tmp_path / "out" / "markers_labelled.c3d")
    here = markers.present & again.present
    assert np.abs(again.positions - markers.positions)[here].max() < 1e-6


def test_settings_and_digests_are_written_beside_the_angles(board: StageBoard, tmp_path: Path) -> None:
    board.document.apply(edits.set_value(board.document.session, "angles", "convention", "opensim"))
    assert [path.name for path in export(board, tmp_path, ["angles_long"])] == [
        "angles.csv",
        "angles.json",
        "angles_long.csv",
    ]
    about = json.loads((tmp_path / "angles.json").read_text())
    marker_file = board.document.session.inputs["marker_file"].path
    assert about["inputs"]["marker_file"]["sha256"] == file_digest(marker_file)
    assert about["stages"]["sync"]["settings"]["offset"] == 0.37, "the offset that was given is told"
    assert about["stages"]["orient"]["key"] == board.keys["orient"]
    assert about["edits"] == {"markers": {"start": 2, "stop": 3}, "sync": {"offset": 0.37}}
    angles = board.current["angles"]
    rows = list(csv.DictReader((tmp_path / "angles_long.csv").open()))
    assert len(rows) == angles.degrees.size
    knee = [float(row["degrees"]) for row in rows if row["angle"] == "knee_angle_r"]
    assert knee == pytest.approx(angles.degrees[:, angles.names.index("knee_angle_r")], abs=1e-4)


def test_angles_are_written_under_a_name_of_the_users(board: StageBoard, tmp_path: Path) -> None:
    table, about = export_angles(board, tmp_path / "squat 3")
    assert (table.name, about.name) == ("squat 3.csv", "squat 3.json")
    assert {path.name for path in tmp_path.iterdir()} >= {table.name, about.name}
    assert not list(tmp_path.glob(".tmp-*")) and not (tmp_path / "angles.csv").exists()
    assert len(list(csv.reader(table.open()))) == 1 + len(board.current["angles"].degrees)
    with pytest.raises(InputError, match="choose one that ends in"):
        export_angles(board, tmp_path / "angles.xlsx")


def test_stale_results_are_not_exported(board: StageBoard, tmp_path: Path) -> None:
    assert why_not(board) == ""
    board.document.apply(edits.set_value(board.document.session, "fit", "video_share", 0.3))
    assert why_not(board).startswith(
        "not there under these settings: Fit, Neutral pose, Joint angles, Standard errors, Distance to the skin"
    )
    with pytest.raises(InputError, match="run all stages first"):
        export(board, tmp_path / "out", ["angles"])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("chosen", "said"), [([], "nothing was chosen"), (["fbx"], "there is no format fbx")])
def test_a_choice_that_is_none_is_said(board: StageBoard, tmp_path: Path, chosen, said: str) -> None:
    with pytest.raises(InputError, match=said):
        export(board, tmp_path / "out", chosen)


def test_where_one_file_cannot_be_made_none_is(board: StageBoard, tmp_path: Path, monkeypatch) -> None:
    def refuse(*args: object) -> None:
        raise InputError("the disk is full")

    monkeypatch.setattr("markerscope.solver.io.export_trc.write_trc", refuse)
    (tmp_path / "angles.mot").write_text("mine")
    with pytest.raises(InputError, match="the disk is full"):
        export(board, tmp_path, ["mot", "trc"])
    assert (tmp_path / "angles.mot").read_text() == "mine"
    assert not list(tmp_path.glob(".tmp-*"))


def test_where_a_picture_cannot_be_written_no_file_is(board: StageBoard, tmp_path: Path, monkeypatch) -> None:
    def refuse(*args: object) -> None:
        raise InputError("the disk is full")

    monkeypatch.setattr("markerscope.app.models.exports.write_bytes_atomic", refuse)
    with pytest.raises(InputError, match="the disk is full"):
        export(board, tmp_path / "out", ["mot", "pictures"], [Picture("Front view", b"1")])
    assert not (tmp_path / "out").exists()


def test_formats_are_told_apart_and_cover_what_a_solve_writes() -> None:
    assert {name for format in formats() if format.name in STANDARD for name in format.files} == {*FILES, *SOMETIMES}
    assert all(format.title and format.help for format in formats())


def test_pictures_and_videos(tmp_path: Path) -> None:
    paths = write_pictures(tmp_path / "views", [Picture("Front view", b"1"), Picture("???", b"2")])
    assert [path.name for path in paths] == ["01_front_view.png", "02_view.png"]
    frames = (np.full((48, 64, 3), 20 * i, np.uint8) for i in range(10))
    assert write_video(tmp_path / "turn.mp4", frames, 25.0) == 10
    assert len(index_video(tmp_path / "turn.mp4").time) == 10
