"""Rows and bins from records: what is counted, and how it is written."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.bench.descents import descents_of
from markerscope.solver.bench.table import bins_of, markdown_of, rows_of
from tests.bench.jobs import figures


def record(case: str = "a", method: str = "bundle", **changed: Any) -> dict[str, Any]:
    return {"case": case, "method": method} | figures(**changed)


@given(st.lists(st.floats(0.1, 1000), min_size=1, max_size=12))
def test_median_worst_and_count(values: list[float]) -> None:
    (row,) = rows_of([record(mpjpe_mm=value) for value in values], {})
    figure = row.figures["mpjpe_mm"]
    assert figure.median == pytest.approx(np.percentile(values, 50))
    assert (figure.worst, figure.count) == (np.max(values), len(values))


def test_runs_without_an_answer_are_counted_and_in_no_median() -> None:
    gone = {"case": "a", "method": "bundle", "sentence": "No."}
    records = [record(), record(v2v_mm=None), gone | {"status": "failed"}, gone | {"status": "timed out"}]
    (row,) = rows_of(records, {("a", "bundle"): 9.0})
    assert (row.runs, row.failed, row.timed_out) == (4, 1, 1)
    assert row.figures["mpjpe_mm"].count == 2
    assert row.figures["v2v_mm"].count == 1
    assert row.shares["right_part"] == (2, 2)
    text = markdown_of([row], [])
    assert "4 (1 failed, 1 timed out)" in text
    assert "100 % of 2" in text
    assert "12.0 of 1" in text
    assert "9.00" in text


def test_the_worst_share_of_bones_is_the_least() -> None:
    (row,) = rows_of([record(right_bones=value) for value in (0.5, 0.9, 1.0)], {})
    assert (row.figures["right_bones"].median, row.figures["right_bones"].worst) == (0.9, 0.5)
    assert "90 (50)" in markdown_of([row], [])


def test_steps_of_a_method_are_rows_before_its_own() -> None:
    step = {key: value for key, value in figures(mpjpe_mm=50.0).items() if key != "status"}
    rows = rows_of([record(method="paper", steps={"after stage 2": step})], {})
    assert [row.method for row in rows] == ["paper, after stage 2", "paper"]
    assert rows[0].figures["mpjpe_mm"].median == 50


def test_confidence_is_held_against_being_right() -> None:
    said = [
        (0.2, False, True),
        (0.59, False, False),
        (0.6, True, True),
        (0.9, True, True),
        (0.95, False, True),
        (0.99, True, True),
        (1.0, False, False),
        (None, True, True),
    ]
    bins = bins_of([record(confidence=c, right=right, named=named) for c, right, named in said])
    assert [(b.confidence, b.count, b.right, b.named) for b in bins] == [
        ("below 0.6", 2, 0, 1),
        ("0.6 to 0.9", 1, 1, 1),
        ("0.9 to 0.99", 2, 1, 2),
        ("0.99 and more", 2, 1, 1),
    ]


def test_iterations_are_told_where_a_method_says_them() -> None:
    def record(method: str, count: int | None, converged: bool = True) -> dict[str, Any]:
        info = {} if count is None else {"iterations": {"stage 2": count}, "converged": {"stage 2": converged}}
        return {"method": method, "info": info}

    told = descents_of(
        [record("paper", 400, False), record("paper", 100), record("paper", 380), record("bundle", None)]
    )
    assert "| paper | stage 2 | 3 | 380 (400) | 1 |" in told and "bundle" not in told
    assert descents_of([record("bundle", None)]) == ""
