"""A marker file through the real import dialog: what it says, what can be changed, and what becomes of it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit

from markerscope.app.models.demo import DEMO_VIDEO
from markerscope.app.window.main import MainWindow
from markerscope.widgets.dialogs.import_dialog import ImportDialog
from markerscope.widgets.images import to_rgb

Spin = Callable[..., None]
Answer = Callable[[Callable[[Any], None]], None]
FRAMES, NAMES = 40, tuple(f"p{k}" for k in range(8))


@pytest.fixture
def metres() -> np.ndarray:
    """(T, 8, 3) m, z up: points from 0.1 to 1.7 m above the floor that sway along x; the last seldom seen."""
    rng = np.random.default_rng(5)
    rest = np.column_stack([rng.uniform(-0.2, 0.2, (8, 2)), np.linspace(0.1, 1.7, 8)])
    moving = np.repeat(rest[None], FRAMES, axis=0)
    moving[:, :, 0] += 0.1 * np.sin(np.linspace(0, 6, FRAMES))[:, None]
    moving[2:, 7] = np.nan
    return moving


def table(path: Path, positions: np.ndarray, times: bool) -> Path:
    """A CSV of points by name, with or without a column of times at 50 Hz."""
    head = [f"{name}_{axis}" for name in NAMES for axis in "xyz"]
    rows = [",".join((["time"] if times else []) + head)]
    for frame, points in enumerate(positions):
        values = ["" if np.isnan(x) else f"{x:.6f}" for x in points.ravel()]
        rows.append(",".join(([f"{frame / 50:.3f}"] if times else []) + values))
    path.write_text("\n".join(rows) + "\n")
    return path


def choose(dialog: ImportDialog, field: str, value: object) -> None:
    """As a user does: the editor changes, the dialog tells, whoever reads the file answers."""
    editor = dialog.form.editor(field)
    editor.set_value(value)
    editor._tell()


def markers(window: MainWindow, spin: Spin) -> Any:
    spin(lambda: window.bench.clock.timing.frames > 0, "the markers")
    return window.bench.board.current["markers"]


def test_units_axis_points_and_a_video_by_its_side(
    open_window: Callable[..., MainWindow], answer: Answer, spin: Spin, metres: np.ndarray, tmp_path: Path
) -> None:
    y_up = metres[:, :, [1, 2, 0]] * 1000  # a lab with y up, in millimetres
    file = table(tmp_path / "walk.csv", y_up, times=True)
    shutil.copy(DEMO_VIDEO, tmp_path / "walk.mp4")
    window = open_window(real=True)

    def agree(dialog: ImportDialog) -> None:
        QApplication.processEvents()
        first = dialog.choice()
        assert (first.units, first.up, first.rate) == ("mm", "y", 50.0)
        assert first.video == str(tmp_path / "walk.mp4"), "the video of the same name is proposed"
        upright = to_rgb(dialog.preview.grab().toImage()).astype(int)
        assert dialog.points.topLevelItem(7).text(1) == "5.0 %"
        choose(dialog, "up", "z")
        lying = to_rgb(dialog.preview.grab().toImage()).astype(int)
        assert (np.abs(upright - lying).max(axis=-1) > 30).mean() > 0.005, "a wrong axis is to be seen"
        choose(dialog, "up", "y")
        choose(dialog, "units", "m")
        assert dialog._shown is not None and dialog._shown.height > 1000, "a wrong unit is to be seen"
        choose(dialog, "units", "mm")
        dialog.often.click()
        dialog.points.topLevelItem(2).setCheckState(0, Qt.CheckState.Unchecked)
        assert dialog.choice().left_out == ("p2",), "seen in 5 % is not seldom"
        dialog.all.click()
        assert dialog.choice().left_out == ()
        for row in range(8):
            dialog.points.topLevelItem(row).setCheckState(0, Qt.CheckState.Unchecked)
        assert not dialog.open_button.isEnabled(), "at least one point is needed"
        dialog.all.click()
        for row in (2, 7):
            dialog.points.topLevelItem(row).setCheckState(0, Qt.CheckState.Unchecked)
        dialog.open_button.click()

    answer(agree)
    window.open_path(file)
    read = markers(window, spin)
    assert np.abs(read.positions - metres[:, :, [1, 0, 2]] * [1, -1, 1])[read.present].max() < 1e-6 or (
        np.abs(np.sort(read.positions[0, :, 2]) - np.sort(metres[0, :, 2])).max() < 1e-6
    )
    session = window.bench.document.session
    assert session.edits == {"segment": {"left_out": [2, 7]}}
    assert session.inputs["video_file"].path == tmp_path / "walk.mp4"
    assert read.rate == pytest.approx(50)
    assert (read.labels, read.present[:, 7].sum()) == (NAMES, 2)


def test_a_file_that_names_no_rate_waits_for_one(
    open_window: Callable[..., MainWindow], answer: Answer, spin: Spin, metres: np.ndarray, tmp_path: Path
) -> None:
    file = table(tmp_path / "walk.csv", metres, times=False)
    window = open_window(real=True)

    def agree(dialog: ImportDialog) -> None:
        QApplication.processEvents()
        assert not dialog.open_button.isEnabled() and "rate" in dialog._problem.text()
        choose(dialog, "rate", 100.0)  # a rate that programs like to take for granted
        assert dialog.open_button.isEnabled(), dialog._problem.text()
        choose(dialog, "rate", 120.0)
        dialog.open_button.click()

    answer(agree)
    window.open_path(file)
    read = markers(window, spin)
    assert read.rate == 120 and window.bench.clock.span == pytest.approx((0, (FRAMES - 1) / 120))
    assert np.abs(read.positions - metres)[read.present].max() < 1e-6


def test_a_dialog_that_is_left_changes_nothing_and_a_video_can_be_looked_for(
    open_window: Callable[..., MainWindow], answer: Answer, spin: Spin, metres: np.ndarray, tmp_path: Path
) -> None:
    file = table(tmp_path / "walk.csv", metres, times=True)
    elsewhere = shutil.copy(DEMO_VIDEO, tmp_path / "camera 2.mp4")
    window = open_window(real=True)
    answer(lambda dialog: dialog.reject())
    window.open_path(file)
    assert not window.bench.document.is_open and not window.said  # type: ignore[attr-defined]

    def look(dialog: ImportDialog) -> None:
        answer(pick)
        dialog.browse_button.click()
        assert dialog.video.text() == str(elsewhere)
        dialog.open_button.click()

    def pick(dialog: QFileDialog) -> None:
        line = dialog.findChild(QLineEdit)
        assert isinstance(line, QLineEdit)
        line.setText(str(elsewhere))
        dialog.accept()

    answer(look)
    window.drop([file])
    markers(window, spin)
    assert window.bench.document.session.inputs["video_file"].path == Path(elsewhere)
