"""The benchmark of cleaning: what it hides it compares with, and its figures are those of a method that is exact."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.insert import put
from markerscope.app.cli.main import main
from markerscope.solver.bench.clean import _outliers, resampled, run_clean_bench
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.export_c3d import write_c3d


def recording(path: Path) -> Path:
    """12 markers on a rigid body that swings, 120 Hz."""
    rng = np.random.default_rng(0)
    time = np.arange(600) / 120
    angle = np.sin(2 * np.pi * 0.4 * time)
    R = np.zeros((600, 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0], R[:, 0, 1], R[:, 2, 2] = np.sin(angle), -np.sin(angle), 1
    positions = np.einsum("tij,mj->tmi", R, rng.uniform(-0.3, 0.3, (12, 3))) + np.array([0, 0, 1])
    positions += 0.3 * np.sin(time)[:, None, None]
    write_c3d(path, Markers(positions, 120.0, tuple(f"m{i}" for i in range(12))))
    return path


def test_an_exact_method_has_no_error_and_every_sample_is_counted(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    recording(tmp_path / "in" / "swing.c3d")
    (tmp_path / "in" / "broken.c3d").write_text("no recording")
    tables = run_clean_bench(tmp_path / "in", None, tmp_path / "out", seeds=1, methods=("rigid", "linear"))
    assert [(row.method, row.lost) for row in tables.fills] == [
        (method, share) for share in (0.05, 0.2) for method in ("rigid", "linear")
    ]
    for row in tables.fills:
        assert (row.recording, row.frames, row.markers) == ("swing", 300, 12)
        if row.method == "rigid":
            assert row.mean_cm < 1e-3
            assert row.sure_filled == row.filled > 0.7
        else:
            assert row.mean_cm > 1
    assert {row.rate for row in tables.outliers} == {60.0, 120.0}
    for row in tables.outliers:
        assert row.f1 == pytest.approx(2 * row.precision * row.recall / (row.precision + row.recall))
        assert row.f1 > 0.95 or row.method == "prominence"
        assert row.own == 0, "nothing jumps in it"
        assert row.f1_apart == row.f1
    assert len(tables.left_out) == 1
    assert "mean of 1" in (tmp_path / "out" / "clean.md").read_text()
    assert len(json.loads((tmp_path / "out" / "clean.json").read_text())["fills"]) == 4


def test_jumps_that_a_recording_came_with_are_told_apart() -> None:
    """Samples that jump all by themselves were not displaced on purpose: each is a false one, and can be set aside."""
    rng = np.random.default_rng(3)
    path = np.cumsum(rng.normal(scale=1e-4, size=(400, 12, 3)), axis=0) + rng.uniform(-1, 1, (1, 12, 3))
    path[5:395:10, 4] += [0, 0.1, 0]
    rows = [row for row in _outliers("made up", path, 60.0, 2) if row.method == "local"]
    for row in rows:
        assert row.own == 39
        assert row.precision < 0.85
        assert row.f1_apart > 0.95 > row.f1


def test_resampling_keeps_a_cubic_and_what_is_lost() -> None:
    time = np.arange(101.0)
    positions = np.stack([time**2, time, 0 * time], axis=1)[:, None]
    positions[50] = np.nan
    found = resampled(positions, 100.0, 60.0)
    at = np.arange(1, 99, 100 / 60)[: len(found)]
    there = np.isfinite(found[:, 0, 0])
    assert np.abs(found[there, 0, 0] - at[there] ** 2).max() < 1e-9
    assert not there[np.abs(at - 50) < 1].any()
    assert np.array_equal(resampled(positions, 100.0, 50.0), positions[::2], equal_nan=True)


def test_the_command_leaves_a_table_for_its_page(tmp_path: Path) -> None:
    (tmp_path / "recordings").mkdir()
    recording(tmp_path / "recordings" / "swing.c3d")
    words = ["bench", "clean", "--motions", str(tmp_path / "recordings"), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(words) == 0
    readme = tmp_path / "README.md"
    readme.write_text("<!-- bench:clean begin -->\n<!-- bench:clean end -->\n")
    assert put(tmp_path / "out", [readme]) == ("clean", readme)
    text = readme.read_text()
    assert "`markerscope bench clean --motions recordings`" in text
    assert "| swing | 300 x 12 | 5 % | regression |" in text
    assert "| swing | 120 | single samples | local |" in text
    assert "linear" not in text, "all methods are in clean.md"


def test_a_folder_has_to_be_named(tmp_path: Path, capsys) -> None:
    assert main(["bench", "clean", "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert "--motions: names no folder of recordings" in capsys.readouterr().err
    with pytest.raises(InputError, match="holds no recording"):
        run_clean_bench(tmp_path, None, None)
