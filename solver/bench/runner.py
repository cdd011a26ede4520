"""Runs spread over processes; what has been computed before is not computed again."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from markerscope.solver.bench.execute import Run, execute
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.io.together import together

_THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
_DIED = "The worker process ended without a result; the memory may have been used up."


Work = Callable[[Run], dict[str, Any]]


def run_all(
    runs: Sequence[Run], folder: Path, workers: int, progress: Progress = silent, work: Work = execute
) -> tuple[list[dict[str, Any]], int]:
    """The records of all runs, in their order, and how many of them were computed now.

    Each is kept as ``FOLDER/runs/KEY.json``, written under a temporary name and renamed.

    Parameters
    ----------
    work : what is called in a worker; importable by name
    """
    make_folder(folder / "runs")
    waiting = {run.key: run for run in runs if record_of(folder, run) is None}
    total = len(waiting)
    for done, record in enumerate(_computed(list(waiting.values()), workers, work), 1):
        write_text_atomic(record_path(folder, record["key"]), json_text(record) + "\n")
        what = f"{record['case']}, {record['method']}, {record['motion']}, seed {record['seed']}"
        progress(done / total, f"run {done} of {total}: {what}: {_said(record)}")
    records = (record_of(folder, run) for run in runs)
    return [record for record in records if record is not None], total


def record_path(folder: Path, key: str) -> Path:
    """Where a run's record is."""
    return folder / "runs" / f"{key}.json"


def record_of(folder: Path, run: Run) -> dict[str, Any] | None:
    """A run's record under the run's own names; None where there is none that can be read, or that had less time."""
    try:
        record = json.loads(record_path(folder, run.key).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(record, dict) or record.get("key") != run.key:
        return None
    if record["status"] == "timed out" and (run.limit is None or run.limit > record["limit"]):
        return None
    return record | {"case": run.case.name, "motion": run.motion.name}


def write_tables(folder: Path, texts: Mapping[str, str]) -> None:
    """Write the texts of a benchmark by file name, all or none."""
    with together(folder) as place:
        for name, text in texts.items():
            write_text_atomic(place / name, text)


def _said(record: dict[str, Any]) -> str:
    return f"{record['mpjpe_mm']:.1f} mm" if record["status"] == "done" else str(record["status"])


def _computed(runs: Sequence[Run], workers: int, work: Work) -> Iterator[dict[str, Any]]:
    """Records as they come. Runs that were in flight when a worker died are tried once more, each by itself."""
    suspects: list[Run] = []
    queue = list(reversed(runs))
    while queue:
        with _pool(min(workers, len(queue))) as pool:
            flying: dict[Future[dict[str, Any]], Run] = {}
            try:
                while queue or flying:
                    while queue and len(flying) < workers:
                        future = pool.submit(work, queue[-1])  # refused where a worker has just died
                        flying[future] = queue.pop()
                    for future in wait(flying, return_when=FIRST_COMPLETED).done:
                        yield future.result()
                        del flying[future]
            except BrokenProcessPool:
                suspects += flying.values()
    for run in suspects:
        with _pool(1) as pool:
            try:
                yield pool.submit(work, run).result()
            except BrokenProcessPool:
                yield run.about | {"status": "failed", "sentence": _DIED}


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Spawned workers of one thread each, that end at once when the block is left by an exception."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))  # read by the libraries as a worker imports them
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _started)
    try:
        yield pool
    except BaseException:
        for process in set(multiprocessing.active_children()) - others:
            process.terminate()
        pool.shutdown(wait=False, cancel_futures=True)
        raise
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    pool.shutdown()


def _started() -> None:
    """Ctrl+C in a terminal reaches the workers too; whether to stop is the parent's decision."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
