"""Data made worse on purpose is as bad as it was asked to be, and bad in the way that real recordings are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.cleaning.gap_model import heavy_tailed, read_gap_statistics
from markerscope.solver.cleaning.gaps import find_gaps
from markerscope.solver.neural.augment import Augmentation, FrameNoise, augmented, corrupted, gap_bank
from markerscope.solver.neural.training.examples import generator

torch = pytest.importorskip("torch", reason="torch is not installed here")


@pytest.mark.parametrize("lost", [0.05, 0.2])
def test_the_share_asked_for_is_lost_and_shifts_are_even(lost: float) -> None:
    truth = np.random.default_rng(0).normal(size=(1500, 30, 3))
    truth[:100, 3] = np.nan
    there = np.isfinite(truth).all(axis=2)
    made, hidden, shifted = augmented(truth, heavy_tailed(), Augmentation(lost, 0.03, 15.0), 5)
    assert abs(hidden[there].mean() - lost) < 0.15 * lost, hidden[there].mean()
    assert abs(shifted[there & ~hidden].mean() - 0.03) < 0.004, shifted.mean()
    assert not (hidden & ~there).any() and np.isnan(made[hidden | ~there]).all()
    off = (made - truth)[shifted]
    assert np.abs(off).max() <= 0.015 and np.isclose(off.std(), 0.015 / np.sqrt(3), rtol=0.05)
    assert np.array_equal(made[there & ~hidden & ~shifted], truth[there & ~hidden & ~shifted])
    again, _, _ = augmented(truth, heavy_tailed(), Augmentation(lost, 0.03, 15.0), 5)
    assert np.array_equal(made, again, equal_nan=True)
    other, _, _ = augmented(truth, heavy_tailed(), Augmentation(lost, 0.03, 15.0), 6)
    assert not np.array_equal(made, other, equal_nan=True)


def test_most_lost_frames_lie_in_long_gaps_as_in_real_recordings(shared_data: Path) -> None:
    model = read_gap_statistics(shared_data / "gaps" / "gap_production.npz")
    truth = np.zeros((4000, 20, 3))
    _, hidden, _ = augmented(truth, model, Augmentation(lost=0.1), 0)
    lengths = np.array([gap.length for gap in find_gaps(~hidden)])
    share = lengths[lengths >= 40].sum() / lengths.sum()
    wanted = (model.lengths * np.arange(1, 201))[39:].sum() / model.mean_length
    assert abs(share - wanted) < 0.1, f"{share:.2f} of the lost frames are in gaps of 40 and more, {wanted:.2f} wanted"
    assert (lengths < 5).any()


def test_windows_cut_from_a_bank_keep_its_rate_and_its_long_gaps() -> None:
    bank = gap_bank(12, heavy_tailed(), (0.1,), 0, frames=3000)
    cut = bank.cut(300, 64, generator(0))
    assert cut.shape == (300, 64, 12)
    assert abs(float(cut.float().mean()) - 0.1) < 0.02
    changes = (cut[:, 1:] != cut[:, :-1]).float().mean()
    alone = 2 * 0.1 * 0.9  # as often would samples drawn one by one change
    assert changes < 0.4 * alone, f"{changes:.3f} of the steps change, {alone:.3f} would one by one"


def test_single_frames_lose_fill_and_shift_markers_as_asked() -> None:
    noise = FrameNoise(lost=0.2, whole=0.5, filled_mm=20.0, shifted=0.02, shift_mm=30.0)
    local = torch.zeros(4000, 25, 3)
    found, visible = corrupted(local, noise, generator(0))
    lost = visible == 0
    assert abs(float(lost.float().mean()) - 0.05) < 0.005, "a half of the examples, a tenth on average"
    none = 0.5 + 0.5 * (1 - 0.8**26) / (26 * 0.2)  # the mean of (1 - p)^25 over p up to 0.2, where any may be lost
    assert abs(float((~lost.any(1)).float().mean()) - none) < 0.03
    moved = (found != 0).any(-1)
    shifted = moved & ~lost
    assert abs(float(shifted.float().mean()) - 0.02 * 0.95) < 0.002
    assert found[shifted].abs().max() <= 0.03 and 0.008 < found[lost].std() < 0.016
    same, _ = corrupted(local, noise, generator(0))
    assert torch.equal(found, same)
