"""A session cut from a dataset is solved and judged by the ordinary commands."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.commands import dataset as sessions
from markerscope.solver.commands.dataset import write_sessions
from markerscope.solver.commands.solve import solve_session
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.metrics import points_at
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.datasets.request import DatasetRequest
from markerscope.solver.datasets.umpm import UMPM
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.motion_in import read_motion
from markerscope.solver.pipeline.session import load_session, save_session
from tests.fit.conftest import simulate
from tests.synthetic import QUICK, record


def test_a_window_is_solved_and_lands_on_the_recordings_clock(
    tmp_path: Path, free_body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sessions.DATASETS, "umpm", replace(UMPM, window_s=2.0, padding_s=0.5))
    scene = simulate(free_body, 4, frames=120)
    recorded = record(tmp_path, scene)
    positions = scene.seen.markers
    labels = tuple(f"mark{i}" for i in range(positions.shape[1]))
    path = tmp_path / "umpm" / "p1_walk_1" / "Groundtruth" / "p1_walk_1.c3d"
    path.parent.mkdir(parents=True)
    write_c3d(path, Markers(positions, recorded.rate, labels), up="z")
    (tmp_path / "priors").mkdir()
    recorded.prior.rename(tmp_path / "priors" / "p1_walk_1.npz")
    out = tmp_path / "out"
    write_sessions(DatasetRequest("umpm", tmp_path / "umpm", out, priors=tmp_path / "priors"))
    (entry,) = json.loads((out / "sessions.json").read_text())["sessions"]
    folder = out / entry["session"]
    session = load_session(folder)
    save_session(replace(session, settings={**session.settings, **{k: dict(v) for k, v in QUICK.items()}}))
    outcome = solve_session(SolveRequest(folder))
    assert outcome.out == folder
    motion = read_motion(folder)
    assert motion.time is not None and motion.joints is not None
    assert motion.time[[0, -1]] == pytest.approx([0.5, 2.5 - 1 / 30])
    clock = np.arange(len(scene.joints)) / recorded.rate
    truth = points_at(clock, scene.joints, motion.time)
    error = 1000 * np.linalg.norm(motion.joints - truth, axis=2)[:, :22].mean()
    assert error < 30, f"joints are {error:.1f} mm off"


@pytest.fixture(scope="module")
def free_body() -> Body:
    from markerscope.solver.body.bones import with_bone_lengths

    return with_bone_lengths(Body.load())
