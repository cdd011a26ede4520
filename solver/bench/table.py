"""The records of all runs as rows: median, worst and count of every figure, for people and for machines."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

Record = Mapping[str, Any]

FIGURES: dict[str, str] = {
    "mpjpe_mm": "MPJPE mm",
    "part_mpjpe_mm": "of the part mm",
    "pa_mpjpe_mm": "PA-MPJPE mm",
    "mpjve_mm_s": "MPJVE mm/s",
    "v2v_mm": "V2V mm",
    "m2s_mm": "m2s mm",
    "right_bones": "right bones %",
    "sync_error_ms": "sync off by ms",
    "warm_s": "warm s",
    "cpu_s": "CPU s",
    "cold_s": "cold s",
    "memory_gb": "memory GB",
}
"""Columns that have a median, a worst and a count."""
_PERCENT = ("right_bones",)
_LESS_IS_WORSE = ("right_bones",)
SHARES = {"right_part": "right part", "right_yaw": "right yaw"}
"""Columns that count how often something was right."""
BINS = (
    (0.0, 0.6, "below 0.6"),
    (0.6, 0.9, "0.6 to 0.9"),
    (0.9, 0.99, "0.9 to 0.99"),
    (0.99, math.inf, "0.99 and more"),
)
"""Stated confidence, from and below."""
SURE = 0.9
"""From this confidence on a method need not name other answers."""


@dataclass(frozen=True)
class Figure:
    """One figure over all runs of a row; ``count`` is of the runs that have it."""

    median: float
    worst: float
    count: int


@dataclass(frozen=True)
class Row:
    """All runs of one case by one method.

    Attributes
    ----------
    case, method : which
    runs, failed, timed_out : how many there were, how many of them ended without an answer
    figures : by name
    shares : by name, (times right, of how many)
    """

    case: str
    method: str
    runs: int
    failed: int
    timed_out: int
    figures: Mapping[str, Figure]
    shares: Mapping[str, tuple[int, int]]


@dataclass(frozen=True)
class Bin:
    """Runs whose method was about so sure.

    Attributes
    ----------
    method, confidence : which
    count, right : how many, and how many of them were right
    named : how many of them named the true answer
    """

    method: str
    confidence: str
    count: int
    right: int
    named: int


def rows_of(records: Sequence[Record], cold: Mapping[tuple[str, str], float]) -> tuple[Row, ...]:
    """One row a case and method, in the order in which they first come; steps of a method are rows of their own.

    Parameters
    ----------
    cold : s, by case and method, where it was measured
    """
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        case, method = record["case"], record["method"]
        for step, figures in record.get("steps", {}).items():
            groups.setdefault((case, f"{method}, {step}"), []).append({**figures, "status": "done"})
        groups.setdefault((case, method), []).append(record)
    return tuple(_row(case, method, group, cold.get((case, method))) for (case, method), group in groups.items())


def _row(case: str, method: str, group: Sequence[Record], cold: float | None) -> Row:
    done = [record for record in group if record["status"] == "done"]
    figures = {
        name: figure for name in FIGURES if (figure := _figure(name, [_value(r, name) for r in done])) is not None
    }
    if cold is not None:
        figures["cold_s"] = Figure(cold, cold, 1)
    return Row(
        case,
        method,
        len(group),
        sum(record["status"] == "failed" for record in group),
        sum(record["status"] == "timed out" for record in group),
        figures,
        {name: (sum(bool(record[name]) for record in done), len(done)) for name in SHARES},
    )


def _value(record: Record, name: str) -> float | None:
    if name == "sync_error_ms":
        error = record.get("sync_error_s")
        return None if error is None else 1000 * abs(error)
    return record.get(name)


def _figure(name: str, values: Sequence[float | None]) -> Figure | None:
    known = [value for value in values if value is not None and math.isfinite(value)]
    if not known:
        return None
    worst = min(known) if name in _LESS_IS_WORSE else max(known)
    return Figure(median(known), worst, len(known))


def bins_of(records: Sequence[Record]) -> tuple[Bin, ...]:
    """How often each method was right, by how sure it said it was."""
    found = []
    for method in dict.fromkeys(record["method"] for record in records):
        done = [r for r in records if r["method"] == method and r["status"] == "done"]
        for low, high, name in BINS:
            inside = [r for r in done if r["confidence"] is not None and low <= r["confidence"] < high]
            if inside:
                right, named = (sum(bool(r[key]) for r in inside) for key in ("right", "named"))
                found.append(Bin(method, name, len(inside), right, named))
    return tuple(found)


def markdown_of(rows: Sequence[Row], bins: Sequence[Bin]) -> str:
    """Both tables."""
    parts = any(abs(r.figures["part_mpjpe_mm"].median - r.figures["mpjpe_mm"].median) > 1e-9 for r in rows if r.figures)
    names = [
        name for name in FIGURES if any(name in row.figures for row in rows) and (parts or name != "part_mpjpe_mm")
    ]
    header = ["case", "method", "runs", *SHARES.values(), *(FIGURES[name] for name in names)]
    lines = [line(header), line(["---"] * len(header))]
    for row in rows:
        shares = [f"{100 * hit / of:.0f} % of {of}" if of else "–" for hit, of in row.shares.values()]
        lines.append(line([row.case, row.method, _runs(row), *shares, *(_cell(row, name) for name in names)]))
    if bins:
        lines += ["", "How often a method was right, by how sure it said it was:", ""]
        header = ["method", "confidence", "runs", "right", "true answer among those named"]
        lines += [line(header), line(["---"] * len(header))]
        lines += [
            line([b.method, b.confidence, str(b.count), _share(b.right, b.count), _share(b.named, b.count)])
            for b in bins
        ]
    return "\n".join(lines) + "\n"


def _runs(row: Row) -> str:
    notes = [f"{count} {what}" for count, what in ((row.failed, "failed"), (row.timed_out, "timed out")) if count]
    return f"{row.runs} ({', '.join(notes)})" if notes else str(row.runs)


def _share(part: int, whole: int) -> str:
    return f"{part} ({100 * part / whole:.0f} %)"


def _cell(row: Row, name: str) -> str:
    figure = row.figures.get(name)
    if figure is None:
        return "–"
    digits: Callable[[float], str] = _percent if name in _PERCENT else _number
    text = digits(figure.median)
    if figure.count > 1:
        text += f" ({digits(figure.worst)})"
    wanted = row.runs - row.failed - row.timed_out
    return text if name == "cold_s" or figure.count == wanted else f"{text} of {figure.count}"


def _number(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 99.95 else f"{value:.1f}" if abs(value) >= 9.995 else f"{value:.2f}"


def _percent(value: float) -> str:
    return f"{100 * value:.0f}"


def line(cells: Sequence[str]) -> str:
    """A row in Markdown."""
    return f"| {' | '.join(cells)} |"
