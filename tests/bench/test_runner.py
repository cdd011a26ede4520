"""Runs over processes: resumed, counted when they fail, whole when they are interrupted."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.bench import execute as execution
from markerscope.solver.bench.cases import cases_of
from markerscope.solver.bench.execute import OutOfTime, Run, execute, time_limit
from markerscope.solver.bench.keys import key_of
from markerscope.solver.bench.methods import Variant
from markerscope.solver.bench.motions import find_motions
from markerscope.solver.bench.runner import record_of, record_path, run_all
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.export_bvh import write_bvh
from markerscope.solver.pipeline.source import Changed
from tests.bench import jobs

ROOT = Path(__file__).parents[2]


def some(count: int) -> list[Run]:
    case, motion = cases_of("short", ())[0], find_motions(None, 1)[0]
    return [Run(f"{seed:032x}", case, motion, "bundle", seed) for seed in range(count)]


def test_what_is_there_is_not_computed_again(tmp_path: Path) -> None:
    runs = some(4)
    records, computed = run_all(runs, tmp_path, 2, work=jobs.answer)
    assert computed == 4
    assert [record["mpjpe_mm"] for record in records] == [10, 11, 12, 13]
    assert run_all(runs, tmp_path, 2, work=jobs.die_at_one) == (records, 0)
    record_path(tmp_path, runs[2].key).unlink()
    record_path(tmp_path, runs[3].key).write_text("{")
    assert run_all(runs, tmp_path, 2, work=jobs.answer) == (records, 2)


def test_a_worker_that_dies_is_counted_and_the_others_go_on(tmp_path: Path) -> None:
    records, _ = run_all(some(4), tmp_path, 2, work=jobs.die_at_one)
    assert [record["status"] for record in records] == ["done", "failed", "done", "done"]
    assert "memory" in records[1]["sentence"]


def test_more_time_is_another_try(tmp_path: Path) -> None:
    (run,) = some(1)
    (tmp_path / "runs").mkdir()
    gone = run.about | {"status": "timed out", "sentence": "It took more than 5 s.", "limit": 5.0}
    record_path(tmp_path, run.key).write_text(json.dumps(gone))
    assert record_of(tmp_path, replace(run, limit=4.0)) is not None
    assert record_of(tmp_path, replace(run, limit=6.0)) is None
    assert record_of(tmp_path, run) is None


def fails(error: Exception) -> Variant:
    def solve(given: object, settings: object, progress: object) -> None:
        raise error

    return Variant("fails", "never answers", solve)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("error", "status", "sentence"),
    [
        (InputError("no markers"), "failed", "no markers."),
        (KeyError("hip"), "failed", "KeyError: 'hip'"),
        (OutOfTime(), "timed out", "It took more than 9 s."),
    ],
)
def test_a_run_without_an_answer_has_a_sentence(monkeypatch, error: Exception, status: str, sentence: str) -> None:
    monkeypatch.setattr(execution, "method_named", lambda name: fails(error))
    monkeypatch.setattr(execution, "warm_up", lambda variant: None)
    record = execute(replace(some(1)[0], limit=9.0))
    assert (record["status"], record["sentence"]) == (status, sentence)
    assert record["seed"] == 0


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no such signal here")
def test_time_ends_work_that_reports_nothing() -> None:
    with pytest.raises(OutOfTime), time_limit(0.05):
        time.sleep(30)
    with time_limit(30.0):
        pass
    assert signal.getitimer(signal.ITIMER_REAL)[0] == 0


@pytest.mark.skipif(os.name != "posix", reason="signals are sent otherwise elsewhere")
def test_control_c_leaves_whole_records_and_nobody_at_work(tmp_path: Path) -> None:
    code = (
        "import signal, sys\n"
        "from pathlib import Path\n"
        "from markerscope.solver.bench.runner import run_all\n"
        "from tests.bench import jobs\n"
        "from tests.bench.test_runner import some\n"
        "if __name__ == '__main__':\n"
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        f"    run_all(some(3), Path({str(tmp_path)!r}), 2, print, jobs.sleep_after_one)\n"
    )
    script = tmp_path / "script.py"
    script.write_text(code)
    environment = {**os.environ, "PYTHONPATH": os.environ["PYTHONPATH"], "PYTHONUNBUFFERED": "1"}
    with subprocess.Popen([sys.executable, script], cwd=ROOT, env=environment, stdout=-1, stderr=-1) as process:
        assert process.stdout is not None
        process.stdout.readline()  # the first run's progress
        workers = children_of(process.pid)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=30)
    assert process.returncode != 0
    (record,) = (tmp_path / "runs").iterdir()
    assert json.loads(record.read_text())["status"] == "done"
    end = time.monotonic() + 30  # they are told to end, and may take their time
    while (left := [pid for pid in workers if Path(f"/proc/{pid}").exists()]) and time.monotonic() < end:
        time.sleep(0.1)
    assert not left


def children_of(pid: int) -> list[int]:
    """The processes that a process started, where the system lists them."""
    listed = Path(f"/proc/{pid}/task/{pid}/children")
    return [int(word) for word in listed.read_text().split()] if listed.exists() else []


def test_a_key_is_of_all_that_matters_and_of_nothing_else(tmp_path: Path) -> None:
    (run,) = some(1)
    case = run.case
    key = key_of(run)
    same = (
        replace(run, case=replace(case, name="renamed")),
        replace(run, limit=3.0),
        replace(run, iterations=5),  # the default method has none to cap
        replace(run, motion=replace(run.motion, name="renamed")),
    )
    assert {key_of(other) for other in same} == {key}
    first, second = tmp_path / "a.npz", tmp_path / "b.npz"
    first.write_bytes(b"gaps")
    second.write_bytes(b"gaps")
    gaps = [
        key_of(replace(run, case=replace(case, settings=replace(case.settings, gap_statistics=path))))
        for path in (first, second)
    ]
    assert gaps[0] == gaps[1]
    others = (
        replace(run, seed=1),
        replace(run, method="bundle-1-yaw"),
        replace(run, method="paper"),
        replace(run, method="paper", iterations=5),
        replace(run, motion=replace(run.motion, digest="another")),
        replace(run, case=replace(case, settings=replace(case.settings, slide=2.0))),
    )
    assert len({key, gaps[0], *map(key_of, others)}) == 2 + len(others)


def test_a_motion_that_changed_leaves_no_record(tmp_path: Path) -> None:
    motion = tmp_path / "walk.bvh"
    turns = np.tile(np.eye(3), (4, 2, 1, 1))
    write_bvh(motion, ("root", "tip"), np.array([-1, 0]), np.eye(2, 3), turns, np.zeros((4, 3)), 30.0)
    (source,) = find_motions(tmp_path, 1)
    motion.write_text(motion.read_text().replace("0.000000", "0.500000"))
    with pytest.raises(Changed, match="changed while it was read"):
        execute(Run("k", cases_of("short", ())[0], source, "bundle", 0))
