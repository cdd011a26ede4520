"""The program's own motions: on their feet, smooth, and of the whole body; and motions played forth and back."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.synth import Motion
from markerscope.solver.synth.acts import ACTS, act
from markerscope.solver.synth.motion import carried_over, damped, forth_and_back, on_floor, played
from markerscope.solver.synth.source import read_source

RATE = 60.0
ANKLES = [INDEX["left_ankle"], INDEX["right_ankle"]]


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def performed(body: Body) -> dict[str, Motion]:
    return {name: act(name, body, np.zeros(10), seconds=9.5, rate=RATE, rng=np.random.default_rng(7)) for name in ACTS}


@pytest.mark.parametrize("name", ACTS)
def test_it_stands_on_the_floor_and_moves_as_a_person_can(body: Body, performed: dict[str, Motion], name: str) -> None:
    motion = performed[name]
    _, joints = body.pose(motion.rotations, np.zeros(10), motion.trans, want_vertices=False)
    soles = np.flatnonzero(body.weights[:, [*ANKLES, INDEX["left_foot"], INDEX["right_foot"]]].sum(axis=1) > 0.9)
    skin, _ = body.pose(motion.rotations[::5], np.zeros(10), motion.trans[::5], soles)
    lowest = skin[..., 2].min(axis=1)
    assert lowest.min() > -0.03, f"a foot is {-1000 * lowest.min():.0f} mm below the floor"
    assert lowest.max() < (0.2 if name == "jacks" else 0.02), f"it floats {1000 * lowest.max():.0f} mm"
    speed = np.linalg.norm(np.diff(joints, axis=0), axis=2) * RATE
    assert speed.max() < 9, f"{speed.max():.1f} m/s"
    if name != "jacks":
        assert np.median(speed[:, ANKLES].min(axis=1)) < 0.02, "no foot stands"
    acceleration = np.linalg.norm(np.diff(joints, 2, axis=0), axis=2) * RATE**2
    assert acceleration.max() < 170, f"{acceleration.max():.0f} m/s^2"
    assert (log_so3(motion.rotations[:, [4, 5]])[..., 0] > 0).all(), "a knee bends forward"


@pytest.mark.parametrize("name", ACTS)
def test_legs_trunk_and_arms_all_move(performed: dict[str, Motion], name: str) -> None:
    turned = np.degrees(np.linalg.norm(log_so3(performed[name].rotations), axis=2))
    moved = np.ptp(turned, axis=0)
    legs = max(moved[INDEX[f"{s}_{j}"]] for s in ("left", "right") for j in ("hip", "knee"))
    arms = max(moved[INDEX[f"{s}_{j}"]] for s in ("left", "right") for j in ("shoulder", "elbow"))
    assert legs > 14 and arms > 14, f"legs {legs:.0f}, arms {arms:.0f} degrees"
    assert moved[INDEX["spine2"]] > 2


def test_no_two_motions_and_no_two_seeds_are_alike(body: Body, performed: dict[str, Motion]) -> None:
    mean = {name: log_so3(m.rotations[:560]).std(axis=0) for name, m in performed.items()}
    names = list(mean)
    for i, a in enumerate(names):
        for b in names[i + 1 :]:
            assert np.abs(mean[a] - mean[b]).max() > 0.1, f"{a} is as {b}"
    again, other = (
        act("kick", body, np.zeros(10), seconds=9.5, rate=RATE, rng=np.random.default_rng(s)) for s in (7, 8)
    )
    np.testing.assert_array_equal(again.rotations, performed["kick"].rotations)
    assert not np.allclose(other.rotations, again.rotations, atol=0.1)


def test_what_is_no_motion_is_refused_in_one_sentence(body: Body, tmp_path) -> None:
    with pytest.raises(InputError, match="use one of walk, squat"):
        act("swim", body, np.zeros(10), seconds=1, rate=30, rng=np.random.default_rng(0))
    with pytest.raises(InputError, match="swim: it is neither a file nor a motion of the program's own"):
        read_source("swim")
    (tmp_path / "a.amc").write_text(":FULLY-SPECIFIED")
    with pytest.raises(InputError, match="not beside it; name it with --skeleton"):
        read_source(tmp_path / "a.amc")
    (tmp_path / "a.fbx").touch()
    with pytest.raises(InputError, match=r"name a \.bvh, or an \.amc"):
        read_source(tmp_path / "a.fbx")


@pytest.mark.parametrize("length", [0.05, 0.3, 2.0, 7.0])
def test_playing_turns_without_a_jump_of_speed(length: float) -> None:
    time = np.arange(-20, 40, 1e-3)
    place = forth_and_back(time, length)
    assert place.min() > -1e-9 and place.max() < length + 1e-9
    assert np.ptp(place) > 0.99 * length, "a part is never played"
    speed = np.diff(place) / 1e-3
    assert np.abs(speed).max() < 1 + 1e-6
    turn = min(0.25, 0.5 * length)
    assert np.abs(np.diff(speed)).max() < 1e-3 / turn * 1.01, "speed jumps"
    assert (np.sign(speed) > 0).mean() == pytest.approx(0.5, abs=0.1)


def test_a_window_of_a_long_motion_is_the_motion(performed: dict[str, Motion]) -> None:
    motion = performed["reach"]
    window = played(motion, 90, 30.0)
    start = 0.125  # s, half a turn
    source = np.stack([np.interp(start + window.time, motion.time, c) for c in motion.trans.T], axis=1)
    np.testing.assert_allclose(window.trans, source, atol=1e-3)
    later = played(motion, 80, 30.0, first=10)
    np.testing.assert_allclose(later.rotations, window.rotations[10:], atol=1e-9)


def test_a_short_motion_is_played_back_without_a_jump(body: Body, performed: dict[str, Motion]) -> None:
    motion = performed["throw"]
    short = Motion(motion.rotations[:100], motion.trans[:100], RATE)
    long = played(short, 600, RATE)
    _, joints = body.pose(long.rotations, np.zeros(10), long.trans, want_vertices=False)
    _, once = body.pose(short.rotations, np.zeros(10), short.trans, want_vertices=False)
    step, usual = (np.linalg.norm(np.diff(j, axis=0), axis=2) for j in (joints, once))
    assert step.max() <= usual.max() * 1.02
    change = np.linalg.norm(np.diff(joints, 2, axis=0), axis=2).max() * RATE**2
    natural = np.linalg.norm(np.diff(once, 2, axis=0), axis=2).max() * RATE**2
    assert change < natural + 2 * usual.max() * RATE / 0.25, "the turn is a jerk"


def test_a_damped_motion_is_about_the_same_pose_and_smaller(performed: dict[str, Motion]) -> None:
    motion = performed["march"]
    quiet = damped(motion, 0.1)
    mean = np.linalg.norm(quiet.rotations.mean(axis=0) - motion.rotations.mean(axis=0), axis=(1, 2))
    assert mean.max() < 0.35  # a mean of far apart rotations is shorter than a rotation
    np.testing.assert_allclose(quiet.trans.std(axis=0), 0.1 * motion.trans.std(axis=0))
    size = [
        np.linalg.norm(log_so3(m.rotations[:1].swapaxes(2, 3) @ m.rotations), axis=2).max(axis=0)
        for m in (motion, quiet)
    ]
    moving = size[0] > 0.2
    np.testing.assert_allclose(size[1][moving] / size[0][moving], 0.1, atol=0.04)


def test_a_motion_made_for_one_body_stands_on_another_one_s_feet(body: Body, performed: dict[str, Motion]) -> None:
    from dataclasses import replace

    small = replace(body, template=0.8 * body.template, joint_template=0.8 * body.joint_template, _torch={})
    motion = on_floor(carried_over(performed["tour"], body.joint_template, small, np.zeros(10)), small, np.zeros(10))
    _, joints = small.pose(motion.rotations, np.zeros(10), motion.trans, want_vertices=False)
    _, old = body.pose(performed["tour"].rotations, np.zeros(10), performed["tour"].trans, want_vertices=False)
    away = joints - 0.8 * old
    assert np.ptp(away, axis=0).max() < 1e-9, "all of it is smaller by the same factor"
    assert abs(away[0, 0, 2]) < 0.02
