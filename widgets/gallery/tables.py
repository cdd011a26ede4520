"""Examples of the tables."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.tables.candidate_data import CandidateRecord, SearchStep
from markerscope.widgets.tables.candidates import CandidateTable
from markerscope.widgets.tables.marker_data import MarkerRows
from markerscope.widgets.tables.markers import MarkerTable


def marker_rows(markers: int = 41) -> MarkerRows:
    """Made-up markers; two were never seen."""
    rng = np.random.default_rng(3)
    group = np.sort(rng.integers(1, 10, markers))
    mean, seen = rng.gamma(4, 1.8, markers), 100 * rng.beta(12, 1, markers)
    group[-2:], mean[-2:], seen[-2:] = 0, np.nan, 0
    bones = (
        "",
        "pelvis",
        "left thigh",
        "left shank",
        "right thigh",
        "right shank",
        "left foot",
        "thorax",
        "head",
        "arm",
    )
    return MarkerRows(
        [f"M{k}" for k in range(markers)], seen, rng.integers(0, 12, markers), rng.gamma(2, 0.4, markers), group,
        [bones[g] for g in group], mean, 2.1 * mean, 3.3 * mean,
        np.where(group > 0, rng.uniform(0, 75, markers), np.nan), ["left asis"] * 4 + [""] * (markers - 4),
        np.where(np.arange(markers) < 4, 96.0, np.nan), np.where(np.arange(markers) < 4, 7.0, np.nan),
    )  # fmt: skip


def candidate_rows(count: int = 14) -> list[CandidateRecord]:
    """Made-up candidates; the last three are still in the queue."""
    rng = np.random.default_rng(5)
    parts = ("pelvis, both legs, both feet", "pelvis, both legs (sides swapped)", "thorax, both arms", "left leg, foot")
    score = np.sort(rng.gamma(9, 0.02, count))
    fates = ["refined"] * 4 + ["scored"] * (count - 7) + ["kept"] * 3
    return [
        CandidateRecord(parts[k % 4], fates[k])
        if fates[k] == "kept"
        else CandidateRecord(
            parts[k % 4], fates[k], 30.0 * (k % 12), float(rng.uniform(-180, 180)), float(rng.gamma(9, 8)),
            float(score[k]), float(score[k] / score[0]), float(rng.uniform(0.5, 1)), k == 2, k == 1,
        )
        for k in range(count)
    ]  # fmt: skip


def markers() -> QWidget:
    """41 markers, some selected."""
    made = MarkerTable()
    rows = marker_rows()
    made.set_rows(rows, palette.categorical(10)[rows.group])
    made.set_selected([3, 4])
    made.resize(max(640, made.sizeHint().width()), 360)
    return made


def candidates() -> QWidget:
    """A search that is still running; the second candidate is pinned."""
    made = CandidateTable()
    made.set_rows(candidate_rows(), 1, "Energy", "per frame", palette.categorical(14))
    steps = (("pool", 14), ("scored", 11), ("refined", 4))
    made.set_steps([SearchStep(name, f"What was {name}", tuple(range(n))) for name, n in steps], "scored")
    made.table.view.sortByColumn(0, Qt.SortOrder.AscendingOrder)
    made.set_selected(0)
    made.resize(max(700, made.sizeHint().width()), 340)
    return made


EXAMPLES = {"markers": markers, "candidates": candidates}
