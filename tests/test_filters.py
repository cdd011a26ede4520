"""Filters: what they let through, that nothing lags, that gaps stay; the cut-off that a signal asks for."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.filters.smooth import Filter, residual_analysis, smooth

RATE = 100.0
TIME = np.arange(1000) / RATE


@pytest.mark.parametrize("order", [2, 4, 8])
@pytest.mark.parametrize("cutoff", [3.0, 6.0, 20.0])
def test_a_sine_at_the_cut_off_keeps_its_phase_and_half_its_power(order: int, cutoff: float) -> None:
    wave = np.exp(2j * np.pi * cutoff * TIME)
    how = Filter("butterworth", order, cutoff)
    out = smooth(wave.real, RATE, how) + 1j * smooth(wave.imag, RATE, how)
    gain = (out / wave)[300:700]
    assert np.abs(np.abs(gain) - np.sqrt(0.5)).max() < 0.01
    assert np.abs(np.angle(gain)).max() < 0.01


def test_none_is_none_and_what_is_lost_stays_lost() -> None:
    values = np.random.default_rng(0).normal(0, 1, (200, 2, 3))
    values[50:60, 1] = np.nan
    assert np.array_equal(smooth(values, RATE, Filter()), values, equal_nan=True)
    for how in (Filter("butterworth"), Filter("spline")):
        out = smooth(values, RATE, how)
        assert np.array_equal(np.isnan(out), np.isnan(values))
        alone = smooth(values[60:], RATE, how)
        assert np.allclose(out[60:, 1], alone[:, 1]), "no stretch knows of another"


def test_the_spline_takes_noise_away_and_leaves_movement() -> None:
    rng = np.random.default_rng(0)
    true = 30 * np.sin(2 * np.pi * 1.0 * TIME)
    noisy = true + rng.normal(0, 1, len(true))
    out = smooth(noisy, RATE, Filter("spline"))
    assert np.sqrt(np.mean((out - true) ** 2)) < 0.45


def test_residual_analysis_finds_the_noise() -> None:
    rng = np.random.default_rng(0)
    columns = np.stack([30 * np.sin(2 * np.pi * f * TIME + f) for f in (0.5, 1.0, 2.0)], axis=1)
    found = residual_analysis(columns + rng.normal(0, 0.5, columns.shape), RATE)
    assert found.noise == pytest.approx(0.5, rel=0.15)
    assert 2.0 < found.cutoff < 12.0


def test_a_cut_off_that_cannot_be_had_is_refused() -> None:
    with pytest.raises(InputError, match="choose one below 15 Hz"):
        smooth(np.zeros(100), 30.0, Filter("butterworth", 4, 15.0))
    with pytest.raises(InputError, match="cannot be filtered both ways"):
        Filter("butterworth", 3, 6.0)
    with pytest.raises(InputError, match="less than a second"):
        residual_analysis(np.zeros((50, 1)), RATE)
