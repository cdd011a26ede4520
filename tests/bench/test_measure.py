"""Right part, right bones and right heading, on answers whose judgement is plain."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.bench.measure import errors, heading_error_deg, measure, near_bones, right_part
from markerscope.solver.bench.methods import Alternative, Solved
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, mirror_index
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise

LEG = [INDEX[f"left_{name}"] for name in ("hip", "knee", "ankle", "foot")]


def test_the_right_part_is_four_fifths_of_the_true_markers() -> None:
    true = np.array(LEG * 2 + [LEG[0], LEG[1], -1, -1])
    found = true.copy()
    found[-2:] = 0  # ghosts do not count
    assert right_part(found, true, "left_leg")
    found[:2] = -1
    assert right_part(found, true, "left_leg")
    found[2] = INDEX["right_knee"]
    assert not right_part(found, true, "left_leg")
    assert not right_part(mirror_index()[true], true, "left_leg")


def test_on_the_whole_body_limbs_are_told_apart() -> None:
    true = np.arange(22)
    assert right_part(true, true, None)
    assert not right_part(mirror_index()[true], true, None)
    near = true.copy()
    near[INDEX["left_knee"]] = INDEX["left_hip"]
    assert right_part(near, true, None)
    assert near_bones(near, true) == 1
    near[INDEX["left_knee"]] = INDEX["head"]
    assert near_bones(near, true) == pytest.approx(21 / 22)


@given(st.floats(-179, 179), st.floats(-1, 1), st.floats(-1, 1))
def test_heading_is_the_turn_about_the_vertical(yaw: float, pitch: float, roll: float) -> None:
    root = exp_so3(np.array([[pitch, roll, 0.3]] * 5))
    turned = exp_so3(np.array([0, 0, np.radians(yaw)])) @ root
    assert heading_error_deg(turned, root) == pytest.approx(abs(yaw), abs=1e-6)


@pytest.fixture(scope="module")
def session() -> SynthSession:
    return synthesise("walk", SynthSettings(frames=30, markers=12, shape="inside", ghosts=2), 3)


def answer(session: SynthSession, turn_deg: float = 0.0, side: np.ndarray | None = None) -> Solved:
    """The truth itself, turned about the vertical or with its sides exchanged."""
    truth = session.truth
    turn = exp_so3(np.array([0, 0, np.radians(turn_deg)]))
    rotations = truth.motion.rotations.copy()
    rotations[:, 0] = turn @ rotations[:, 0]
    joint = truth.marker_joint if side is None else np.where(truth.marker_joint < 0, -1, side[truth.marker_joint])
    motion = SimpleNamespace(
        time=session.markers.time,
        rotations=rotations,
        trans=truth.motion.trans,
        betas=truth.betas,
        joints=truth.joints,
        marker_joint=joint,
        confidence=0.7,
        warnings=("A tie.",),
    )
    return Solved(motion, truth.body, truth.offset + 0.02, {"fit": 1.0})  # type: ignore[arg-type]


def test_the_truth_is_without_error(session: SynthSession) -> None:
    found = measure(session, answer(session))
    for name in ("mpjpe_mm", "pa_mpjpe_mm", "mpjve_mm_s", "v2v_mm", "part_mpjpe_mm"):
        assert found[name] == pytest.approx(0, abs=1e-6), name
    assert found["m2s_mm"] == pytest.approx(found["m2s_reference_mm"])
    assert 5 < found["m2s_mm"] < 15, "ghosts do not count"
    assert found["right"]
    assert found["named"]
    assert found["ambiguous"]
    assert found["sync_error_s"] == pytest.approx(0.02)


def test_a_wrong_answer_can_be_named_beside_others(session: SynthSession) -> None:
    turned = measure(session, answer(session, 90))
    assert (turned["right_yaw"], turned["right_part"], turned["right"], turned["named"]) == (False, True, False, False)
    assert turned["heading_error_deg"] == pytest.approx(90)
    flipped = answer(session, side=mirror_index())
    assert not measure(session, flipped)["right_part"]
    truth = session.truth
    frames = np.array([0, 10, 20])
    other = Alternative(truth.marker_joint, frames, truth.motion.rotations[frames, 0])
    assert measure(session, replace(flipped, alternatives=(other,)))["named"]


def test_errors_of_a_part_are_of_its_joints(session: SynthSession) -> None:
    solved = answer(session)
    joints = solved.motion.joints.copy()
    joints[:, LEG] += [0.03, 0, 0]
    moved = SimpleNamespace(**{**vars(solved.motion), "joints": joints})
    leg = replace(session, settings=replace(session.settings, part="left_leg"))
    found = errors(leg, moved, solved.body)  # type: ignore[arg-type]
    assert found["part_mpjpe_mm"] == pytest.approx(30)
    assert found["mpjpe_mm"] == pytest.approx(30 * len(LEG) / 24)
