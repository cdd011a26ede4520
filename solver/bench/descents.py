"""How many iterations the descents of methods took, and how many were stopped before they had converged."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from markerscope.solver.bench.table import Record, line


def descents_of(records: Sequence[Record]) -> str:
    """A table in Markdown, with a line before it; empty where no method says how many iterations it took."""
    rows = []
    for method in dict.fromkeys(record["method"] for record in records):
        told = [r["info"] for r in records if r["method"] == method and (r.get("info") or {}).get("iterations")]
        for stage in dict.fromkeys(stage for info in told for stage in info["iterations"]):
            own = [info for info in told if stage in info["iterations"]]
            counts = [int(info["iterations"][stage]) for info in own]
            stopped = sum(not info.get("converged", {}).get(stage, True) for info in own)
            rows.append([method, stage, str(len(own)), f"{median(counts):.0f} ({max(counts)})", str(stopped)])
    if not rows:
        return ""
    header = ["method", "stage", "runs", "iterations", "stopped before they converged"]
    lines = [line(header), line(["---"] * len(header)), *(line(row) for row in rows)]
    return "\n".join(["", "Iterations of the best answer, the median and the most:", "", *lines]) + "\n"
