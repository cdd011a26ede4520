"""Every way of filling gaps, on motions for which it has to be right to the last digit, and where it must not fill."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.linalg import orthogonal_procrustes
from scipy.spatial.transform import Rotation

from markerscope.solver.cleaning.fill import METHODS, fill
from markerscope.solver.cleaning.fill.body import fill_by_body
from markerscope.solver.cleaning.fill.edm import both_from_distances
from markerscope.solver.cleaning.fill.neighbours import neighbours_of
from markerscope.solver.cleaning.gaps import Fill, FillSettings, Gap, confidence_of, find_gaps
from tests.cleaning.scenes import RATE, lose, rigid, soft, worst

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


@pytest.mark.parametrize("method", ["regression", "rigid", "edm", "pattern", "spline", "linear"])
@pytest.mark.parametrize("rate", [30.0, 60.0, 120.0])
def test_the_longest_gap_is_one_of_seconds_whatever_the_rate(method: str, rate: float) -> None:
    longest = round(0.3 * rate)
    given = lose(rigid(), (2, 50, 49 + longest), (5, 130, 130 + longest))
    settings = FillSettings(method=method, max_gap=0.3, min_confidence=0.0)  # type: ignore[arg-type]
    found = fill(given, rate, settings)
    assert [(f.marker, f.first, f.last) for f in found.fills] == [(2, 50, 49 + longest)]


def by_scaling(positions: np.ndarray, marker: int, first: int, last: int, neighbours: list[int]) -> np.ndarray:
    """(L, 3) m by the text of Pan et al. (2023), section 3.1, frame by frame, with scipy's Procrustes."""
    points = positions[:, [marker, *neighbours]]
    squared = [((p[:, None] - p[None]) ** 2).sum(axis=2) for p in (points[first - 1], points[last + 1])]
    out = []
    for t in range(first, last + 1):
        share = (t - first + 1) / (last - first + 2)
        apart = (1 - share) * squared[0] + share * squared[1]
        doubly = -0.5 * (apart - apart.mean(0) - apart.mean(1)[:, None] + apart.mean())
        value, vector = np.linalg.eigh(doubly)
        local = vector[:, -3:] * np.sqrt(value[-3:])
        seen, middle = points[t, 1:], local[1:].mean(axis=0)
        turn, _ = orthogonal_procrustes(local[1:] - middle, seen - seen.mean(axis=0))
        out.append((local[0] - middle) @ turn + seen.mean(axis=0))
    return np.array(out)


@pytest.mark.parametrize("seed", range(3))
def test_distance_matrices_are_interpolated_over_six_neighbours_as_published(seed: int) -> None:
    """Markers that breathe differently, so that it matters which neighbours count and that the distances change."""
    rng = np.random.default_rng(seed)
    truth = rigid(240, 10, seed)
    time = np.arange(240)[:, None, None] / RATE
    swell = rng.uniform(0.002, 0.012, (10, 1)) * rng.normal(size=(10, 3))
    truth = truth + swell * np.sin(2 * np.pi * time * 0.4 + rng.uniform(0, 6, (10, 1)))
    given = lose(truth, (4, 100, 139))
    apart = np.linalg.norm(given - given[:, [4]], axis=2)
    order = np.argsort(np.nanstd(apart, axis=0))
    nearest = [int(m) for m in order if m != 4][:6]
    found = fill(given, RATE, FillSettings(method="edm", min_confidence=0.0))
    expected = by_scaling(given, 4, 100, 139, nearest)
    np.testing.assert_allclose(found.positions[100:140, 4], expected, atol=1e-6)


def test_distances_follow_a_marker_that_slides_to_the_other_end_of_the_gap() -> None:
    truth = rigid(240, 9)
    share = np.clip((np.arange(240) - 99) / 41, 0, 1)[:, None]
    truth[:, 4] += 0.04 * share * (truth[:, 5] - truth[:, 0]) / np.linalg.norm(truth[0, 5] - truth[0, 0])
    found = fill(lose(truth, (4, 100, 139)), RATE, FillSettings(method="edm", min_confidence=0.0))
    off = np.linalg.norm(found.positions[100:140, 4] - truth[100:140, 4], axis=1)
    assert off[[0, -1]].max() < 0.0005, "it meets both ends"
    assert off.max() < 0.002, f"{1e3 * off.max():.2f} mm"


@pytest.mark.parametrize(("together", "known"), [(4, False), (5, True)])
def test_a_neighbour_is_one_that_five_frames_show_together_with_the_marker(together: int, known: bool) -> None:
    """In fewer, any two markers keep their distance."""
    truth = rigid(200, 5)
    given = lose(truth, (0, 0, 99), (1, 100 + together, 199))
    near = neighbours_of(given)
    assert np.isfinite(near.spread[0, 1]) == known
    usable = np.ones(5, dtype=bool)
    assert (1 in near.nearest(0, usable, 4)) == known
    assert 0 not in near.nearest(0, usable, 5)
    usable[2] = False
    assert 2 not in near.nearest(0, usable, 5)


def test_neighbours_are_those_of_least_spread_in_their_order() -> None:
    rng = np.random.default_rng(1)
    truth = rigid(300, 6) + rng.normal(size=(300, 6, 3)) * np.array([0, 3, 1, 5, 2, 4])[:, None] * 1e-3
    assert neighbours_of(truth).nearest(0, np.ones(6, dtype=bool), 3).tolist() == [2, 4, 1]


def test_the_rigid_filling_weighs_neighbours_by_how_they_keep_their_distance() -> None:
    """1 / (spread + 1 mm)^2, as documented; the turns here are scipy's."""
    rng = np.random.default_rng(5)
    truth = rigid(240, 7, 5) + rng.normal(size=(240, 7, 3)) * np.array([0, 1, 2, 4, 8, 3, 6])[:, None] * 1e-3
    given = lose(truth, (0, 100, 119))
    seen = np.setdiff1d(np.arange(240), np.arange(100, 120))
    spread = np.linalg.norm(truth - truth[:, [0]], axis=2)[seen].std(axis=0)[1:]
    weight = 1 / (spread + 0.001) ** 2
    near = seen[np.sort(np.argsort(np.maximum(100 - seen, seen - 119), kind="stable")[:60])]  # as many tell its place

    def framed(frame: int, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        centre = np.average(truth[frame, 1:], axis=0, weights=weight)
        turn, _ = Rotation.align_vectors(truth[frame, 1:] - centre, reference, weights=weight)
        return turn.as_matrix(), centre

    reference = truth[near[0], 1:] - np.average(truth[near[0], 1:], axis=0, weights=weight)
    local = {}
    for frame in near:
        turn, centre = framed(int(frame), reference)
        local[int(frame)] = turn.T @ (truth[frame, 0] - centre)
    expected = []
    for frame in range(100, 120):
        share = (frame - 99) / 21
        turn, centre = framed(frame, reference)
        expected.append(turn @ ((1 - share) * local[99] + share * local[120]) + centre)
    found = fill(given, RATE, FillSettings(method="rigid", min_confidence=0.0))
    np.testing.assert_allclose(found.positions[100:120, 0], expected, atol=1e-9)


@pytest.mark.parametrize(("error", "said"), [(0.001, 0.95), (0.010, 0.61), (0.0322, 0.20)])
def test_the_confidence_is_the_one_that_the_documentation_tells(error: float, said: float) -> None:
    assert confidence_of(error) == pytest.approx(said, abs=0.005)


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
