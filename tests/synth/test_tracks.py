"""Tracks that lie: ghosts behave as reflections do, swaps truly swap."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.synth.ghosts import ghosts
from markerscope.solver.synth.swaps import draw_swaps, holders

RATE = 30.0


@pytest.fixture(scope="module")
def paths() -> np.ndarray:
    """(600, 30, 3) markers that move together along a circle."""
    rng = np.random.default_rng(0)
    angle = np.linspace(0, 6, 600)
    middle = np.stack([np.cos(angle), np.sin(angle), np.full(600, 0.9)], axis=1)
    return middle[:, None] + rng.uniform(-0.4, 0.4, (30, 3))


def test_ghosts_stand_wander_or_flicker(paths: np.ndarray) -> None:
    found = ghosts(paths, RATE, 9, np.random.default_rng(4))
    assert found.shape == (600, 9, 3)
    seen = np.isfinite(found).all(axis=2)
    assert seen.any(axis=0).all()
    for standing in (0, 3, 6):
        assert np.nanstd(found[:, standing], axis=0).max() < 0.5e-3
    for wandering in (1, 4, 7):
        track = found[seen[:, wandering], wandering]
        assert np.ptp(track, axis=0).max() > 0.05
    nearest = np.linalg.norm(found[:, :, None] - paths[:, None], axis=3).min(axis=2)
    for flickering in (2, 5, 8):
        assert np.nanmax(nearest[:, flickering]) < 0.32
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], seen[:, flickering], [0]]))))[::2]
        assert np.median(runs) < 20 and seen[:, flickering].mean() < 0.5
    assert ghosts(paths, RATE, 0, np.random.default_rng(4)).shape == (600, 0, 3)


def test_the_first_ghosts_are_the_same_however_many_there_are(paths: np.ndarray) -> None:
    few, many = (ghosts(paths, RATE, n, np.random.default_rng(4)) for n in (2, 5))
    np.testing.assert_array_equal(few, many[:, :2])


def test_swaps_are_between_near_markers(paths: np.ndarray) -> None:
    swaps = draw_swaps(paths, RATE, 40, np.random.default_rng(5))
    assert swaps.shape == (40, 4) and (np.diff(swaps[:, 2]) >= 0).all()
    for a, b, start, stop in swaps:
        distance = np.linalg.norm(paths[start] - paths[start, a], axis=1)
        assert a != b and distance[b] <= np.sort(distance)[3]
        assert 60 <= start < stop <= 600
    assert 8 < (swaps[:, 3] == 600).sum() < 35, "some are undone, some are for good"


def test_columns_hold_each_other_s_marker_within_the_span_and_nobody_gets_lost() -> None:
    swaps = np.array([[0, 1, 10, 20], [1, 2, 15, 30]])
    held = holders(swaps, 30, 4)
    np.testing.assert_array_equal(held[9], [0, 1, 2, 3])
    np.testing.assert_array_equal(held[10], [1, 0, 2, 3])
    np.testing.assert_array_equal(held[15], [1, 2, 0, 3])
    np.testing.assert_array_equal(held[25], [0, 2, 1, 3])
    assert (np.sort(held, axis=1) == np.arange(4)).all()
