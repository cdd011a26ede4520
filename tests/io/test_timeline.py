"""Rates and missing rows from time columns as they are found."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from markerscope.solver.io.timeline import even_grid


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


rates = st.sampled_from([50.0, 60.0, 100.0, 120.0, 200.0, 240.0])


def jittered(kept: np.ndarray, rate: float, share: float, seed: int) -> np.ndarray:
    """Stamps of the frames ``kept``, each off its place by up to ``share`` of a step."""
    return (kept + np.random.default_rng(seed).uniform(-share, share, len(kept))) / rate


@given(
    rate=rates, count=st.integers(150, 900), share=st.floats(0, 0.35), start=st.sampled_from([0.0, 12.3]),
    seed=st.integers(0, 1000), declared=st.booleans(), numbered=st.booleans(),
)  # fmt: skip
def test_jitter_makes_no_frames(
    rate: float, count: int, share: float, start: float, seed: int, declared: bool, numbered: bool
) -> None:
    rows = np.arange(count)
    time = start + jittered(rows, rate, share, seed)
    line = even_grid(np.round(time, 6), rows + 5000.0 if numbered else None, rate if declared else None)
    np.testing.assert_array_equal(line.index, rows)
    assert line.rate == pytest.approx(rate, rel=1e-3)
    assert line.first_time == pytest.approx(start, abs=0.5 / rate)


@given(rate=rates, share=st.floats(0, 0.35), seed=st.integers(0, 1000), declared=st.booleans())
def test_rows_missing_among_jittered_ones_are_told_by_their_numbers(
    rate: float, share: float, seed: int, declared: bool
) -> None:
    kept = np.flatnonzero(np.random.default_rng(seed).random(600) > 0.03)
    kept -= kept[0]
    line = even_grid(jittered(kept, rate, share, seed), kept + 17.0, rate if declared else None)
    np.testing.assert_array_equal(line.index, kept)
    assert line.rate == pytest.approx(rate, rel=1e-3)
    assert any("have no row" in note for note in line.notes)


@pytest.mark.parametrize(
    ("per_second", "name"),
    [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"), (1 / 60, "minutes"), (1 / 86400, "days")],
)
@given(rate=rates, start=st.sampled_from([0.0, 3.0, 500.0]), declared=st.booleans())
def test_a_time_in_another_unit(per_second: float, name: str, rate: float, start: float, declared: bool) -> None:
    time = (start + np.arange(300) / rate) * per_second
    line = even_grid(time, None, rate if declared else None)
    assert line.rate == pytest.approx(rate)
    assert line.index[-1] == 299
    assert line.first_time == pytest.approx(start, abs=1e-6)
    assert any(name in note for note in line.notes)
    seconds = even_grid(start + np.arange(300) / rate, None, rate if declared else None)
    assert seconds.notes == ()


@pytest.mark.parametrize("per_second", [1.0, 1e3, 1e9])
def test_a_clock_that_counts_from_a_date_starts_at_the_first_row(per_second: float) -> None:
    stamps = (1714560000 * int(per_second) + np.arange(100) * int(per_second) // 100).astype(float)
    if per_second == 1:
        stamps = 1714560000 + np.arange(100) / 100
    line = even_grid(stamps, None, None)
    assert line.rate == pytest.approx(100, rel=1e-4)
    assert line.first_time == 0
    assert any("dates" in note for note in line.notes)


def test_frame_numbers_that_contradict_the_time_are_said() -> None:
    kept = np.r_[0:50, 80:130]
    line = even_grid(kept / 100, np.arange(100.0), 100.0)  # the rows were numbered anew after some were taken out
    np.testing.assert_array_equal(line.index, kept)
    assert any("disagree" in note for note in line.notes)


@pytest.mark.parametrize("rate", [60.0, 75.0])
def test_a_coarse_time_column_makes_no_frames(rate: float) -> None:
    line = even_grid(np.round(np.arange(600) / rate, 2), None, None)
    assert line.rate == pytest.approx(rate, rel=1e-3)
    assert line.index[-1] == 599
    dropped = np.delete(np.arange(200), [50, 51, 120])
    line = even_grid(np.round(dropped / 100, 2), None, None)
    np.testing.assert_array_equal(line.index, dropped)


@pytest.mark.parametrize("numbered", [True, False])
def test_a_time_column_that_cannot_be_used_is_said(numbered: bool) -> None:
    frame = np.arange(1.0, 6.0) if numbered else None
    for time in ([0.0, 0.1, np.nan, 0.3, 0.4], [0.0, 0.1, 0.05, 0.2, 0.3]):
        line = even_grid(np.array(time), frame, 10.0)
        assert line.index.tolist() == [0, 1, 2, 3, 4]
        assert any("ignored" in note for note in line.notes)


@given(rate=rates, seed=st.integers(0, 1000), lost=st.integers(2, 9), at=st.integers(40, 160))
@example(rate=50.0, seed=150, lost=2, at=40)
def test_rows_missing_among_jittered_ones_are_told_by_a_shift_that_stays(
    rate: float, seed: int, lost: int, at: int
) -> None:
    kept = np.delete(np.arange(200 + lost), np.arange(at, at + lost))
    line = even_grid(jittered(kept, rate, 0.28, seed), None, rate)
    np.testing.assert_array_equal(line.index, kept)
