"""The benchmark from request to table."""

from __future__ import annotations

import dataclasses
import datetime
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markerscope.solver import __version__
from markerscope.solver.bench.cases import FRAMES, Case, cases_of
from markerscope.solver.bench.cold import cold_seconds
from markerscope.solver.bench.descents import descents_of
from markerscope.solver.bench.execute import Run, with_key
from markerscope.solver.bench.keys import key_of
from markerscope.solver.bench.machine import machine
from markerscope.solver.bench.motions import MotionSource, find_motions
from markerscope.solver.bench.registry import method_named, with_ablations
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.bench.runner import run_all, write_tables
from markerscope.solver.bench.table import bins_of, markdown_of, rows_of
from markerscope.solver.core.parallel import cores
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.io.atomic import make_folder, write_text_atomic

_METHODS = ("bundle",)
_MOTIONS = {"short": 2}
FILES = ("bench.md", "bench.json")


def run_bench(request: BenchRequest, progress: Progress = silent) -> Outcome:
    """What ``markerscope bench`` does.

    Raises
    ------
    InputError : a suite, case, method or folder that there is not, or a folder that cannot be written
    """
    cases = cases_of(request.suite, request.cases, request.frames or FRAMES, request.gaps)
    methods = request.methods or _METHODS
    for name in methods:
        method_named(name)
    if request.suite == "ablation":
        methods = with_ablations(methods)
    motions = find_motions(request.motions, request.motion_count or _MOTIONS.get(request.suite, 5))
    make_folder(request.out)
    runs = runs_of(request, cases, methods, motions)
    records, computed = run_all(runs, request.out, request.workers or cores(), part_of(progress, 0.0, 0.97))
    cold = _cold(request.out, runs, part_of(progress, 0.97, 1.0))
    header = _header(request, cases, methods, motions)
    rows, bins = rows_of(records, cold), bins_of(records)
    table = markdown_of(rows, bins)
    summary = {
        **header,
        "rows": [dataclasses.asdict(row) for row in rows],
        "calibration": [dataclasses.asdict(entry) for entry in bins],
        "runs": [record["key"] for record in records],
    }
    text = f"{_said(header, cases, methods)}\n{table}{descents_of(records)}{_failures(records)}"
    write_tables(request.out, {"bench.md": text, "bench.json": json_text(summary) + "\n"})
    progress(1.0, "done")
    counts = {status: sum(r["status"] == status for r in records) for status in ("done", "failed", "timed out")}
    last = f"{len(records)} runs, {computed} of them computed now; tables and records are in {request.out}."
    return Outcome(
        summary={**summary, "out": str(request.out), "computed": computed, "counts": counts},
        lines=(*text.splitlines(), last),
    )


def runs_of(
    request: BenchRequest, cases: Sequence[Case], methods: Sequence[str], motions: Sequence[MotionSource]
) -> list[Run]:
    """Every run, in an order in which an unfinished benchmark has some of everything."""
    runs = [
        Run(
            "",
            case,
            motion,
            method,
            seed,
            request.iterations,
            request.limit,
        )
        for seed in range(request.seeds)
        for motion in motions
        for case in cases
        for method in methods
    ]
    return [with_key(run, key_of(run)) for run in runs]


def _cold(folder: Path, runs: Sequence[Run], progress: Progress) -> dict[tuple[str, str], float]:
    """s, by case and method: the first case's first run of each method again, in a process of its own."""
    first = {run.method: run for run in reversed(runs) if run.case == runs[0].case}
    found: dict[tuple[str, str], float] = {}
    for i, (method, run) in enumerate(first.items()):
        path = folder / "runs" / f"cold-{run.key}.json"
        try:
            seconds = json.loads(path.read_text(encoding="utf-8"))["cold_s"]
        except (OSError, ValueError, KeyError, TypeError):
            progress(i / len(first), f"{method} in a fresh process")
            seconds = cold_seconds(run)
            write_text_atomic(path, json.dumps({"cold_s": seconds}) + "\n")
        if seconds is not None:
            found[run.case.name, method] = float(seconds)
    return found


def _header(
    request: BenchRequest, cases: Sequence[Case], methods: Sequence[str], motions: Sequence[MotionSource]
) -> dict[str, Any]:
    return {
        "suite": request.suite,
        "command": request.command,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "version": __version__,
        "machine": machine(),
        "workers": request.workers or cores(),
        "motions": [motion.name for motion in motions],
        "seeds": request.seeds,
        "iterations": request.iterations,
        "cases": {case.name: case.about for case in cases},
        "methods": {name: method_named(name).about for name in methods},
    }


def _said(header: Mapping[str, Any], cases: Sequence[Case], methods: Sequence[str]) -> str:
    on = header["machine"]
    memory = "" if on["memory_gb"] is None else f", {on['memory_gb']:g} GB"
    cap = header["iterations"]
    lines = [
        f"`{header['command']}`",
        "",
        f"{header['date']}, Markerscope {header['version']}, {on['processor']}, {on['cores']} cores{memory}, "
        f"{on['system']}, Python {on['python']}; {header['workers']} runs at a time, one thread each.",
        "",
        f"Synthetic: bodies, markers, their errors and the video's poses; the movements are "
        f"{', '.join(header['motions'])}, {header['seeds']} sessions of each. "
        "A figure is the median over the runs, the worst in brackets.",
        "",
    ]
    if cap is not None and any(name.startswith(("paper", "registration")) for name in methods):
        lines += [f"The published method was stopped after {cap} iterations of each optimisation.", ""]
    return "\n".join(lines)


def _failures(records: Sequence[Mapping[str, Any]]) -> str:
    """The sentences of runs without an answer, each once."""
    counts: dict[str, int] = {}
    for record in records:
        if record["status"] != "done":
            sentence = f"{record['method']}, {record['status']}: {record['sentence']}"
            counts[sentence] = counts.get(sentence, 0) + 1
    return "".join(["\nRuns without an answer:\n\n", *(f"- {n} x {s}\n" for s, n in counts.items())]) if counts else ""
