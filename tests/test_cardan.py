"""Three angles out of a rotation: recovered, followed over time, and flagged where they mean nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from solver.cardan import SINGULAR_DEG, about_axes, cardan

ANKLE = np.array([[-0.105014, -0.174022, 0.979126], [0.787180, 0.604747, -0.120949]])


def rotations(sequence: str, angles: np.ndarray) -> np.ndarray:
    return Rotation.from_euler(sequence, angles, degrees=True).as_matrix()


@given(st.sampled_from(["ZXY", "YXZ", "ZYX"]), st.tuples(*[st.floats(-170, 170), st.floats(-85, 85)] * 2))
def test_three_axes_are_recovered(sequence: str, drawn: tuple[float, ...]) -> None:
    truth = np.array([[drawn[0], drawn[1], drawn[2]]])
    found, singular = cardan(rotations(sequence, truth), sequence)
    again = rotations(sequence, found)
    assert np.abs(again - rotations(sequence, truth)).max() < 1e-9
    assert not singular.any()
    if np.abs(truth).max() < 89:
        assert np.abs(found - truth).max() < 1e-6, f"{truth} came back as {found}"


@given(st.floats(-170, 170), st.floats(-175, -5), st.floats(-170, 170))
def test_the_middle_angle_of_isb_shoulders_is_negative(plane: float, elevation: float, turn: float) -> None:
    truth = np.array([[plane, elevation, turn]])
    found, singular = cardan(rotations("YXY", truth), "YXY")
    assert np.abs(found - truth).max() < 1e-6, f"{truth} came back as {found}"
    assert not singular.any()


def test_an_arm_raised_sideways_overhead_goes_on_past_ninety() -> None:
    truth = np.stack([np.full(131, 2.0), -np.arange(131.0) + 0.3, np.full(131, 5.0)], axis=1)
    found, singular = cardan(rotations("ZXY", truth), "ZXY")
    good = ~singular[:, 0]
    assert np.abs(found[good] - truth[good]).max() < 1e-6
    passed = np.abs(found[:, 1] - truth[:, 1]).max()
    assert passed < 1, f"at the singularity the middle angle is off by {passed:.2f} degrees, more than a frame's step"
    assert np.array_equal(~good, np.abs(np.abs(truth[:, 1]) - 90) < SINGULAR_DEG), "flagged within 4 degrees of it"
    assert not singular[:, 1].any()


def test_an_arm_raised_forwards_overhead_is_flexed() -> None:
    truth = np.stack([np.arange(175.0), np.zeros(175), np.zeros(175)], axis=1)
    found, singular = cardan(rotations("ZXY", truth), "ZXY")
    assert np.abs(found - truth).max() < 1e-6 and not singular.any()


def test_every_frame_singular_is_flagged_and_no_more() -> None:
    found, singular = cardan(rotations("ZXY", np.tile([10.0, 90, 20], (5, 1))), "ZXY")
    assert singular.tolist() == [[True, False, True]] * 5
    assert np.abs(found[:, 1] - 90).max() < 1e-4


def test_turns_are_counted_without_jumps() -> None:
    turning = np.linspace(-100, 800, 400)
    truth = np.stack([turning, np.zeros(400), np.zeros(400)], axis=1)
    found, _ = cardan(rotations("YXZ", truth), "YXZ")
    assert np.abs(found - truth).max() < 1e-6


def test_swings_through_the_singularity_do_not_drift() -> None:
    """An arm that swings past hanging exchanges plane 90 and -90; noise must not add up to whole turns."""
    rng = np.random.default_rng(0)
    swing = 40 * np.sin(np.linspace(0, 60 * np.pi, 6000))
    arm = Rotation.from_euler("Z", swing[:, None], degrees=True) * Rotation.from_rotvec(rng.normal(0, 0.02, (6000, 3)))
    found, singular = cardan(arm.as_matrix(), "YXY")
    good = ~singular[:, 0]
    assert good.mean() > 0.8 and singular[:, 0].any()
    forward = good & (swing > 10)
    backward = good & (swing < -10)
    for stretch, plane in ((forward, 90), (backward, -90)):
        error = np.abs(found[stretch, 0] - plane).max()
        assert error < 60, f"the plane of elevation is off {plane} by {error:.0f} degrees"
    assert found[:, 1].max() <= 0


@given(st.floats(-60, 60), st.floats(-60, 60))
def test_two_oblique_axes_are_recovered(first: float, second: float) -> None:
    unit = ANKLE / np.linalg.norm(ANKLE, axis=1, keepdims=True)
    turn = Rotation.from_rotvec(np.radians(first) * unit[0]) * Rotation.from_rotvec(np.radians(second) * unit[1])
    found, singular = about_axes(turn.as_matrix()[None], ANKLE)
    assert np.abs(found - [[first, second]]).max() < 1e-5, f"{first}, {second} came back as {found}"
    assert not singular.any()


def test_two_axes_take_what_is_nearest() -> None:
    """A turn that the joint cannot make gives the angles of least remaining rotation, found here by search."""
    from scipy.optimize import minimize

    unit = ANKLE / np.linalg.norm(ANKLE, axis=1, keepdims=True)
    wanted = Rotation.from_euler("ZXY", [20, 5, 15], degrees=True)

    def remaining(angles: np.ndarray) -> float:
        turn = Rotation.from_rotvec(angles[0] * unit[0]) * Rotation.from_rotvec(angles[1] * unit[1])
        return float((turn.inv() * wanted).magnitude() ** 2)

    best = minimize(remaining, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-14})
    found, _ = about_axes(wanted.as_matrix()[None], ANKLE)
    # Gauss-Newton in body coordinates stops where the remaining turn is square to both axes, next to the minimum.
    assert np.abs(found[0] - np.degrees(best.x)).max() == pytest.approx(0, abs=0.2)
