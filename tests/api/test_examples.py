"""The examples run as they stand, from a folder of anybody's with files that are called like ours."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NEEDS = {"joints_for_other_programs": "xarray", "affinity_and_dendrogram": "matplotlib"}


@pytest.fixture
def shortened(tmp_path: Path) -> Callable[[Path], Path]:
    """A copy of an example with short trials."""

    def copy(script: Path) -> Path:
        if script.stem in NEEDS:
            pytest.importorskip(NEEDS[script.stem])
        text = script.read_text(encoding="utf-8").replace("frames=150", "frames=40").replace("frames=200", "frames=80")
        own = tmp_path / "work.py"
        own.write_text(text, encoding="utf-8")
        return own

    return copy


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(
    script: Path,
    shortened: Callable[[Path], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    own = shortened(script)
    monkeypatch.setattr(sys, "argv", [str(own), str(tmp_path / "out")])
    runpy.run_path(str(own))
    assert capsys.readouterr().out.strip()


def test_an_example_runs_among_files_that_are_called_like_ours(
    shortened: Callable[[Path], Path], tmp_path: Path
) -> None:
    own = shortened(ROOT / "examples" / "clean_only.py")
    for name in ("app.py", "solver.py", "resources.py"):
        (tmp_path / name).write_text("raise RuntimeError('not ours')")
    paths = [str(ROOT / ".links"), *([os.environ["PYTHONPATH"]] if os.environ.get("PYTHONPATH") else [])]
    done = subprocess.run(
        [sys.executable, str(own), str(tmp_path / "out")],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip()


def test_every_example_is_listed() -> None:
    page = (ROOT / "examples" / "README.md").read_text(encoding="utf-8")
    assert {path.name for path in EXAMPLES} == {word[1:-1] for word in re.findall(r"\[\w+\.py\]", page)}
