"""Gaps filled by the fitted body."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from markerscope.solver.core.markers import Markers
from markerscope.solver.report.filling import filled_by_body

FRAMES, COUNT = 50, 4


def moving(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """True positions, where a fit says the markers are, and their bones' rotations: each marker rides on its bone."""
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.1, (FRAMES * COUNT, 3)), axis=0)).as_matrix()
    turn = turn.reshape(COUNT, FRAMES, 3, 3).swapaxes(0, 1)
    placed = np.cumsum(rng.normal(0, 0.02, (FRAMES, COUNT, 3)), axis=0)
    return placed + np.einsum("tmij,mj->tmi", turn, rng.normal(0, 0.01, (COUNT, 3))), placed, turn


def test_a_marker_that_rides_on_its_bone_is_found_again_however_the_bone_turns() -> None:
    true, placed, turn = moving(0)
    positions = true.copy()
    positions[10:40, 1] = np.nan
    positions[:5, 2] = positions[45:, 2] = np.nan
    filled = filled_by_body(Markers(positions, 100.0, tuple("abcd")), placed, turn)
    np.testing.assert_allclose(filled.positions, true, atol=1e-12)
    assert filled.filled is not None
    np.testing.assert_array_equal(filled.filled, np.isnan(positions[..., 0]))


def test_the_distance_to_the_fit_is_carried_through_a_gap_evenly() -> None:
    _, placed, _ = moving(1)
    still = np.broadcast_to(np.eye(3), (FRAMES, COUNT, 3, 3))
    drift = np.linspace(0, 0.02, FRAMES)[:, None, None] * [1, -2, 0.5]
    positions = placed + drift
    positions[10:40, 0] = np.nan
    filled = filled_by_body(Markers(positions, 100.0, tuple("abcd")), placed, still)
    np.testing.assert_allclose(filled.positions, placed + drift, atol=1e-12)


def test_what_the_fit_does_not_know_stays_lost_and_what_was_measured_stays() -> None:
    true, placed, turn = moving(2)
    positions, before = true.copy(), np.zeros((FRAMES, COUNT), bool)
    positions[:, 0] = np.nan  # never seen: nothing says how far it is from its place
    positions[20:30, 1] = np.nan
    placed[:, 1] = np.nan  # not used by the fit
    positions[20:30, 2] = np.nan
    placed[25, 2] = np.nan
    before[3, 3] = True  # filled by another program
    filled = filled_by_body(Markers(positions, 100.0, tuple("abcd"), filled=before), placed, turn)
    np.testing.assert_array_equal(filled.positions[:, :2], positions[:, :2])
    assert np.isnan(filled.positions[25, 2]).all() and np.isfinite(filled.positions[[24, 26], 2]).all()
    seen = np.isfinite(positions)
    np.testing.assert_array_equal(filled.positions[seen], positions[seen])
    assert filled.filled is not None and filled.filled[3, 3] and not filled.filled[:, :2].any()
