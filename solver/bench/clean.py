"""How well gaps are filled and outliers found on real recordings, with gaps and jumps made on purpose."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from solver.bench.request import BenchRequest
from solver.clean.fill import METHODS, fill
from solver.clean.gap_model import GapModel, draw_gaps, draw_shifts, heavy_tailed, read_gap_statistics
from solver.clean.gaps import Filled, FillSettings
from solver.clean.outliers import OutlierSettings, find_outliers
from solver.clean.request import Method, OutlierMethod
from solver.errors import InputError
from solver.io.atomic import make_folder, write_text_atomic
from solver.pipeline.request import Outcome
from solver.progress import Progress, silent

RATE = 60.0
"""Hz that gaps are filled at."""
SHARES = (0.05, 0.2)
"""Of the samples that are there, hidden."""
_JUMPING = 0.01
_SMALLEST, _LARGEST = 0.01, 0.10
_SEEN = 0.1
_FEWEST_MARKERS, _FEWEST_FRAMES = 10, 60
_EVERYTHING = FillSettings(min_confidence=0.0, max_gap=None)


@dataclass(frozen=True)
class FillRow:
    """One method on one recording, over all seeds.

    Attributes
    ----------
    recording, frames, markers, method, lost : which; ``lost`` is the share of samples hidden
    mean_cm, median_cm, p95_cm : distance of filled samples from the truth, everything filled that the method can
    filled : share of the hidden samples that is
    sure_mean_cm, sure_filled : the same with the default limits of confidence and length
    expected_cm : mean of the errors that were expected
    rank_correlation : of confidence and minus error, over the gaps (Spearman)
    frames_per_s : of processor time
    """

    recording: str
    frames: int
    markers: int
    method: str
    lost: float
    mean_cm: float
    median_cm: float
    p95_cm: float
    filled: float
    sure_mean_cm: float
    sure_filled: float
    expected_cm: float
    rank_correlation: float
    frames_per_s: float


@dataclass(frozen=True)
class OutlierRow:
    """One way of finding outliers on one recording, over all seeds; ``kind``: single samples, or spans of up to 5."""

    recording: str
    rate: float
    kind: str
    method: str
    f1: float
    precision: float
    recall: float


@dataclass(frozen=True)
class CleanTables:
    """All rows, and what was left out and why."""

    fills: tuple[FillRow, ...]
    outliers: tuple[OutlierRow, ...]
    left_out: tuple[str, ...]

    def markdown(self) -> str:
        """Both tables; the mean over the recordings comes last."""
        text = [
            "| recording | frames x markers | lost | method | mean error cm | median | 95 % | filled | "
            "with the limits: mean cm | filled | expected cm | rank correlation | frames/s |",
            "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        ]
        for row in (*self.fills, *_means(self.fills)):
            text.append(
                f"| {row.recording} | {row.frames} x {row.markers} | {100 * row.lost:.0f} % | {row.method} | "
                f"{row.mean_cm:.2f} | {row.median_cm:.2f} | {row.p95_cm:.2f} | {100 * row.filled:.0f} % | "
                f"{row.sure_mean_cm:.2f} | {100 * row.sure_filled:.0f} % | {row.expected_cm:.2f} | "
                f"{row.rank_correlation:.2f} | {row.frames_per_s:.0f} |"
            )
        text += [
            "",
            "| recording | Hz | outliers | method | F1 | precision | recall |",
            "|---|---|---|---|---|---|---|",
        ]
        text += [
            f"| {row.recording} | {row.rate:g} | {row.kind} | {row.method} | {row.f1:.3f} | {row.precision:.3f} | "
            f"{row.recall:.3f} |"
            for row in self.outliers
        ]
        return "\n".join([*text, "", *(f"Left out: {said}" for said in self.left_out)]) + "\n"


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
        make_folder(out)
        write_text_atomic(out / "clean.md", tables.markdown())
        write_text_atomic(out / "clean.json", json.dumps(_plain(asdict(tables)), indent=1) + "\n")
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
    lines = (*tables.markdown().splitlines(), f"Tables are in {request.out}.")
    return Outcome(summary={"suite": "clean", "out": str(request.out), **asdict(tables)}, lines=lines)


def read_recordings(folder: Path) -> tuple[list[tuple[str, np.ndarray, float]], tuple[str, ...]]:
    """Name, (T, M, 3) m and rate of what can be used, and a sentence for what cannot."""
    from solver.io import load_markers

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
    for kind in ("single samples", "spans of 1 to 5"):
        methods: tuple[OutlierMethod, ...] = ("local", "prominence")
        for method in methods:
            right, found_in_all, true_in_all = 0, 0, 0
            for seed in range(seeds):
                shifts = draw_shifts(present, _JUMPING, _SMALLEST, _LARGEST, seed)
                if kind != "single samples":
                    shifts = _stretched(shifts, present, seed)
                true = shifts.any(axis=2)
                found = find_outliers(truth + shifts, rate, OutlierSettings(method=method))
                right += int((found & true).sum())
                found_in_all += int(found.sum())
                true_in_all += int(true.sum())
            precision, recall = right / max(found_in_all, 1), right / max(true_in_all, 1)
            f1 = 2 * right / max(found_in_all + true_in_all, 1)
            rows.append(OutlierRow(name, rate, kind, method, f1, precision, recall))
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


def _means(rows: Sequence[FillRow]) -> list[FillRow]:
    """The mean over the recordings, for each method and share."""
    means = []
    for method, lost in dict.fromkeys((row.method, row.lost) for row in rows):
        alike = [asdict(row) for row in rows if (row.method, row.lost) == (method, lost)]
        figures = {
            key: float(np.nanmean([row[key] for row in alike]))
            for key in alike[0]
            if key not in ("recording", "frames", "markers", "method")
        }
        frames, markers = sum(row["frames"] for row in alike), round(np.mean([row["markers"] for row in alike]))
        means.append(FillRow(f"mean of {len(alike)}", frames, markers, method, **figures))
    return means


def _plain(value: object) -> object:
    """JSON has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
