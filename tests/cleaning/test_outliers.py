"""Outliers: exactly those that were made, and none where a whole body lands."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.cleaning.gap_model import draw_shifts
from markerscope.solver.cleaning.outliers import OutlierSettings, find_outliers
from tests.cleaning.scenes import RATE, lose, rigid

MADE = {(40, 2), (100, 5), (101, 6), (150, 2)}


def noisy(seed: int = 0, frames: int = 240) -> np.ndarray:
    truth = rigid(frames, seed=seed)
    return truth + np.random.default_rng(seed).normal(scale=0.0003, size=truth.shape)


def found_in(positions: np.ndarray, **settings: object) -> set[tuple[int, int]]:
    out = find_outliers(positions, RATE, OutlierSettings(**settings))  # type: ignore[arg-type]
    return {(int(t), int(m)) for t, m in zip(*np.nonzero(out))}


@pytest.mark.parametrize("size", [0.015, 0.03, 0.1])
def test_single_samples_are_found_exactly(size: float) -> None:
    positions = noisy()
    assert found_in(positions) == set()
    for t, m in MADE:
        positions[t, m] += size * np.array([0.6, 0, 0.8])
    assert found_in(positions) == MADE
    assert found_in(positions, method="none") == set()


@pytest.mark.parametrize("length", [2, 3, 5])
def test_an_excursion_is_found_as_a_whole(length: int) -> None:
    positions = noisy(1)
    positions[80 : 80 + length, 3] += [0.03, 0.02, 0]
    assert found_in(positions) == {(80 + k, 3) for k in range(length)}


def test_of_a_step_that_stays_only_the_edge_is_cut() -> None:
    positions = noisy(2)
    positions[120:, 3] += [0.05, 0, 0]
    assert found_in(positions) <= {(119, 3), (120, 3), (121, 3)}, "what comes after is the marker's new track"


def test_a_landing_is_not_cut() -> None:
    positions = noisy(3)
    fall = np.where(np.arange(240) < 120, (120 - np.arange(240)) * 0.05, 0.0)
    assert found_in(positions + fall[:, None, None] * [0, 0, 1]) == set()


def test_published_peaks_take_two_frames_on_either_side() -> None:
    positions = noisy(4)
    positions[100, 2] += [0.1, 0, 0]
    assert found_in(positions, method="prominence", passes=1) == {(t, 2) for t in range(98, 103)}


def test_lost_samples_are_no_outliers() -> None:
    positions = lose(noisy(5), (2, 50, 60), (0, 0, 239))
    positions[49, 2] += 0.3
    for method in ("local", "prominence"):
        out = find_outliers(positions, RATE, OutlierSettings(method=method))  # type: ignore[arg-type]
        assert not (out & np.isnan(positions).any(axis=2)).any()


@pytest.mark.parametrize("frames", [1, 2, 3, 5])
def test_short_recordings_are_no_trouble(frames: int) -> None:
    for method in ("local", "prominence"):
        assert found_in(rigid(frames), method=method) == set()


@pytest.mark.parametrize("seed", range(3))
def test_most_of_many_are_found_and_little_else(seed: int) -> None:
    positions = noisy(seed, 600)
    present = np.ones(positions.shape[:2], dtype=bool)
    shifts = draw_shifts(present, 0.02, 0.01, 0.1, seed)
    true = shifts.any(axis=2)
    found = find_outliers(positions + shifts, RATE, OutlierSettings())
    f1 = 2 * (found & true).sum() / (found.sum() + true.sum())
    assert f1 > 0.95, f1


def test_settings_that_cannot_work_are_refused() -> None:
    for bad in ({"ratio": 0.0}, {"window": -1.0}, {"least": 0.0}, {"passes": 0}, {"longest": 0}):
        with pytest.raises(ValueError, match="has to be"):
            OutlierSettings(**bad)  # type: ignore[arg-type]
