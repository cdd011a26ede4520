"""The examples run as they stand, from a folder of anybody's with files that are called like ours."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
NEEDS = {"joints_for_other_programs": "xarray", "affinity_and_dendrogram": "matplotlib"}


@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(script: Path, tmp_path: Path) -> None:
    if script.stem in NEEDS:
        pytest.importorskip(NEEDS[script.stem])
    for name in ("app.py", "solver.py", "resources.py"):
        (tmp_path / name).write_text("raise RuntimeError('not ours')")
    text = script.read_text(encoding="utf-8").replace("frames=150", "frames=40").replace("frames=200", "frames=80")
    own = tmp_path / "work.py"
    own.write_text(text, encoding="utf-8")
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
