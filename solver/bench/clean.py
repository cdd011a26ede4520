"""How well gaps are filled and outliers found on real recordings, with gaps and jumps made on purpose."""

from __future__ import annotations

import datetime
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.bench.clean_tables import CleanTables, FillRow, OutlierRow
from markerscope.solver.bench.machine import machine
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.bench.runner import write_tables
from markerscope.solver.cleaning.fill import METHODS, fill
from markerscope.solver.cleaning.gap_model import GapModel, draw_gaps, draw_shifts, heavy_tailed, read_gap_statistics
from markerscope.solver.cleaning.gaps import Filled, FillSettings
from markerscope.solver.cleaning.outliers import OutlierSettings, find_outliers
from markerscope.solver.cleaning.request import Method, OutlierMethod
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome

RATE = 60.0
"""Hz that gaps are filled at."""
SHARES = (0.05, 0.2)
"""Of the samples that are there, hidden."""
_SHORT = ("regression", "edm", "local")
"""Methods of the short table: the defaults, and the published filling."""
_JUMPING = 0.01
_SMALLEST, _LARGEST = 0.01, 0.10
_SEEN = 0.1
_FEWEST_MARKERS, _FEWEST_FRAMES = 10, 60
_EVERYTHING = FillSettings(min_confidence=0.0, max_gap=None)


def run_clean_bench(
    folder: Path,
    gaps: Path | None,
    out: Path | None,
    seeds: int = 3,
    progress: Progress = silent,
    methods: Sequence[Method] = tuple(METHODS),
) -> CleanTables:
    """Hide samples of every recording in a folder, fill them, and compare; displace samples and look for them.

    Parameters
    ----------
    folder : of C3D, TRC and CSV files
    gaps : statistics of real gaps, see ``read_gap_statistics``; None takes the heavy-tailed model
    out : folder for ``clean.md`` and ``clean.json``; None writes nothing
    seeds : draws for each recording

    Raises
    ------
    InputError : no recording in the folder can be used
    """
    model = heavy_tailed() if gaps is None else read_gap_statistics(gaps)
    recordings, left_out = read_recordings(folder)
    fills: list[FillRow] = []
    outliers: list[OutlierRow] = []
    for i, (name, positions, rate) in enumerate(recordings):
        progress(i / len(recordings), name)
        even = resampled(positions, rate, RATE)
        for share in SHARES:
            fills += [_filled(name, even, share, method, model, seeds) for method in methods]
        for hz in [RATE, *([rate] if rate > RATE * 1.05 else [])]:
            outliers += _outliers(name, resampled(positions, rate, hz), hz, seeds)
    tables = CleanTables(tuple(fills), tuple(outliers), left_out)
    if out is not None:
        write_tables(out, {"clean.md": tables.markdown(), "clean.json": json_text(asdict(tables)) + "\n"})
    progress(1.0, "done")
    return tables


def clean_suite(request: BenchRequest, progress: Progress = silent) -> Outcome:
    """What ``markerscope bench clean`` does.

    Raises
    ------
    InputError : no folder of recordings was named, or nothing in it can be used
    """
    if request.motions is None or not request.motions.is_dir():
        raise InputError("names no folder of recordings", "--motions", "name a folder of C3D, TRC or CSV files")
    tables = run_clean_bench(request.motions, request.gaps, request.out, request.seeds, progress)
    header = {
        "suite": "clean",
        "command": request.command,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "version": __version__,
        "machine": machine(),
        "seeds": request.seeds,
    }
    short = _said(header) + tables.markdown(_SHORT, _SHORT)
    write_tables(request.out, {"bench.md": short, "bench.json": json_text(header | asdict(tables)) + "\n"})
    lines = (*tables.markdown().splitlines(), f"Tables are in {request.out}; bench.md has those of the defaults.")
    return Outcome(summary={"suite": "clean", "out": str(request.out), **asdict(tables)}, lines=lines)


def _said(header: dict[str, Any]) -> str:
    on = header["machine"]
    return (
        f"`{header['command']}`\n\n"
        f"{header['date']}, Markerscope {header['version']}, {on['processor']}, {on['cores']} cores, {on['system']}, "
        f"Python {on['python']}; one thread, other work beside it.\n\n"
        f"Real recordings at {RATE:g} Hz, outliers at their own rate too; {header['seeds']} draws of gaps "
        "and jumps each. What is hidden is what is judged: where a recording's own tracks are broken, so is the truth. "
        "`found untouched` counts samples cut from a recording as it is.\n\n"
    )


def read_recordings(folder: Path) -> tuple[list[tuple[str, np.ndarray, float]], tuple[str, ...]]:
    """Name, (T, M, 3) m and rate of what can be used, and a sentence for what cannot."""
    from markerscope.solver.io import load_markers

    found, left_out = [], []
    files = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in (".c3d", ".trc", ".csv")]
    for path in files:
        try:
            markers = load_markers(path)
        except InputError as error:
            left_out.append(str(error))
            continue
        positions = markers.positions[:, markers.present.mean(axis=0) > _SEEN]
        frames = len(positions) * RATE / markers.rate
        if positions.shape[1] < _FEWEST_MARKERS or frames < _FEWEST_FRAMES or markers.rate < RATE:
            left_out.append(f"{path.name}: too few markers, frames or frames a second.")
            continue
        found.append((path.stem, positions, markers.rate))
    if not found:
        raise InputError("holds no recording that can be used", folder, "name a folder of C3D, TRC or CSV files")
    return found, tuple(left_out)


def resampled(positions: np.ndarray, rate: float, wanted: float) -> np.ndarray:
    """(T', M, 3) m at another rate, by the cubic through four samples; lost where one of them is."""
    if abs(rate / wanted - round(rate / wanted)) < 1e-6:
        return positions[:: round(rate / wanted)]
    times = np.arange(1, len(positions) - 2, rate / wanted)
    left = times.astype(int)
    s = (times - left)[:, None, None]
    a, b, c, d = (positions[left + k] for k in (-1, 0, 1, 2))
    return np.asarray(b + 0.5 * s * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a))))


def _filled(name: str, truth: np.ndarray, share: float, method: Method, model: GapModel, seeds: int) -> FillRow:
    from scipy.stats import spearmanr

    present = np.isfinite(truth).all(axis=2)
    settings = FillSettings(method, _EVERYTHING.max_gap, _EVERYTHING.min_confidence)
    usual = FillSettings(method)
    errors, sure, pairs = [], [], []
    hidden_in_all, seconds = 0, 0.0
    for seed in range(seeds):
        hidden = draw_gaps(present, model, share, seed)
        given = np.where(hidden[..., None], np.nan, truth)
        start = time.process_time()
        found = fill(given, RATE, settings)
        seconds += time.process_time() - start
        off = np.linalg.norm(found.positions - truth, axis=2)
        errors.append(off[hidden & found.filled])
        hidden_in_all += int(hidden.sum())
        kept = _within(found, usual)
        sure.append(off[hidden & found.filled & kept])
        for span in found.fills:
            frames = slice(span.first, span.last + 1)
            if hidden[frames, span.marker].all():
                pairs.append((span.error, off[frames, span.marker].mean()))
    error, surely, pair = np.concatenate(errors), np.concatenate(sure), np.array(pairs).reshape(-1, 2)
    known = np.isfinite(pair).all(axis=1)
    return FillRow(
        name,
        len(truth),
        truth.shape[1],
        method,
        share,
        100 * float(error.mean()) if len(error) else np.nan,
        100 * float(np.median(error)) if len(error) else np.nan,
        100 * float(np.quantile(error, 0.95)) if len(error) else np.nan,
        len(error) / max(hidden_in_all, 1),
        100 * float(surely.mean()) if len(surely) else np.nan,
        len(surely) / max(hidden_in_all, 1),
        100 * float(pair[known, 0].mean()) if known.any() else np.nan,
        float(spearmanr(pair[:, 0], pair[:, 1])[0]) if len(pair) > 2 else np.nan,
        seeds * len(truth) / max(seconds, 1e-9),
    )


def _within(found: Filled, usual: FillSettings) -> np.ndarray:
    """(T, M) True where a filling is within the default limits."""
    kept = np.zeros_like(found.filled)
    for span in found.fills:
        short = usual.max_gap is None or span.length <= usual.max_gap * RATE
        if short and span.confidence >= usual.min_confidence:
            kept[span.first : span.last + 1, span.marker] = True
    return kept


def _outliers(name: str, truth: np.ndarray, rate: float, seeds: int) -> list[OutlierRow]:
    rows = []
    present = np.isfinite(truth).all(axis=2)
    methods: tuple[OutlierMethod, ...] = ("local", "prominence")
    untouched = {method: find_outliers(truth, rate, OutlierSettings(method=method)) for method in methods}
    for kind in ("single samples", "spans of 1 to 5"):
        for method in methods:
            right, found_in_all, true_in_all, own = 0, 0, 0, 0
            for seed in range(seeds):
                shifts = draw_shifts(present, _JUMPING, _SMALLEST, _LARGEST, seed)
                if kind != "single samples":
                    shifts = _stretched(shifts, present, seed)
                true = shifts.any(axis=2)
                found = find_outliers(truth + shifts, rate, OutlierSettings(method=method))
                right += int((found & true).sum())
                found_in_all += int(found.sum())
                true_in_all += int(true.sum())
                own += int((found & untouched[method] & ~true).sum())
            precision, recall = right / max(found_in_all, 1), right / max(true_in_all, 1)
            f1, apart = (2 * right / max(found_in_all - k + true_in_all, 1) for k in (0, own))
            count = int(untouched[method].sum())
            rows.append(OutlierRow(name, rate, kind, method, f1, precision, recall, count, apart))
    return rows


def _stretched(shifts: np.ndarray, present: np.ndarray, seed: int) -> np.ndarray:
    """Single displacements made to last 1 to 5 frames, where the marker is seen and no other comes too near."""
    rng = np.random.default_rng(seed)
    shifts = shifts.copy()
    for t, m in zip(*np.nonzero(shifts.any(axis=2))):
        end = t + int(rng.integers(1, 6))
        if end + 1 < len(shifts) and present[t : end + 1, m].all() and not shifts[t + 1 : end + 2, m].any():
            shifts[t:end, m] = shifts[t, m]
    return shifts
