"""What the window writes, asked for by its own dialogs and read back by other programs' means."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import av
import ezc3d
import numpy as np
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFileDialog, QLineEdit, QProgressDialog

from markerscope.app.models.exports import formats
from markerscope.app.window import exporting
from markerscope.app.window.main import MainWindow
from markerscope.solver.io import load_markers
from markerscope.solver.pipeline.session import Session
from markerscope.widgets.dialogs.export_dialog import ExportDialog
from markerscope.widgets.images import to_rgb

Spin = Callable[..., None]
Answer = Callable[[Callable[[Any], None]], None]


@pytest.fixture
def window(open_window: Callable[..., MainWindow], spin: Spin, session: Session) -> MainWindow:
    """On a solved session, with its video."""
    made = open_window(real=True)
    made.resize(1100, 700)
    made.open_path(session.folder)
    spin(lambda: made.shown.track is not None and made.shown.get("angles") is not None, "the results")
    spin(lambda: made.bench.frames is not None and made.bench.frames.done, "the video")
    return made


def film(path: Path) -> tuple[np.ndarray, float]:
    """Frames (T, H, W, 3) and their rate in Hz."""
    with av.open(str(path)) as container:
        rate = container.streams.video[0].average_rate
        assert rate is not None
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    return np.array(pictures), float(rate)


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Share of the pixels that are others, beyond what a film loses."""
    return float((np.abs(a.astype(int) - b.astype(int)).max(axis=-1) > 40).mean())


def test_every_format_by_the_dialog(window: MainWindow, answer: Answer, spin: Spin, tmp_path: Path) -> None:
    out = tmp_path / "for others"
    out.mkdir()
    (out / "angles.mot").write_text("old")
    said: list[str] = []

    def agree(dialog: ExportDialog) -> None:
        assert {name for name, box in dialog.boxes.items() if box.isChecked()} == {"angles", "mot", "c3d", "report"}
        for box in dialog.boxes.values():
            box.setChecked(True)
        dialog.folder.setText("")
        assert not dialog.export_button.isEnabled(), "a folder is needed"
        dialog.folder.setText(str(out))
        said.append(dialog._files.text())
        dialog.export_button.click()

    answer(agree)
    assert window.table.trigger("export.files")
    assert "replaced: angles.mot" in said[0] and said[0].count("angles.json") == 1
    sometimes = {"markers_labelled.filled.csv", "angles_as_recorded.csv"}
    named = {name for known in formats() for name in known.files} - sometimes
    assert {path.name for path in out.iterdir()} - sometimes == named
    assert window.messages.messages()[0].what.endswith("files written")

    current = window.bench.board.current
    angles, markers = current["angles"], current["markers"]
    column = angles.names.index("knee_angle_r")
    wide = list(csv.DictReader((out / "angles.csv").open()))
    assert [float(row["knee_angle_r"]) for row in wide] == pytest.approx(angles.degrees[:, column], abs=1e-3)
    assert [float(row["time"]) for row in wide] == pytest.approx(angles.time, abs=1e-6)
    long = [row for row in csv.DictReader((out / "angles_long.csv").open()) if row["angle"] == "knee_angle_r"]
    assert [float(row["degrees"]) for row in long] == pytest.approx(angles.degrees[:, column], abs=1e-3)
    about = json.loads((out / "angles.json").read_text())
    assert about["stages"]["sync"]["settings"]["offset"] == 0.37

    head, _, body = (out / "angles.mot").read_text().partition("endheader\n")
    rows = [line.split("\t") for line in body.strip().splitlines()]
    assert "inDegrees=yes" in head and f"nRows={len(rows) - 1}" in head
    at = rows[0].index("knee_angle_r")
    assert [float(row[at]) for row in rows[1:]] == pytest.approx(angles.degrees[:, column], abs=1e-3)

    c3d = ezc3d.c3d(str(out / "markers_labelled.c3d"))
    labels = c3d["parameters"]["POINT"]["LABELS"]["value"]
    assert len(labels) == len(markers.labels) and not set(labels) & set(markers.labels), "named after bones"
    points, kept = c3d["data"]["points"][:3].transpose(2, 1, 0) / 1000, markers.present
    measured = c3d["data"]["meta_points"]["residuals"][0].T > 0
    lab = np.einsum("ji,tmj->tmi", markers.R_lab_internal, markers.positions)
    distance = np.minimum(np.abs(points - lab).max(axis=-1), np.abs(points - markers.positions).max(axis=-1))
    assert distance[kept & measured].max() < 1e-4
    trc = load_markers(out / "markers_labelled.trc")
    both = trc.present & kept
    assert trc.labels == tuple(labels) and np.abs(trc.positions - markers.positions)[both].max() < 1e-5

    bvh = (out / "motion.bvh").read_text()
    frames = int(re.search(r"Frames:\s*(\d+)", bvh)[1])  # type: ignore[index]
    channels = sum(int(n) for n in re.findall(r"CHANNELS (\d+)", bvh))
    values = [line.split() for line in bvh.partition("Frame Time")[2].splitlines()[1:]]
    assert frames == len(angles.time) == len(values) and {len(row) for row in values} == {channels}
    with np.load(out / "motion.npz") as motion:
        assert motion["poses"].shape == (frames, 72) and motion["trans"].shape == (frames, 3)
        assert float(motion["mocap_frame_rate"]) == markers.rate
        assert np.isfinite(motion["poses"]).all() and np.ptp(motion["poses"][:, 12:18]) > 0.05, "the knees bend"
    assert json.loads((out / "camera.json").read_text())

    views = sorted((out / "views").iterdir())
    assert len(views) >= 4
    for view in views:
        picture = to_rgb(QImage(str(view)))
        assert picture.shape[0] > 80 and picture.std() > 10, f"{view.name} shows nothing"

    report = (out / "report.html").read_text()
    assert not re.findall(r"""(?:src|href)=["'](?!data:|#)""", report), "in need of no other file"
    assert report.count("data:image/png;base64") >= len(views)
    for figure in ("Confidence", "Marker residual", "Marker to skin", "Sync offset", "Reprojection", "SHA-256"):
        assert figure in report, figure
    for setting in ("offset_mm", "prior_deg", "video_share", "convention"):
        assert setting in report, setting
    assert markers.labels[0] in report and "knee" in report.lower()


def save_as(path: Path) -> Callable[[QFileDialog], None]:
    def act(dialog: QFileDialog) -> None:
        # Typed, as a user would: selectFile() leaves a name alone that has the focus.
        dialog.findChild(QLineEdit, "fileNameEdit").setText(str(path))
        dialog.accept()

    return act


def test_a_picture_of_the_scene_angles_under_another_name_and_nothing(
    window: MainWindow, answer: Answer, tmp_path: Path
) -> None:
    answer(save_as(tmp_path / "front view"))
    shown = to_rgb(window.scene.image())
    assert window.table.trigger("export.picture")
    written = QImage(str(tmp_path / "front view.png"))
    assert (written.width(), written.height()) == (2 * shown.shape[1], 2 * shown.shape[0])
    fine = to_rgb(written).astype(float)
    small = fine.reshape(shown.shape[0], 2, shown.shape[1], 2, 3).mean(axis=(1, 3))
    assert apart(small, shown) < 0.05 and small.std() > 10
    answer(save_as(tmp_path / "left knee"))
    assert window.table.trigger("export.angles")
    assert (tmp_path / "left knee.csv").exists() and (tmp_path / "left knee.json").exists()
    before = {path.name for path in tmp_path.rglob("*")}
    answer(lambda dialog: dialog.reject())
    window.table.trigger("export.files")
    assert {path.name for path in tmp_path.rglob("*")} - before <= {"view.json", "journal.json"}


def test_a_turntable(window: MainWindow, answer: Answer, spin: Spin, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(exporting, "_TURN_S", 0.32)
    camera, still = window.scene.camera_state(), to_rgb(window.scene.image())
    answer(save_as(tmp_path / "turn.mp4"))
    assert window.table.trigger("export.turntable"), window.said  # type: ignore[attr-defined]
    pictures, rate = film(tmp_path / "turn.mp4")
    assert rate == 25 and len(pictures) == 8
    height, width = pictures.shape[1:3]
    assert apart(pictures[0], still[:height, :width]) < 0.02, "it begins as the scene is seen"
    assert apart(pictures[0], pictures[4]) > 0.03, "half round, the scene is seen from behind"
    assert apart(pictures[0], pictures[4]) > apart(pictures[0], pictures[7]) * 0.8
    assert window.scene.camera_state() == camera
    assert "turn.mp4 written" in window.messages.messages()[0].what


def test_playback_at_half_speed_of_a_range(window: MainWindow, answer: Answer, spin: Spin, tmp_path: Path) -> None:
    clock = window.bench.clock
    clock.set_loop((2.2, 2.36))
    clock.set_speed(0.5)
    clock.seek(2.9)
    spin()
    before = clock.time
    answer(save_as(tmp_path / "play.mp4"))
    assert window.table.trigger("export.playback"), window.said  # type: ignore[attr-defined]
    pictures, rate = film(tmp_path / "play.mp4")
    assert rate == 25 and len(pictures) == 8, "0.16 s at half speed are 0.32 s, 25 frames a second"
    assert clock.time == before and not clock.playing
    for k in (0, 7):
        clock.seek(2.2 + k * 0.02)
        spin()
        height, width = pictures.shape[1:3]
        assert apart(pictures[k], to_rgb(window.scene.image(1.0, (width, height)))) < 0.02, f"frame {k}"


def test_a_film_that_is_stopped_leaves_nothing(
    window: MainWindow, answer: Answer, spin: Spin, tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setattr(exporting, "_TURN_S", 40.0)
    camera = window.scene.camera_state()
    target = tmp_path / "films" / "turn.mp4"
    target.parent.mkdir()
    target.write_bytes(b"an older film")
    texts: list[str] = []

    def stop(dialog: QProgressDialog) -> None:
        texts.append(dialog.labelText())
        dialog.cancel()

    answer(stop)
    window.bench.attempt(lambda: window.asks.showing.write("turntable", target))  # type: ignore[attr-defined]
    assert texts == ["Turntable: 1000 frames into turn.mp4"]
    assert [path.name for path in target.parent.iterdir()] == ["turn.mp4"]
    assert target.read_bytes() == b"an older film"
    assert window.scene.camera_state() == camera
    assert not [said for said in window.said if said.level == "error"]  # type: ignore[attr-defined]


def test_messages_that_come_while_a_film_is_written_do_not_end_it(
    window: MainWindow, spin: Spin, tmp_path: Path
) -> None:
    from markerscope.app.models.workbench import Said

    window.bench.clock.set_loop((2.2, 2.32))
    window.bench.say(Said("warning", "Something else", "elsewhere"))
    spin()
    drawn, heights = window.scene_binder.draw, []

    def draw() -> None:
        heights.append(window.scene.height())
        if len(heights) == 2:
            window.messages.clear()
        drawn()

    window.scene_binder.draw = draw  # type: ignore[method-assign]
    window.asks.showing.write("playback", tmp_path / "play.mp4")  # type: ignore[attr-defined]
    assert len(film(tmp_path / "play.mp4")[0]) == 3
    assert heights[2] > heights[0], "the scene became higher meanwhile"
