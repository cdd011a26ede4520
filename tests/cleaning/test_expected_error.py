"""The error to be expected of a filling: what it is for residuals whose law is known, and how it ranks real gaps."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.cleaning.fill.blend import drift
from markerscope.solver.cleaning.gaps import Gap

MEAN_LENGTH = np.sqrt(8 / np.pi)
"""Mean length of a vector of three standard normal numbers."""


def gap(length: int, first: int = 1000) -> Gap:
    return Gap(0, first, first + length - 1)


def ends(span: Gap) -> np.ndarray:
    return np.array([span.first - 1, span.last + 1])


@pytest.mark.parametrize("spacing", [1, 3])
def test_noise_is_not_smoothed_away_where_few_frames_are_learnt_from(spacing: int) -> None:
    """Of white noise the middle of two ends misses by sqrt(1 + 1/2) of it, however sparse the frames far off are."""
    span = gap(1)
    about = np.abs(np.arange(4000) - 1000) < 150
    frames = np.flatnonzero((about | (np.arange(4000) % spacing == 0)) & (np.arange(4000) != 1000))
    expected = 0.001 * np.sqrt(1.5) * MEAN_LENGTH
    found = []
    for seed in range(10):
        residual = np.random.default_rng(seed).normal(scale=0.001, size=(len(frames), 3))
        residual[np.isin(frames, ends(span))] = 0.001 * np.sqrt(2) * MEAN_LENGTH * np.array([[0, 0, 0], [1, 0, 0]])
        found.append(drift(frames, residual, span, ends(span)))
    assert np.mean(found) == pytest.approx(expected, rel=0.05), (
        f"{1e3 * np.mean(found):.3f} for {1e3 * expected:.3f} mm"
    )


def test_a_walk_at_random_is_missed_by_the_root_of_the_length() -> None:
    """Of a random walk over lag steps, the line misses by sqrt(f (1 - f) lag) steps at the fraction f."""
    rng = np.random.default_rng(1)
    walk = rng.normal(scale=0.0002, size=(6000, 3)).cumsum(axis=0)
    for length in (7, 31):
        span = gap(length, 3000)
        lag = length + 1
        f = np.array([0.25, 0.5, 0.75])
        expected = 0.0002 * MEAN_LENGTH * np.sqrt(f * (1 - f) * lag).mean()
        usual = 0.0002 * MEAN_LENGTH * np.sqrt(lag)
        frames = np.setdiff1d(np.arange(6000), np.arange(span.first, span.last + 1))
        residual = walk[frames].copy()
        rows = np.searchsorted(frames, ends(span))
        residual[rows[1]] = residual[rows[0]] + [usual, 0, 0]  # the ends differ by what is usual
        found = drift(frames, residual, span, ends(span))
        assert found == pytest.approx(expected, rel=0.2), f"length {length}: {1e3 * found:.3f}, {1e3 * expected:.3f} mm"


def test_ends_that_disagree_make_it_rise_and_ends_that_agree_fall() -> None:
    rng = np.random.default_rng(2)
    span = gap(10)
    frames = np.setdiff1d(np.arange(3000), np.arange(span.first, span.last + 1))
    residual = rng.normal(scale=0.001, size=(len(frames), 3))
    rows = np.searchsorted(frames, ends(span))
    errors = []
    for apart in (0.0, 0.001, 0.003, 0.01, 0.03):
        residual[rows] = [[0, 0, 0], [apart, 0, 0]]
        errors.append(drift(frames, residual, span, ends(span)))
    assert (np.diff(errors) > 0).all(), errors
    assert errors[-1] < 2.1 * drift(frames, residual, span, ends(span)[:1]), "no more than twice what is usual"


@pytest.mark.parametrize("length", [8, 20, 80, 160])
def test_a_gap_longer_than_what_was_seen_is_judged_by_halves(length: int) -> None:
    """A marker that drifts evenly and is not seen again is off by half of the way that it will have gone."""
    frames = np.arange(30)
    residual = 0.0005 * frames[:, None] * np.array([0.6, 0.0, 0.8])
    span = gap(length, first=30)
    found = drift(frames, residual, span, np.array([29]))
    assert found == pytest.approx(0.0005 * length / 2, rel=0.12), f"{1e3 * found:.2f} mm for {length} frames"


def test_a_marker_that_is_elsewhere_among_its_neighbours_afterwards_is_off_by_a_share_of_the_way() -> None:
    frames = np.setdiff1d(np.arange(400), np.arange(200, 210))
    residual = np.zeros((len(frames), 3))
    residual[frames >= 210, 0] = 0.05
    found = drift(frames, residual, gap(10, first=200), np.array([199, 210]), strain=0.15)
    assert found == pytest.approx(0.15 * 0.05)
