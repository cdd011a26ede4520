"""Steps from markers against force plates; and where nobody walks, none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.commands.trial import events_of_trial, load_trial
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.events.event import Event, require_sense, strange, times_of
from markerscope.solver.events.feet import Feet, Foot, feet_by_bone, feet_by_name
from markerscope.solver.events.merge import merged
from markerscope.solver.events.plates import contacts, events_of_plates
from markerscope.solver.events.repetitions import find_repetitions
from markerscope.solver.events.steps import StepSettings, _runs, find_steps
from markerscope.solver.io.force_plates import ForcePlate

RATE, STRIDE, STANCE = 100.0, 1.1, 0.66
SPEED = 1.25


def walker(seconds: float = 6.0, heading: float = 0.7, treadmill: bool = False) -> tuple[Feet, dict[str, np.ndarray]]:
    """Feet that stand, roll off over the toe and swing, all at known times, and the strikes of each."""
    time = np.arange(round(seconds * RATE)) / RATE
    way = np.array([np.cos(heading), np.sin(heading), 0])
    across = np.array([-way[1], way[0], 0])
    sides, strikes = {}, {}
    for side, phase, beside in (("left", 0.0, 0.08), ("right", STRIDE / 2, -0.08)):
        u = (time - phase) / STRIDE
        k, part = np.floor(u), u - np.floor(u)
        swing = np.clip((part - STANCE / STRIDE) / (1 - STANCE / STRIDE), 0, 1)
        # The foot comes down with speed left, as feet do, and not with none.
        gone = (k + swing - 0.12 * np.sin(2 * np.pi * swing)) * SPEED * STRIDE
        lift = np.clip((part * STRIDE - 0.35) / (STANCE - 0.35), 0, 1) ** 2 * 0.12 * (1 - swing)
        high = 0.05 * np.sin(np.pi * swing) ** 2
        height_heel = 0.04 + lift + high + 0.06 * swing * (1 - swing) ** 0.5
        heel = gone[:, None] * way + beside * across + height_heel[:, None] * [0, 0, 1]
        toe_high = 0.03 + high + 0.03 * np.sin(np.pi * swing)
        toe = (gone + 0.2)[:, None] * way + beside * across + toe_high[:, None] * [0, 0, 1]
        sides[side] = Foot(heel, toe)
        strikes[side] = phase + STRIDE * np.arange(0, 10)
    pelvis = (SPEED * time + 0.25)[:, None] * way + np.array([0, 0, 0.9])
    if treadmill:
        belt = (SPEED * time)[:, None] * way
        pelvis = pelvis - belt
        sides = {side: Foot(foot.heel - belt, foot.toe - belt) for side, foot in sides.items()}
    return Feet(time, RATE, sides, pelvis, "made up"), strikes


@pytest.mark.parametrize("treadmill", [False, True])
@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_every_step_is_found_wherever_somebody_walks(heading: float, treadmill: bool) -> None:
    feet, strikes = walker(heading=heading, treadmill=treadmill)
    found = find_steps(feet).events
    for side, true in strikes.items():
        ours = times_of(found, side, "foot_strike")
        true = true[(true > 0.3) & (true < feet.time[-1] - 0.3)]
        assert all(np.abs(ours - t).min() < 0.08 for t in true), (side, ours)
        assert len(ours) <= len(true) + 2
        offs = times_of(found, side, "foot_off")
        assert len(offs) >= len(true) - 1
    assert not strange(found)


@pytest.mark.parametrize(("off", "runs"), [(66, False), (40, True)])
def test_a_run_is_told_by_its_flight(off: int, runs: bool) -> None:
    frames = {"left": ([0, 110], [off, off + 110]), "right": ([55, 165], [off + 55])}
    assert _runs(frames, RATE, StepSettings()) == runs
    assert _runs({"left": frames["left"]}, RATE, StepSettings()) == runs


def test_a_foot_that_is_lost_takes_no_step_there() -> None:
    feet, _ = walker()
    left = feet.sides["left"]
    heel = left.heel.copy()
    heel[150:400] = np.nan
    found = find_steps(replace(feet, sides={**feet.sides, "left": Foot(heel, left.toe)}))
    strikes = times_of(found.events, "left", "foot_strike")
    assert not ((strikes > 1.6) & (strikes < 3.9)).any()
    assert any("left foot is lost" in note for note in found.notes)


@pytest.mark.parametrize("file", ["squat_video/squats1.trc", "subject4/STS1.trc", "squat_video/static1.trc"])
def test_nobody_who_stands_or_squats_takes_a_step(shared_data: Path, file: str) -> None:
    assert not events_of_trial(load_trial(shared_data / file)).events


@pytest.mark.parametrize("name", ["HC002D06", "HC036A10", "HC044A15"])
def test_markers_say_what_plates_and_the_laboratory_say(shared_data: Path, name: str) -> None:
    path = shared_data / "gait" / f"{name}.c3d"
    if not path.is_file():
        pytest.skip("the walks are not there")
    trial = load_trial(path)
    found = events_of_trial(trial, "markers").events
    for reference in (events_of_trial(trial, "plates").events, events_of_trial(trial, "file").events):
        inside = [e for e in reference if trial.time[0] + 0.1 < e.time < trial.time[-1] - 0.1]
        assert len(inside) >= 4
        for event in inside:
            off = np.abs(times_of(found, event.side, event.kind) - event.time).min()
            assert off < 0.05, (event, off)


def test_a_file_of_its_own_events_is_believed_first_and_plates_before_markers(shared_data: Path) -> None:
    path = shared_data / "gait" / "HC036A23.c3d"
    if not path.is_file():
        pytest.skip("the walks are not there")
    found = events_of_trial(load_trial(path))
    assert {event.source for event in found.events} == {"plates", "markers"}
    assert {e.source for e in events_of_trial(load_trial(path.with_name("HC002D06.c3d"))).events} == {"file"}
    with pytest.raises(InputError, match="holds no events"):
        events_of_trial(load_trial(path), "file")


def loaded(time: np.ndarray, start: float, stop: float, place: np.ndarray) -> ForcePlate:
    force = np.zeros((len(time), 3))
    within = (time >= start) & (time <= stop)
    force[within, 2] = 20 + 5000 * np.minimum(time[within] - start, stop - time[within])
    centre = np.where(force[:, 2:] > 20, place, np.nan)
    return ForcePlate("plate 1", time, force, centre, None)


def test_a_plate_tells_the_foot_that_stood_on_it() -> None:
    feet, strikes = walker()
    time = np.arange(6000) / 1000
    true = strikes["right"][1]
    middle = feet.sides["right"].centre[round((true + 0.2) * RATE)]
    events, notes = events_of_plates(feet, [loaded(time, true, true + STANCE, middle)])
    assert not notes
    assert [(e.side, e.kind) for e in events] == [("right", "foot_strike"), ("right", "foot_off")]
    assert events[0].time == pytest.approx(true, abs=0.002) and events[1].time == pytest.approx(
        true + STANCE, abs=0.002
    )
    far, notes = events_of_plates(feet, [loaded(time, true, true + STANCE, middle + np.array([0, 3.0, 0]))])
    assert not far and "near no foot" in notes[0]


def test_a_contact_that_the_recording_cuts_has_one_event() -> None:
    time = np.arange(2000) / 1000
    ((start, stop),) = contacts(loaded(time, -0.2, 0.5, np.zeros(3)))
    assert not start[1] and stop[1]


def test_markers_find_heel_and_toe_by_name_or_by_bone() -> None:
    rng = np.random.default_rng(0)
    names = ("subj:LHEE", "subj:LTOE", "R_calc", "r_toe", "LASI", "RASI")
    markers = Markers(rng.normal(0, 1, (30, 6, 3)), 100.0, names)
    feet = feet_by_name(markers)
    assert feet is not None and np.array_equal(feet.sides["right"].heel, markers.positions[:, 2])
    assert feet_by_name(replace(markers, labels=("a", "b", "c", "d", "e", "f"))) is None
    turn = np.broadcast_to(np.eye(3), (30, 24, 3, 3)).copy()
    places = np.broadcast_to(
        [[0, 0, -0.1], [0, 0, 0.2], [0, 0, 0.05], [1, 0, 0.2], [1, 0, -0.1], [0, 1, 0.0]], (30, 6, 3)
    )
    on = np.array([INDEX[j] for j in ("left_ankle", "left_foot", "left_ankle", "right_foot", "right_ankle", "pelvis")])
    by_bone = feet_by_bone(replace(markers, positions=places), on, turn)
    assert by_bone is not None
    assert by_bone.sides["left"].heel[0, 2] == -0.1 and by_bone.sides["left"].toe[0, 2] == 0.2
    assert by_bone.sides["right"].heel[0, 2] == -0.1


def test_of_two_accounts_the_better_one_stays() -> None:
    plate = Event(1.00, "left", "foot_strike", "plates")
    others = [Event(1.04, "left", "foot_strike", "markers"), Event(1.04, "right", "foot_strike", "markers")]
    assert [e.source for e in merged([plate], others)] == ["plates", "markers"]


def test_events_that_make_no_sense_are_said() -> None:
    twice = [Event(1.0, "left", "foot_strike", "hand")] * 2
    with pytest.raises(InputError, match="is there twice"):
        require_sense(twice, "events.csv")
    pair = [Event(1.0, "left", "foot_strike", "hand"), Event(2.0, "left", "foot_strike", "hand")]
    assert "no off between them" in strange(pair)[0]


@pytest.mark.parametrize("sits", [False, True])
def test_repetitions_are_counted_under_noise(sits: bool) -> None:
    time = np.arange(1600) / 100
    true = [(1.0 + 3 * i, 2.5 + 3 * i) for i in range(5)]
    curve = np.zeros(len(time))
    for start, end in true:  # stays there a while, where extremes mean nothing
        curve += 90 * (1 / (1 + np.exp(-(time - start) * 8)) - 1 / (1 + np.exp(-(time - end) * 8)))
    curve = 90 - curve if sits else curve
    rng = np.random.default_rng(1)
    for _ in range(20):
        found = find_repetitions(time, curve + rng.normal(0, 5, len(time)))
        assert len(found) == 5
        for one, (start, end) in zip(found, true, strict=True):
            assert abs(one.turn - (start + end) / 2) < 0.1
            assert start - 0.4 < one.start < start and end < one.end < end + 0.4


def test_an_angle_that_does_not_move_has_no_repetitions() -> None:
    with pytest.raises(InputError, match="degrees only"):
        find_repetitions(np.arange(300) / 100, np.zeros(300))
