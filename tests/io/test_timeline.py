"""Rates and missing rows from time columns as they are found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.io.timeline import even_grid


@given(
    rate=st.sampled_from([25.0, 29.97, 50.0, 59.94, 60.0, 100.0, 120.0, 250.0, 1000.0]),
    decimals=st.integers(3, 8),
    start=st.floats(0, 100),
    seed=st.integers(0, 1000),
    declared=st.booleans(),
)
def test_rate_and_dropped_rows(rate: float, decimals: int, start: float, seed: int, declared: bool) -> None:
    kept = np.flatnonzero(np.random.default_rng(seed).random(500) > 0.1)
    kept -= kept[0]
    time = np.round(start + kept / rate, decimals)
    line = even_grid(time, None, rate if declared else None)
    if (np.diff(time) == 0).any():
        return  # rounded beyond what rows can be told by
    if rate * 10.0**-decimals < 0.3:
        np.testing.assert_array_equal(line.index, kept)
        tolerance = 2e-3 if decimals < 5 and not declared else 1e-4
        assert line.rate == pytest.approx(rate, rel=tolerance), f"{line.rate} Hz"
    assert line.first_time == time[0]


def test_a_rounded_time_column_does_not_spoil_a_declared_rate() -> None:
    time = np.round(np.arange(600) / 120, 2)
    line = even_grid(time, None, 120.0)
    assert line.rate == 120
    assert line.index[-1] == 599


def test_the_time_column_wins_over_a_wrong_header() -> None:
    line = even_grid(np.arange(100) / 50, None, 100.0)
    assert line.rate == 50
    assert any("100 Hz" in note for note in line.notes)


def test_frame_numbers_alone_show_gaps() -> None:
    line = even_grid(None, np.array([7.0, 8, 11, 12]), 100.0)
    assert line.index.tolist() == [0, 1, 4, 5]
    assert line.first_time is None
    grid = line.spread(np.arange(4.0))
    np.testing.assert_array_equal(grid, [0, 1, np.nan, np.nan, 2, 3])


def test_frame_numbers_that_count_in_tens_lie_ten_apart() -> None:
    assert even_grid(None, np.array([10.0, 20, 30, 50]), 100.0).index.tolist() == [0, 1, 2, 4]


@pytest.mark.parametrize("rate", [50.0, 60.0, 100.0, 120.0, 240.0])
def test_a_whole_rate_comes_out_whole_of_a_rounded_column(rate: float) -> None:
    assert even_grid(np.round(np.arange(997) / rate, 4), None, None).rate == rate


def test_where_most_rows_are_missing_the_step_is_still_that_of_neighbours() -> None:
    kept = np.array([0, 1, 4, 5, 9, 10, 14, 17, 18, 21, 25, 26, 30])
    line = even_grid(kept / 100, None, None)
    assert line.rate == 100
    assert line.index.tolist() == kept.tolist()


@pytest.mark.parametrize(
    "time", [[0.0, 0.1, 0.05, 0.2], [0.0, 0.0, 0.0], [0.0, 1e300, 2e300], [0.0, np.nan, 0.2], [5.0], [0.0, 1e-310, 1.0]]
)
def test_damaged_time_columns_are_survived(time: list[float]) -> None:
    with np.errstate(all="ignore"):
        line = even_grid(np.array(time), None, 100.0)
    assert len(line.index) == len(time)
    assert line.index[-1] < 100 * len(time)
