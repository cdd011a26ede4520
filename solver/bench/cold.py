"""A method in a fresh process, from the start of Python to the answer: ``python -m markerscope.solver.bench.cold FILE
METHOD N``.

N caps the iterations, 0 does not.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.bench.execute import Run, given_of
from markerscope.solver.bench.methods import Given, Labels
from markerscope.solver.bench.registry import method_named
from markerscope.solver.core.errors import MarkerscopeError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior


def cold_seconds(run: Run) -> float | None:
    """How long the run takes in a process of its own, s; None where it does not succeed."""
    given = given_of(run.session(), run.variant)
    with tempfile.TemporaryDirectory(prefix="markerscope-") as folder:
        path = Path(folder) / "session.npz"
        _write(path, given)
        words = [sys.executable, "-m", "markerscope.solver.bench.cold", str(path), run.method, str(run.iterations or 0)]
        root = str(Path(__file__).parents[3])
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([root, *sys.path[1:]])}
        start = time.perf_counter()
        try:
            ended = subprocess.run(words, env=environment, capture_output=True, timeout=run.limit)
        except subprocess.TimeoutExpired:
            return None
        return time.perf_counter() - start if ended.returncode == 0 else None


def _write(path: Path, given: Given) -> None:
    arrays: dict[str, Any] = {
        "positions": given.markers.positions,
        "rate": given.markers.rate,
        "first_time": given.markers.first_time,
        "rotations": given.prior.rotations,
        "tracked": given.prior.tracked,
        "time": given.prior.time,
        "offset": given.nominal_offset,
    }
    if given.prior.betas is not None:
        arrays["betas"] = given.prior.betas
    if given.labels is not None:
        arrays |= {"vertex": given.labels.vertex, "joint": given.labels.joint}
    np.savez(path, **arrays)


def _read(path: Path) -> Given:
    with np.load(path, allow_pickle=False) as data:
        names = tuple(f"M{i}" for i in range(data["positions"].shape[1]))
        return Given(
            Markers(data["positions"], float(data["rate"]), names, float(data["first_time"])),
            PosePrior(data["rotations"], data["tracked"], data["time"], data.get("betas")),
            float(data["offset"]),
            labels=Labels(data["vertex"], data["joint"]) if "vertex" in data else None,
        )


def main(path: str, method: str, iterations: str) -> int:
    """Solve the session in a file; 0 if there is an answer."""
    variant = method_named(method).capped(int(iterations) or None)
    try:
        variant.solve(_read(Path(path)), variant.settings, lambda fraction, text: None)
    except MarkerscopeError:
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
