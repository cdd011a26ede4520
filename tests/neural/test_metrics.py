"""The paper's three measures on cases whose answer is known beforehand."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.neural.metrics import angles_between, joe, jpe, ompe


def test_marker_error_counts_hidden_samples_that_were_filled() -> None:
    truth = np.zeros((4, 3, 3))
    said = truth.copy()
    said[0, 0], said[1, 1], said[2, 2] = (0.03, 0.04, 0), (0, 0, 0.01), np.nan
    hidden = np.zeros((4, 3), dtype=bool)
    hidden[0, 0] = hidden[1, 1] = hidden[2, 2] = True
    assert np.isclose(ompe(said, truth, hidden), (5 + 1) / 2)
    assert np.isnan(ompe(said, truth, np.zeros_like(hidden)))


def test_angles_are_right_from_the_smallest_to_half_a_turn() -> None:
    axis = np.array([0.6, 0.0, 0.8])
    for degrees in (1e-4, 0.5, 90.0, 179.0, 180.0):
        found = angles_between(np.eye(3), exp_so3(np.radians(degrees) * axis))
        assert np.isclose(found, degrees, rtol=1e-6), (degrees, found)


def test_joint_errors_are_means_over_the_bodys_joints() -> None:
    truth = np.tile(np.eye(3), (5, 24, 1, 1))
    said = truth.copy()
    said[:, 4] = exp_so3(np.radians(11.0) * np.array([1.0, 0, 0]))
    said[:, 23] = exp_so3(np.array([1.0, 0, 0]))  # fingers do not count
    assert np.isclose(joe(said, truth), 11.0 / 22)
    places = np.zeros((5, 24, 3))
    moved = places.copy()
    moved[:, 7] = (0, 0.022, 0)
    moved[:, 22] = 1.0
    assert np.isclose(jpe(moved, places), 2.2 / 22)
