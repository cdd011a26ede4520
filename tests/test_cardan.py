"""Three angles out of a rotation: recovered, followed over time, and flagged where they mean nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from markerscope.solver.angles.cardan import SINGULAR_DEG, TURNS, about_axes, cardan

ANKLE = np.array([[-0.105014, -0.174022, 0.979126], [0.787180, 0.604747, -0.120949]])


ARM = np.array([[-90.0, 200], [-200, 70], [-90, 90]])
ISB_ARM = np.array([[-120.0, 160], [-180, 0], [-150, 150]])
NARROW = np.array([[-180.0, 180], [-90, 90], [-180, 180]])
"""Ranges that hold the usual triple alone."""
HEADING = np.array([TURNS, (-90, 90), (-180, 180)])


def rotations(sequence: str, angles: np.ndarray) -> np.ndarray:
    return Rotation.from_euler(sequence, angles, degrees=True).as_matrix()


@given(st.sampled_from(["ZXY", "YXZ", "ZYX"]), st.tuples(*[st.floats(-170, 170), st.floats(-85, 85)] * 2))
def test_three_axes_are_recovered(sequence: str, drawn: tuple[float, ...]) -> None:
    truth = np.array([[drawn[0], drawn[1], drawn[2]]])
    found, singular = cardan(rotations(sequence, truth), sequence, NARROW)
    again = rotations(sequence, found)
    assert np.abs(again - rotations(sequence, truth)).max() < 1e-9
    assert not singular.any()
    if np.abs(truth).max() < 89:
        assert np.abs(found - truth).max() < 1e-6, f"{truth} came back as {found}"


@given(st.floats(-170, 170), st.floats(-175, -5), st.floats(-170, 170))
def test_the_middle_angle_of_isb_shoulders_is_negative(plane: float, elevation: float, turn: float) -> None:
    truth = np.array([[plane, elevation, turn]])
    found, singular = cardan(rotations("YXY", truth), "YXY", ISB_ARM)
    off = (found - truth + 180) % 360 - 180
    assert np.abs(off).max() < 1e-6 and -180 <= found[0, 1] <= 0, f"{truth} came back as {found}"
    assert not singular.any()


def test_an_arm_raised_sideways_overhead_goes_on_past_ninety() -> None:
    truth = np.stack([np.full(131, 2.0), -np.arange(131.0) + 0.3, np.full(131, 5.0)], axis=1)
    found, singular = cardan(rotations("ZXY", truth), "ZXY", ARM)
    good = ~singular[:, 0]
    assert np.abs(found[good] - truth[good]).max() < 1e-6
    passed = np.abs(found[:, 1] - truth[:, 1]).max()
    assert passed < 1, f"at the singularity the middle angle is off by {passed:.2f} degrees, more than a frame's step"
    assert np.array_equal(~good, np.abs(np.abs(truth[:, 1]) - 90) < SINGULAR_DEG), "flagged within 4 degrees of it"
    assert not singular[:, 1].any()


def test_an_arm_raised_forwards_overhead_is_flexed() -> None:
    truth = np.stack([np.arange(175.0), np.zeros(175), np.zeros(175)], axis=1)
    found, singular = cardan(rotations("ZXY", truth), "ZXY", ARM)
    assert np.abs(found - truth).max() < 1e-6 and not singular.any()


def test_every_frame_singular_is_flagged_and_no_more() -> None:
    found, singular = cardan(rotations("ZXY", np.tile([10.0, 90, 20], (5, 1))), "ZXY", NARROW)
    assert singular.tolist() == [[True, False, True]] * 5
    assert np.abs(found[:, 1] - 90).max() < 1e-4


def test_turns_are_counted_without_jumps() -> None:
    turning = np.linspace(-100, 800, 400)
    truth = np.stack([turning, np.zeros(400), np.zeros(400)], axis=1)
    found, _ = cardan(rotations("YXZ", truth), "YXZ", HEADING)
    assert np.abs(found - truth).max() < 1e-6


@given(st.tuples(*[st.floats(-180, 180)] * 3), st.sampled_from([("ZXY", 0), ("YXY", 1)]))
def test_the_reading_rebuilds_the_rotation_and_no_other_lies_nearer_to_the_ranges(
    drawn: tuple[float, ...], which: tuple[str, int]
) -> None:
    sequence, ranges = which[0], (ARM, ISB_ARM)[which[1]]
    turned = rotations(sequence, np.array([drawn]))
    found, _ = cardan(turned, sequence, ranges)
    assert np.abs(rotations(sequence, found) - turned).max() < 1e-7
    a, b, c = found[0]
    other = np.array([[a + 180, -b if sequence == "YXY" else 180 - b, c + 180]])
    assert np.abs(rotations(sequence, other) - turned).max() < 1e-7, "the two triples of one rotation"

    def cost(triple: np.ndarray) -> float:
        """Over all whole turns of each angle, the least that lies outside, and a quarter of the way from zero."""
        whole = triple[:, None] + 360.0 * np.arange(-2, 3)
        middle = ranges.mean(axis=1)[:, None]
        whole = np.take_along_axis(whole, np.abs(whole - middle).argmin(axis=1)[:, None], axis=1)
        outside = np.maximum(ranges[:, :1] - whole, 0) + np.maximum(whole - ranges[:, 1:], 0)
        return float((outside + 0.25 * np.abs(whole)).sum())

    if sequence == "YXY":
        assert -180 <= b <= 0, "by definition"
    else:
        assert cost(found[0]) <= cost(other[0]) + 1e-6


def overhead(seconds: float = 6.0) -> np.ndarray:
    """(T, 3) degrees: arms at the side, up forwards, over the head and back down at the side, and again."""
    time = np.arange(0, seconds, 0.01)
    up = 178 * np.sin(np.pi * time / 3) ** 2
    sideways = (time % 3) > 1.5  # up in front, down at the side
    flexion, abduction = np.where(sideways, 0, up), np.where(sideways, -up, 0)
    return np.stack([flexion, abduction, 3 * np.sin(9 * time)], axis=1)


def test_an_arm_back_at_the_side_reads_as_it_did_before() -> None:
    truth = overhead()
    found, singular = cardan(rotations("ZXY", truth), "ZXY", ARM)
    hanging = np.abs(truth[:, :2]).max(axis=1) < 30
    good = ~singular[:, 0]
    assert hanging[-1] and np.abs(found[-1] - truth[-1]).max() < 1e-6
    assert np.abs(found[hanging] - truth[hanging]).max() < 1e-6
    assert np.abs(found[good] - truth[good]).max() < 1e-6


def test_each_frame_is_read_by_itself() -> None:
    rng = np.random.default_rng(2)
    turned = Rotation.random(300, rng=rng).as_matrix()
    for sequence, ranges in (("ZXY", ARM), ("YXY", ISB_ARM)):
        found, _ = cardan(turned, sequence, ranges)
        order = rng.permutation(300)
        shuffled, _ = cardan(turned[order], sequence, ranges)
        assert np.array_equal(found[order], shuffled)


def test_an_arm_that_goes_round_and_round_does_not_wind() -> None:
    truth = np.stack([np.arange(0, 1080.0, 2), np.zeros(540), np.zeros(540)], axis=1)
    found, _ = cardan(rotations("ZXY", truth), "ZXY", ARM)
    assert np.abs((found - truth + 180) % 360 - 180).max() < 1e-6
    assert found[:, 0].min() >= -125 and found[:, 0].max() <= 235
    assert (np.abs(np.diff(found[:, 0])) > 300).sum() == 3, "it comes in again at the other end, once a turn"


def test_two_axes_do_not_wind_and_say_where_they_fail() -> None:
    unit = ANKLE / np.linalg.norm(ANKLE, axis=1, keepdims=True)
    turning = np.concatenate([np.linspace(0, 500, 400), np.zeros(1)])
    found, singular = about_axes(Rotation.from_rotvec(np.radians(turning[:, None]) * unit[0]).as_matrix(), ANKLE)
    assert np.abs(found).max() <= 180 and np.abs(found[-1]).max() < 1e-9
    small = np.abs(turning) < 80
    assert not singular[small].any()
    again = exp(found[:, 0], unit[0]) * exp(found[:, 1], unit[1])
    missed = (again.inv() * Rotation.from_rotvec(np.radians(turning[:, None]) * unit[0])).magnitude()
    assert np.degrees(missed[~singular[:, 0]]).max() < 0.1


def exp(degrees: np.ndarray, axis: np.ndarray) -> Rotation:
    return Rotation.from_rotvec(np.radians(degrees[:, None]) * axis)


def test_swings_through_the_singularity_do_not_drift() -> None:
    """An arm that swings past hanging exchanges plane 90 and -90; noise must not add up to whole turns."""
    rng = np.random.default_rng(0)
    swing = 40 * np.sin(np.linspace(0, 60 * np.pi, 6000))
    arm = Rotation.from_euler("Z", swing[:, None], degrees=True) * Rotation.from_rotvec(rng.normal(0, 0.02, (6000, 3)))
    found, singular = cardan(arm.as_matrix(), "YXY", ISB_ARM)
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
