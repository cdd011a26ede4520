"""Laying the video's body over the markers: the closed-form turns, and what is told apart and what is not."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.localize import R_LAB_UPRIGHT_CAMERA, Hypothesis, Search, hypotheses

FRAMES, PLACES = 6, 9


def body(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """(N, V, 3) m in the axes of an upright camera, places far apart and swaying a little, and the bone of each."""
    rng = np.random.default_rng(seed)
    height = np.linspace(-0.8, 0.8, PLACES)
    angle = 2.4 * np.arange(PLACES)
    rest = np.stack([0.35 * np.cos(angle), height, 0.35 * np.sin(angle)], axis=1)
    bone = np.repeat([INDEX["left_hip"], INDEX["spine1"], INDEX["right_shoulder"]], 3)
    return rest + 0.01 * rng.normal(size=(FRAMES, PLACES, 3)), bone


def laid(points: np.ndarray, turn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The places as markers in the lab, and the shift (N, 3) m of each frame."""
    shift = np.random.default_rng(5).normal(size=(FRAMES, 3))
    return points @ turn.T + shift[:, None], shift


def found(markers: np.ndarray, points: np.ndarray, bone: np.ndarray, search: Search) -> Hypothesis:
    return hypotheses(markers, points, 100 + np.arange(PLACES), bone, search)[0]


@pytest.mark.parametrize("degrees", [-25.0, -8.0, 8.0, 25.0])
def test_a_heading_near_the_start_is_found_in_one_registration(degrees: float) -> None:
    """About the vertical alone at first, so that few markers cannot tip the person over."""
    points, bone = body()
    turn = exp_so3(np.array([0, 0, np.radians(degrees)])) @ R_LAB_UPRIGHT_CAMERA
    markers, shift = laid(points, turn)
    one = found(markers, points, bone, Search(yaws=1, rounds=1))
    assert one.start == "whole body"
    assert one.vertex.tolist() == list(range(100, 100 + PLACES))
    np.testing.assert_allclose(one.R_lab_cam, turn, atol=1e-7)
    np.testing.assert_allclose(one.trans, shift, atol=1e-7)


def test_a_camera_that_looks_down_is_found_in_the_end() -> None:
    points, bone = body()
    turn = exp_so3(np.array([np.radians(12), np.radians(-7), np.radians(100)])) @ R_LAB_UPRIGHT_CAMERA
    markers, shift = laid(points, turn)
    markers[2, 3] = markers[4, 5] = np.nan
    one = found(markers, points, bone, Search(yaws=8, rounds=12))
    assert one.yaw_deg == 90
    np.testing.assert_allclose(one.R_lab_cam, turn, atol=1e-6)
    np.testing.assert_allclose(one.trans, shift, atol=1e-6)
    assert one.cost < 1e-6
    assert one.vertex.tolist() == list(range(100, 100 + PLACES))


def test_the_cost_is_the_mean_squared_distance_of_what_is_seen() -> None:
    points, bone = body()
    markers, _ = laid(points, R_LAB_UPRIGHT_CAMERA)
    rng = np.random.default_rng(1)
    markers = markers + rng.normal(0, 0.03, markers.shape)
    markers[rng.random(markers.shape[:2]) < 0.2] = np.nan
    one = found(markers, points, bone, Search(yaws=1, rounds=12))
    rows = one.vertex - 100
    off = points[:, rows] @ one.R_lab_cam.T + one.trans[:, None] - markers
    expected = np.nanmean((off**2).sum(axis=2))
    assert one.cost == pytest.approx(expected, rel=1e-4)
    np.testing.assert_allclose(np.nanmean(off, axis=1), 0, atol=1e-9)


def test_a_camera_that_is_known_is_not_turned() -> None:
    points, bone = body()
    turn = exp_so3(np.array([0, 0, 1.0])) @ R_LAB_UPRIGHT_CAMERA
    markers, _ = laid(points, exp_so3(np.array([0, 0, 0.1])) @ turn)
    for one in hypotheses(markers, points, np.arange(PLACES), bone, Search(yaws=1, rounds=12), turn):
        np.testing.assert_array_equal(one.R_lab_cam, turn)
        assert one.yaw_deg == 0


def test_a_lab_that_lies_on_its_side_is_tried_only_when_asked() -> None:
    points, bone = body()
    turn = exp_so3(np.array([np.pi / 2, 0, 0])) @ exp_so3(np.array([0, 0, np.pi / 2])) @ R_LAB_UPRIGHT_CAMERA
    markers, _ = laid(points, turn)
    asked = found(markers, points, bone, Search(yaws=4, rounds=12, any_orientation=True))
    assert asked.cost < 1e-6
    np.testing.assert_allclose(asked.R_lab_cam, turn, atol=1e-6)


def test_equal_answers_are_named_once_best_first() -> None:
    points, bone = body()
    markers, _ = laid(points, R_LAB_UPRIGHT_CAMERA)
    markers = markers + np.random.default_rng(2).normal(0, 0.15, (1, PLACES, 3))
    every = hypotheses(markers, points, np.arange(PLACES), bone, Search(yaws=8, rounds=12))
    assert len(every) > 3, "other headings and other bones are answers too"
    costs = [one.cost for one in every]
    assert costs == sorted(costs)
    assert costs[-1] <= costs[0] * (1 + 2 / np.sqrt(PLACES)) ** 2, "nine markers tell two thirds apart"
    for i, one in enumerate(every):
        for other in every[:i]:
            apart = np.degrees(np.arccos(np.clip((np.trace(one.R_lab_cam.T @ other.R_lab_cam) - 1) / 2, -1, 1)))
            assert apart > 14.9 or (bone[one.vertex] == bone[other.vertex]).mean() <= 0.8
    assert len(hypotheses(markers, points, np.arange(PLACES), bone, Search(yaws=8, keep=1))) == 1


def test_no_more_are_named_than_asked_for() -> None:
    points, bone = body()
    markers, _ = laid(points, R_LAB_UPRIGHT_CAMERA)
    markers = markers + np.random.default_rng(2).normal(0, 0.15, (1, PLACES, 3))
    every = hypotheses(markers, points, np.arange(PLACES), bone, Search(yaws=8))
    for keep in (1, 2, 3):
        some = hypotheses(markers, points, np.arange(PLACES), bone, Search(yaws=8, keep=keep))
        assert [one.cost for one in some] == [one.cost for one in every[:keep]]
