"""The table of the markers and the curves of the angles, against plain loops and the solver's own words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import groupby
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from markerscope.app.views.angles import angles_picture, bones_of, joint_of, title_of
from markerscope.app.views.markers import gap_lengths, marker_table
from markerscope.app.views.tracks import MEASURED, tracks_of
from markerscope.solver.angles.angles import AngleSettings, Convention, conventions, evidence, joint_angles
from markerscope.solver.clustering.segment import segment
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.pull.results import nothing_drawn
from tests.app.views.conftest import Made


@given(arrays(bool, st.tuples(st.integers(1, 30), st.integers(1, 4))))
@settings(max_examples=80)
def test_gaps_are_the_runs_of_lost_frames(lost: np.ndarray) -> None:
    count, longest = gap_lengths(lost)
    for m in range(lost.shape[1]):
        runs = [len(list(frames)) for gone, frames in groupby(lost[:, m]) if gone]
        assert (count[m], longest[m]) == (len(runs), max(runs, default=0))


def test_a_row_says_what_is_known_of_its_marker(made: Made) -> None:
    tracks = tracks_of(made.markers, made.motion)
    found = segment(made.markers)
    table = marker_table(tracks, found, made.motion)
    assert np.array_equal(table.group, found.clusters + 1)
    for m in range(14):
        share = sum(bool(here) for here in made.markers.present[:, m]) / 60
        assert np.isclose(table.measured[m], 100 * share)
        known = {t: r for t, r in enumerate(made.motion.residual[:, m]) if np.isfinite(r)}
        if m < 12:
            worst = max(known, key=lambda t: known[t])
            assert np.isclose(table.worst_time[m], made.markers.time[worst])
            assert np.isclose(table.worst[m], 1000 * known[worst])
            assert np.isclose(table.mean[m], 1000 * sum(known.values()) / len(known))
            assert np.isclose(table.p95[m], 1000 * np.percentile(list(known.values()), 95))
            assert table.bone[m]
        else:
            assert table.bone[m] == ""
            assert np.isnan([table.mean[m], table.p95[m], table.worst[m], table.worst_time[m]]).all()
    longest = max(len(list(g)) for lost, g in groupby(~made.markers.present[:, 3]) if lost)
    assert np.isclose(table.longest_gap[3], longest / 50.0)


def test_markers_that_the_rules_doubt_are_marked(made: Made) -> None:
    verdict = Verdict(0.6, (), nobody=(12,), suspect=(3,))
    tracks = tracks_of(made.markers, made.motion)
    plain, marked = (marker_table(tracks, None, made.motion, found).bone for found in (None, verdict))
    assert marked[3] == f"{plain[3]} (doubtful)" and marked[12] == "nobody's"
    assert [name for m, name in enumerate(marked) if m not in (3, 12)] == [
        name for m, name in enumerate(plain) if m not in (3, 12)
    ]
    of_others = replace(verdict, suspect=(99,))
    assert marker_table(tracks, None, made.motion, of_others).bone == plain, "of a file with other markers"


def test_a_row_says_which_landmark_its_marker_was_drawn_to(made: Made) -> None:
    pull = nothing_drawn("earned", 20.0, 14)
    chance, after = pull.probability.copy(), pull.after.copy()
    chance[2], after[2] = 0.9, 0.007
    names = ("", "", "left_asis", *("",) * 11)
    drawn = replace(pull, landmark=names, probability=chance, after=after)
    table = marker_table(tracks_of(made.markers), None, replace(made.motion, pull=drawn))
    assert table.landmark[2] == "left asis" and not any(table.landmark[:2])
    assert np.isclose([table.probability[2], table.beside[2]], [90, 7]).all()
    assert np.isnan([table.probability[3], table.beside[3]]).all()
    assert set(marker_table(tracks_of(made.markers), None, made.motion).landmark) == {""}


def test_before_any_result_the_table_tells_of_presence_alone(made: Made) -> None:
    table = marker_table(tracks_of(made.markers))
    assert (table.group == 0).all() and set(table.bone) == {""}
    assert np.isnan(table.mean).all() and np.isnan(table.worst_time).all()


def test_what_was_filled_is_not_measured(made: Made) -> None:
    filled = np.zeros((60, 14), bool)
    filled[:30, 0] = made.markers.present[:30, 0]
    tracks = tracks_of(replace(made.markers, filled=filled))
    assert np.isclose(marker_table(tracks).measured[0], 100 * made.markers.present[30:, 0].sum() / 60)
    assert (tracks.state[:30, 0] != MEASURED).all()


def angles_of(made: Made, convention: Convention) -> JointAngles:
    motion = made.motion
    landmarks, joints = made.body.landmarks(motion.betas), made.body.joints(motion.betas)
    return joint_angles(motion.time, motion.rotations, landmarks, joints, AngleSettings(convention))


@pytest.mark.parametrize("convention", get_args(Convention))
def test_every_column_of_every_convention_is_a_curve_once(made: Made, convention: Convention) -> None:
    angles = angles_of(made, convention)
    shown = angles_picture(angles, made.motion.marker_joint)
    curves = [curve for plot in shown.plots for curve in plot.curves]
    assert sorted(curve.name for curve in curves) == sorted(angles.names)
    grounds = evidence(convention, made.motion.marker_joint)
    for curve in curves:
        i = angles.names.index(curve.name)
        known = ~angles.singular[:, i]
        assert np.array_equal(curve.degrees[known], angles.degrees[known, i])
        assert np.isnan(curve.degrees[~known]).all()
        assert curve.rests_on == grounds[curve.name]
        assert curve.positive == angles.positive[i]
    assert shown.joints == tuple(conventions()[convention]["joints"])
    for plot in shown.plots:
        sides = [curve.side for curve in plot.curves]
        assert sides in ([""], ["left", "right"])
        assert len({curve.colour for curve in plot.curves}) == len(sides)


def test_left_is_left(made: Made) -> None:
    shown = angles_picture(angles_of(made, "opensim"))
    knee = next(plot for plot in shown.plots if plot.joint == "knee")
    assert knee.title == "Knee angle"
    assert {curve.side: curve.name for curve in knee.curves} == {"left": "knee_angle_l", "right": "knee_angle_r"}


@pytest.mark.parametrize(
    ("pattern", "title"),
    [
        ("hip_flexion_{s}", "Hip flexion"),
        ("pelvis_tilt", "Pelvis tilt"),
        ("{S}HipAnglesX", "Hip angles X"),
        ("{S}KNEE_ANGLE_Y", "Knee angle Y"),
        ("PELVIS_ANGLE_X", "Pelvis angle X"),
        ("arm_rot_{s}", "Arm rotation"),
        ("pro_sup_{s}", "Pronation supination"),
    ],
)
def test_titles_are_words(pattern: str, title: str) -> None:
    assert title_of(pattern) == title


def test_values_at_the_cursor_are_those_of_the_nearest_frame(made: Made) -> None:
    angles = angles_of(made, "opensim")
    values = angles_picture(angles).values_at(float(made.motion.time[17]) + 0.009)
    for i, name in enumerate(angles.names):
        wanted = np.nan if angles.singular[17, i] else angles.degrees[17, i]
        assert np.isclose(values[name], wanted, equal_nan=True), name


def test_another_result_is_compared_on_this_clock(made: Made) -> None:
    angles = angles_of(made, "opensim")
    part = slice(10, 50, 2)
    sound = np.zeros((20, len(angles.names)), bool)
    other = replace(angles, time=angles.time[part], degrees=angles.degrees[part] + 5.0, singular=sound)
    curve = angles_picture(angles, reference=other).plots[0].curves[0]
    assert curve.reference is not None
    i = angles.names.index(curve.name)
    assert np.allclose(curve.reference[part], angles.degrees[part, i] + 5.0)
    assert np.isnan(curve.reference[:10]).all() and np.isnan(curve.reference[49:]).all()
    between = 0.5 * (angles.degrees[10, i] + angles.degrees[12, i]) + 5.0
    assert np.isclose(curve.reference[11], between)
    foreign = angles_picture(angles, reference=angles_of(made, "isb"))
    assert all(curve.reference is None for plot in foreign.plots for curve in plot.curves)


def test_the_angles_of_a_real_solve_have_their_words(results: Mapping[str, Any]) -> None:
    shown = angles_picture(results["angles"], results["fit"].marker_joint)
    assert shown.convention.startswith("OpenSim") and "stance" in shown.zero_pose
    assert {curve.rests_on for plot in shown.plots for curve in plot.curves} <= {"markers", "one segment", "video only"}


def test_bones_and_the_joints_of_the_conventions() -> None:
    names = {JOINTS[bone]: joint_of(bone) for bone in range(len(JOINTS))}
    assert names["left_knee"] == names["right_knee"] == "knee" and names["head"] is None and joint_of(None) is None
    assert {JOINTS[bone] for bone in bones_of("elbow")} == {"left_elbow", "right_elbow"}
    known = {joint for own in conventions().values() for joint in own["joints"]}
    assert {joint for joint in names.values() if joint} == known, "every joint of every convention has bones"
