"""Every way of filling gaps, on motions for which it has to be right to the last digit, and where it must not fill."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from solver.clean.fill import METHODS, fill
from solver.clean.fill.body import fill_by_body
from solver.clean.fill.edm import both_from_distances
from solver.clean.gaps import Fill, FillSettings, Gap, confidence_of, find_gaps
from tests.clean.scenes import RATE, lose, rigid, soft, worst

GAPS = ((2, 50, 89), (5, 70, 75), (2, 150, 150), (0, 0, 9))


@pytest.mark.parametrize("method", ["regression", "rigid", "edm"])
@pytest.mark.parametrize("seed", range(3))
def test_on_a_rigid_body_methods_that_follow_neighbours_are_exact(method: str, seed: int) -> None:
    truth = rigid(seed=seed)
    found = fill(lose(truth, *GAPS), RATE, FillSettings(method=method))  # type: ignore[arg-type]
    assert [(f.marker, f.first, f.last) for f in found.fills] == sorted(GAPS)
    assert worst(found.positions, truth) < 1e-6, f"{method} is {1e3 * worst(found.positions, truth):.6f} mm off"
    assert all(f.error < 1e-6 and f.confidence > 0.999 for f in found.fills)


def test_a_straight_line_is_exact_where_the_marker_goes_straight() -> None:
    truth = np.arange(60)[:, None, None] * np.array([[[0.01, -0.02, 0.005]]]) + 1.0
    found = fill(lose(truth, (0, 20, 39)), RATE, FillSettings(method="linear"))
    assert worst(found.positions, truth) < 1e-12


def test_a_spline_is_exact_where_the_marker_follows_a_cubic() -> None:
    t = np.linspace(-1, 1, 60)[:, None, None]
    truth = t**3 * [[[0.5, 0.1, 0]]] - t**2 * [[[0, 0.2, 0.3]]] + t * [[[0.1, 0, 1]]]
    found = fill(lose(truth, (0, 25, 34)), RATE, FillSettings(method="spline"))
    assert worst(found.positions, truth) < 1e-9
    straight = fill(lose(truth, (0, 25, 34)), RATE, FillSettings(method="linear", min_confidence=0.0))
    assert worst(straight.positions, truth) > 1e-3


def test_a_pattern_is_exact_where_the_donor_keeps_beside_the_marker() -> None:
    donor = np.random.default_rng(0).normal(size=(80, 1, 3)).cumsum(axis=0) * 0.02
    truth = np.concatenate([donor, donor + np.array([0.1, 0, 0.05]), rigid(80, 3)], axis=1)
    found = fill(lose(truth, (1, 30, 59)), RATE, FillSettings(method="pattern"))
    assert worst(found.positions, truth) < 1e-12


def test_the_body_is_exact_up_to_a_steady_drift() -> None:
    truth = rigid(120, 4)
    drift = np.linspace(0, 0.02, 120)[:, None, None] * np.ones((1, 4, 3))
    placed = truth - drift
    placed[:, 3] = np.nan
    found = fill_by_body(placed)(lose(truth, (1, 40, 79), (3, 40, 79)), RATE, FillSettings())
    assert worst(found.positions[:, :3], truth[:, :3]) < 1e-12
    assert [f.method for f in found.fills] == ["body"]
    assert np.isnan(found.positions[40:80, 3]).all(), "a marker that the body does not carry stays lost"


def test_regression_follows_what_a_rigid_body_cannot() -> None:
    truth = soft()
    given = lose(truth, (8, 100, 179), (8, 300, 349))
    by = {m: fill(given, RATE, FillSettings(method=m, min_confidence=0.0)) for m in ("regression", "rigid", "edm")}
    off = {m: 1e3 * np.linalg.norm(f.positions - truth, axis=2)[f.filled].mean() for m, f in by.items()}
    assert off["regression"] < 1.5, off
    assert off["rigid"] > 5 * off["regression"], off
    assert off["edm"] > 5 * off["regression"], off


def test_with_few_frames_to_learn_from_the_rigid_body_takes_over() -> None:
    truth = rigid(40)
    found = fill(lose(truth, (2, 10, 29)), RATE, FillSettings())
    assert [f.method for f in found.fills] == ["rigid"]
    assert worst(found.positions, truth) < 1e-6


def test_scaling_finds_a_point_from_distances_whatever_its_hand() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(size=(50, 7, 3))
    apart = points[:, :, None] - points[:, None]
    found, _, _ = both_from_distances((apart**2).sum(axis=3), points[:, 1:])
    assert worst(found, points[:, 0]) < 1e-7


def test_nothing_is_filled_where_nothing_can_be_known() -> None:
    rng = np.random.default_rng(0)
    stray = rng.normal(size=(240, 1, 3)).cumsum(axis=0) * 0.05
    truth = np.concatenate([rigid(), stray], axis=1)
    given = lose(truth, (8, 60, 119), *((m, 100, 110) for m in range(8)))
    found = fill(given, RATE, FillSettings())
    assert np.isnan(found.positions[60:120, 8]).all(), "it wanders about on its own"
    bridged = {f.method for f in found.fills if f.first == 100}
    assert bridged <= {"spline"}, "no neighbour is seen then"
    assert not [f for f in found.fills if f.confidence < 0.2]


def test_a_marker_never_seen_and_gaps_that_are_too_long_stay() -> None:
    given = lose(rigid(), (2, 50, 109), (3, 50, 79), (4, 0, 239))
    found = fill(given, RATE, FillSettings(max_gap=0.5))
    assert [(f.marker, f.first, f.last) for f in found.fills] == [(3, 50, 79)]
    assert np.isnan(found.positions[:, 4]).all()


def test_confidence_falls_where_the_error_rises() -> None:
    errors = np.linspace(0, 0.1, 50)
    assert (np.diff([confidence_of(e) for e in errors]) < 0).all()
    assert confidence_of(0.0) == 1.0
    assert confidence_of(np.inf) == 0.0
    truth = soft(seed=2)
    noisy = truth + np.random.default_rng(1).normal(size=truth.shape) * np.linspace(0, 0.01, 9)[:, None]
    given = lose(noisy, *((m, 60 + 30 * m, 70 + 30 * m) for m in range(9)))
    found = fill(given, RATE, FillSettings(min_confidence=0.0))
    real = [
        worst(found.positions[f.first : f.last + 1, f.marker], truth[f.first : f.last + 1, f.marker])
        for f in found.fills
    ]
    rank = np.corrcoef(np.argsort(np.argsort(real)), np.argsort(np.argsort([f.error for f in found.fills])))[0, 1]
    assert rank > 0.6, (real, [f.error for f in found.fills])


@hypothesis_settings(max_examples=30)
@given(method=st.sampled_from(sorted(METHODS)), seed=st.integers(0, 10**6), share=st.floats(0, 0.7))
def test_what_was_measured_is_never_touched(method: str, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    truth = rigid(rng.integers(1, 60), rng.integers(1, 7), seed) + rng.normal(size=(1, 1, 3))
    lost = np.repeat(rng.random((len(truth) // 4 + 1, truth.shape[1])) < share, 4, axis=0)[: len(truth)]
    given = np.where(lost[..., None], np.nan, truth)
    before = given.copy()
    found = fill(given, RATE, FillSettings(method=method, min_confidence=0.0))  # type: ignore[arg-type]
    assert np.array_equal(given, before, equal_nan=True), "the input was changed"
    assert np.array_equal(found.positions[~lost], truth[~lost])
    assert not (found.filled & ~lost).any()
    assert np.array_equal(np.isfinite(found.positions).all(axis=2), ~lost | found.filled)
    listed = np.zeros_like(lost)
    for f in found.fills:
        assert not listed[f.first : f.last + 1, f.marker].any()
        listed[f.first : f.last + 1, f.marker] = True
        assert 0 <= f.confidence <= 1
    assert np.array_equal(listed, found.filled)


def test_gaps_are_listed_with_both_ends() -> None:
    present = np.ones((6, 3), dtype=bool)
    present[:2, 0] = present[4, 0] = present[:, 1] = False
    present[5, 2] = False
    assert find_gaps(present) == [Gap(0, 0, 1), Gap(0, 4, 4), Gap(2, 5, 5)]
    assert Gap(0, 0, 1).length == Fill(0, 0, 1, "rigid", 1.0, 0.0).length == 2
