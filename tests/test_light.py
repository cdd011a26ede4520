"""What nobody asked for is not loaded: torch stays out until a method or a network needs it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def forbidden(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder whose ``torch`` cannot be imported, for child processes too."""
    folder = tmp_path_factory.mktemp("hidden")
    (folder / "torch.py").write_text("raise RuntimeError('torch was imported')\n")
    return folder


def run(forbidden: Path, *words: object) -> subprocess.CompletedProcess[str]:
    paths = [str(forbidden), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    line = [sys.executable, "-m", "markerscope.app", *map(str, words)]
    return subprocess.run(line, cwd=ROOT, env=environment, capture_output=True, text=True)


def test_a_trial_is_made_cleaned_and_solved_without_torch(forbidden: Path, tmp_path: Path) -> None:
    made = tmp_path / "made"
    done = run(forbidden, "synth", "walk", "--out", made, "--frames", 60, "--markers", 20, "--seed", 1, "--quiet")
    assert done.returncode == 0, done.stderr
    done = run(forbidden, "clean", made / "markers.c3d", "--out", tmp_path / "clean.c3d", "--quiet")
    assert done.returncode == 0, done.stderr
    out = tmp_path / "out"
    done = run(forbidden, "solve", made / "markers.c3d", "--prior", made / "prior.npz", "--out", out, "--quiet")
    assert done.returncode == 0, done.stderr
    assert (out / "angles.csv").exists()


def test_the_block_would_be_seen(forbidden: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(forbidden)}
    done = subprocess.run([sys.executable, "-c", "import torch"], env=environment, capture_output=True, text=True)
    assert "torch was imported" in done.stderr
