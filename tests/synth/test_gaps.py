"""Gaps: as many and as long as asked for, as the paper says, or as they were counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.cleaning.gap_statistics import GapStatistics, load_gap_statistics
from markerscope.solver.core.errors import InputError
from markerscope.solver.synth.gaps import gaps_like, heavy_tailed_gaps, hidden_by_chance


def lengths_of(lost: np.ndarray) -> np.ndarray:
    """Lengths of all gaps that begin and end inside."""
    found = []
    for column in lost.T:
        edges = np.flatnonzero(np.diff(column.astype(int)))
        starts = [e for e in edges if not column[e]]
        found += [int(edges[edges > s][0] - s) for s in starts if (edges > s).any()]
    return np.array(found)


@pytest.mark.parametrize("share", [0.0, 0.04, 0.2, 0.6])
def test_the_share_asked_for_is_the_share_lost(share: float) -> None:
    lost = heavy_tailed_gaps((450, 40), share, 60, np.random.default_rng(1))
    assert lost.sum() == round(share * 450 * 40)


def test_lengths_have_a_heavy_tail_and_markers_are_unlike() -> None:
    lost = heavy_tailed_gaps((20_000, 20), 0.01, 60, np.random.default_rng(2))
    lengths = lengths_of(lost)
    law = (np.arange(1, 61) + 0.6) ** -1.4
    law /= law.sum()
    for longer in (1, 5, 20, 40):
        wanted = law[longer:].sum()
        assert (lengths > longer).mean() == pytest.approx(wanted, abs=3.5 * np.sqrt(wanted / len(lengths)) + 0.02)
    per_marker = lost.mean(axis=0)
    assert per_marker.max() > 5 * np.median(per_marker)


def test_the_paper_hides_for_ten_frames() -> None:
    lost = hidden_by_chance((3000, 60), 0.002, np.random.default_rng(3))
    assert lost.mean() == pytest.approx(1 - 0.998**10, rel=0.12)
    lengths = lengths_of(lost)
    assert lengths.min() == 10 and (lengths == 10).mean() > 0.95
    assert not hidden_by_chance((300, 60), 0.0, np.random.default_rng(3)).any()


def made_up() -> GapStatistics:
    lengths = np.zeros((3, 101), int)
    lengths[0, [2, 30]] = 80, 20
    lengths[1, [1, 100]] = 50, 5  # five of 100 and more: 1000 frames together
    frames = np.array([[160 + 600, 20_000], [50 + 1000, 30_000], [0, 10_000]])
    return GapStatistics(frames, lengths)


def test_real_gaps_have_the_share_and_the_lengths_that_were_counted() -> None:
    real = made_up()
    lost = np.concatenate([gaps_like(real, (40_000, 3), np.random.default_rng(s)) for s in range(8)], axis=1)
    share = lost.mean(axis=0)
    kinds = {marker: share[np.abs(share - wanted) < 0.5 * wanted] for marker, wanted in ((0, 0.038), (1, 0.035))}
    assert (share == 0).sum() == 8, "who was never lost is never lost"
    assert share[share > 0].mean() == pytest.approx((0.038 + 0.035) / 2, rel=0.1)
    assert all(len(kind) for kind in kinds.values())
    lengths = lengths_of(lost)
    assert set(lengths) <= {1, 2, 30, 200}
    assert (lengths == 30).sum() / np.isin(lengths, (2, 30)).sum() == pytest.approx(0.2, abs=0.03)
    assert (lengths == 200).sum() / np.isin(lengths, (1, 200)).sum() == pytest.approx(5 / 55, abs=0.04)


def test_twice_as_frequent_gaps_are_twice_as_many() -> None:
    real = made_up()
    one, two = (gaps_like(real, (200_000, 3), np.random.default_rng(5), times=t) for t in (1, 2))
    assert len(lengths_of(two)) / len(lengths_of(one)) == pytest.approx(2, rel=0.15)


@pytest.mark.parametrize("name", ["gap_production.npz", "gap_front_waist.npz"])
def test_recorded_statistics_come_out_again(shared_data: Path, name: str) -> None:
    real = load_gap_statistics(shared_data / "gaps" / name)
    count = len(real.frames)
    lost = np.concatenate([gaps_like(real, (60_000, count), np.random.default_rng(s)) for s in range(3)], axis=1)
    wanted = (real.frames[:, 0] / real.frames[:, 1]).mean()
    assert lost.mean() == pytest.approx(wanted, rel=0.3), f"{100 * lost.mean():.2f} %, not {100 * wanted:.2f} %"
    lengths = lengths_of(lost)
    rate = real.lengths.sum(axis=1) / real.frames[:, 1]  # gaps a frame: how much each marker says of lengths
    law = (real.lengths / np.maximum(real.lengths.sum(axis=1, keepdims=True), 1) * rate[:, None]).sum(axis=0)
    law /= law.sum()
    for longer in (1, 5, 20, 100):
        share = law[longer + 1 :].sum()
        assert (lengths > longer).mean() == pytest.approx(share, abs=0.04), f"gaps over {longer} frames"


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        (None, "there is no such file"),
        ({"missing_arr": np.zeros((3, 2), int)}, "cannot be read"),
        ({"missing_arr": np.zeros((3, 2)), "gap_arr": np.zeros((3, 9), int)}, "not counts"),
        ({"missing_arr": np.ones((3, 2), int), "gap_arr": np.ones((4, 9), int)}, "not counts"),
        ({"missing_arr": np.full((3, 2), 9), "gap_arr": np.ones((3, 9), int)}, "lost nearly always"),
        ({"missing_arr": np.array([[object()]]), "gap_arr": np.ones((3, 9), int)}, "cannot be read"),
    ],
)
def test_what_is_no_statistics_is_refused(tmp_path: Path, arrays: dict | None, says: str) -> None:
    path = tmp_path / "gaps.npz"
    if arrays is not None:
        np.savez(path, allow_pickle=True, **arrays)
    with pytest.raises(InputError, match=says):
        load_gap_statistics(path)
