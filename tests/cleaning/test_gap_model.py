"""Gaps made on purpose: as many and as long as the model says, only where something is there, the same for a seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.cleaning.gap_model import draw_gaps, draw_shifts, heavy_tailed, read_gap_statistics
from markerscope.solver.cleaning.gaps import find_gaps
from markerscope.solver.core.errors import InputError


def statistics(path: Path) -> Path:
    """Marker 1 is lost three times as often as marker 0; gaps of 1 frame, 10 frames and 300 frames, 6 : 3 : 1."""
    lengths = np.zeros((2, 400), dtype=int)
    lengths[0, [1, 10]] = 6, 1
    lengths[1, [10, 300]] = 2, 1
    np.savez(path, missing_arr=np.array([[10, 1000], [30, 1000]]), gap_arr=lengths)
    return path


def test_statistics_are_read_as_they_were_counted(tmp_path: Path) -> None:
    model = read_gap_statistics(statistics(tmp_path / "gaps.npz"))
    assert model.lost.tolist() == [0.5, 1.5]
    assert np.flatnonzero(model.lengths).tolist() == [0, 9, 199], "longer ones count as 200"
    assert model.lengths[[0, 9, 199]].tolist() == pytest.approx([0.6, 0.3, 0.1])
    assert model.mean_length == pytest.approx(0.6 + 3 + 20)


def test_statistics_that_count_no_gap_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "gaps.npz"
    np.savez(path, missing_arr=np.array([[0, 1000]]), gap_arr=np.zeros((1, 9), dtype=int))
    with pytest.raises(InputError, match="counts no gap"):
        read_gap_statistics(path)
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(InputError, match="cannot be read"):
        read_gap_statistics(tmp_path / "text.npz")


def test_the_tail_is_heavy() -> None:
    model = heavy_tailed()
    assert len(model.lengths) == 200
    assert model.lengths.sum() == pytest.approx(1)
    assert model.lengths[0] / model.lengths[9] == pytest.approx((1.6 / 10.6) ** -1.4)


@pytest.mark.parametrize("share", [0.05, 0.2])
@pytest.mark.parametrize("frames", [150, 1000])
def test_the_share_is_met_and_short_recordings_have_long_gaps_too(share: float, frames: int) -> None:
    present = np.ones((frames, 40), dtype=bool)
    drawn = [draw_gaps(present, heavy_tailed(), share, seed) for seed in range(8)]
    met = float(np.mean(drawn))
    assert met == pytest.approx(share, rel=0.15), met
    lengths = np.array([gap.length for hidden in drawn for gap in find_gaps(~hidden)])
    assert lengths.max() >= 40
    assert lengths[lengths >= 20].sum() > 0.4 * lengths.sum()
    assert (lengths == 1).mean() == pytest.approx(heavy_tailed().lengths[0], abs=0.08)


def test_only_samples_that_are_there_are_hidden_and_no_gap_touches_another() -> None:
    rng = np.random.default_rng(0)
    present = np.repeat(rng.random((30, 12)) < 0.7, 20, axis=0)
    hidden = draw_gaps(present, heavy_tailed(), 0.2, 3)
    assert hidden.any()
    assert not (hidden & ~present).any()
    assert np.array_equal(hidden, draw_gaps(present, heavy_tailed(), 0.2, 3))
    assert not np.array_equal(hidden, draw_gaps(present, heavy_tailed(), 0.2, 4))
    assert not draw_gaps(present, heavy_tailed(), 0.0, 3).any()


def test_markers_are_lost_as_unevenly_as_in_the_statistics(tmp_path: Path) -> None:
    model = read_gap_statistics(statistics(tmp_path / "gaps.npz"))
    hidden = draw_gaps(np.ones((20000, 2), dtype=bool), model, 0.1, 0)
    least, most = sorted(hidden.mean(axis=0))
    assert (least, most) == pytest.approx((0.05, 0.15), rel=0.25)


def test_shifts_are_single_samples_of_the_size_asked_for() -> None:
    present = np.ones((500, 10), dtype=bool)
    present[100:200, 3] = False
    shifts = draw_shifts(present, 0.02, 0.01, 0.1, 0)
    sizes = np.linalg.norm(shifts, axis=2)
    moved = sizes > 0
    assert 0.01 <= sizes[moved].min() <= sizes[moved].max() <= 0.1
    assert not (moved & ~present).any()
    assert not (moved[1:] & moved[:-1]).any()
    assert not (moved[2:] & moved[:-2]).any()
    assert moved.mean() == pytest.approx(0.02, rel=0.2)
