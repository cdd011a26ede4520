"""Hand edits of trajectories: what they do to a known recording, in which order, and that a stage keeps to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from markerscope.solver.cleaning.by_hand import NOWHERE, TrackEdits, edited, sources
from markerscope.solver.cleaning.fill import METHODS
from markerscope.solver.cleaning.fill.one import fill_gap, fill_gap_by_body, gaps_in
from markerscope.solver.cleaning.fill_by_hand import PlacedFill
from markerscope.solver.cleaning.gaps import Gap
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.pipeline.cleaning import CleaningSettings, clean_markers
from markerscope.solver.pipeline.digest import digest_of
from markerscope.solver.pipeline.settings import from_table, to_table
from tests.cleaning.scenes import RATE, lose, rigid, soft, worst
from tests.cleaning.test_clean import of

FRAMES, MARKERS = 60, 5
marker, frame = st.integers(0, MARKERS - 1), st.integers(0, FRAMES - 1)


@st.composite
def edit_lists(draw: st.DrawFn) -> TrackEdits:
    span = st.tuples(frame, frame).map(sorted)
    deletes = [(m, *s) for m, s in draw(st.lists(st.tuples(marker, span), max_size=3))]
    places = draw(st.lists(st.tuples(marker, frame), max_size=3))
    cuts = [(m, f, FRAMES - 1, MARKERS + k) for k, (m, f) in enumerate(places)]
    every = st.integers(0, MARKERS + len(cuts) - 1)
    pair = st.tuples(every, every).filter(lambda p: p[0] != p[1])
    swaps = [(*p, f) for p, f in draw(st.lists(st.tuples(pair, frame), max_size=3))]
    return TrackEdits(tuple(deletes), tuple(cuts), tuple(swaps))


@hypothesis_settings(max_examples=60, deadline=None)
@given(edits=edit_lists())
def test_every_sample_that_is_not_deleted_is_somewhere_and_only_once(edits: TrackEdits) -> None:
    markers = of(rigid(FRAMES, MARKERS))
    found, after = sources(edits, FRAMES, MARKERS), edited(markers, edits)
    gone = np.zeros((FRAMES, MARKERS), bool)
    for m, first, last in edits.deletes:
        gone[first : last + 1, m] = True
    for t in range(FRAMES):
        shown = found[t][found[t] != NOWHERE]
        assert sorted(shown.tolist()) == np.flatnonzero(~gone[t]).tolist()
    expected = np.where((found != NOWHERE)[..., None], np.take_along_axis(
        np.concatenate([markers.positions, np.zeros((FRAMES, max(found.shape[1] - MARKERS, 0), 3))], axis=1),
        np.clip(found, 0, None)[..., None], axis=1), np.nan)  # fmt: skip
    assert np.array_equal(after.positions, expected, equal_nan=True)
    assert len(set(after.labels)) == len(after.labels) == after.positions.shape[1]


def test_a_trajectory_cut_in_two_and_joined_again_is_what_it_was() -> None:
    markers = of(rigid(FRAMES, MARKERS))
    cut = TrackEdits(cuts=((2, 30, FRAMES - 1, MARKERS),))
    two = edited(markers, cut)
    assert two.labels[MARKERS] == "m2_2"
    assert np.isnan(two.positions[30:, 2]).all() and np.isnan(two.positions[:30, MARKERS]).all()
    assert np.array_equal(two.positions[30:, MARKERS], markers.positions[30:, 2])
    joined = edited(markers, replace(cut, joins=((2, MARKERS, 30, FRAMES - 1),)))
    assert np.array_equal(joined.positions[:, :MARKERS], markers.positions)
    assert np.isnan(joined.positions[:, MARKERS]).all()


def test_what_is_deleted_are_samples_of_the_file_whatever_is_exchanged_later() -> None:
    markers = of(rigid(FRAMES, MARKERS))
    after = edited(markers, TrackEdits(deletes=((1, 10, 12),), swaps=((1, 3, 5),)))
    assert np.isnan(after.positions[10:13, 3]).all() and np.isfinite(after.positions[10:13, 1]).all()


@pytest.mark.parametrize("method", sorted(METHODS))
def test_one_gap_is_filled_as_it_is_among_all(method: str) -> None:
    truth = soft()
    positions = lose(truth, (7, 150, 162), (2, 155, 158), (8, 300, 310))
    gap = Gap(7, 150, 162)
    made = fill_gap(positions, RATE, gap, METHODS[method])
    assert made is not None
    fill, values = made
    assert (fill.marker, fill.first, fill.last) == (7, 150, 162) and values.shape == (13, 3)
    assert np.isfinite(fill.error) and fill.error > 0
    assert worst(values, truth[150:163, 7]) < 10 * fill.error + 0.03
    from markerscope.solver.cleaning.gaps import FillSettings

    among = METHODS[method](positions, RATE, FillSettings(max_gap=None, min_confidence=0.0))
    assert np.allclose(values, among.positions[150:163, 7])


def test_a_gap_far_into_a_long_recording_is_filled_from_about_it() -> None:
    truth = rigid(6000)
    positions = lose(truth, (1, 5500, 5520))
    made = fill_gap(positions, RATE, Gap(1, 5500, 5520), METHODS["rigid"])
    assert made is not None and made[0].first == 5500
    assert worst(made[1], truth[5500:5521, 1]) < 1e-6


def test_fills_by_hand_are_made_by_the_stage_flagged_and_measured_nowhere() -> None:
    truth = rigid()
    markers = of(lose(truth, (1, 30, 60), (2, 100, 110)))
    settings = CleaningSettings(fills=((1, 45, 45, "rigid"),))
    cleaned = clean_markers(settings, silent, markers=markers)
    assert [(f.marker, f.first, f.last, f.method, f.by_hand) for f in cleaned.fills] == [(1, 30, 60, "rigid", True)]
    assert worst(cleaned.markers.positions[:, 1], truth[:, 1]) < 1e-6
    assert cleaned.markers.filled is not None and cleaned.markers.filled[30:61, 1].all()
    assert np.isnan(cleaned.measured.positions[30:61, 1]).all()
    both = clean_markers(replace(settings, fill="linear"), silent, markers=markers)
    assert {(f.marker, f.method) for f in both.fills} == {(1, "rigid"), (2, "linear")}
    assert np.isfinite(both.decided.positions[30:61, 1]).all() and np.isnan(both.decided.positions[100:111, 2]).all()
    half = of(markers.positions[:, [1, 1]][40:])
    alone = clean_markers(CleaningSettings(fills=((1, 5, 6, "spline"),)), silent, markers=half)
    assert not alone.fills and "m1: frames 0 to 20 cannot be filled by spline" in alone.notes[-1]


def test_places_of_the_body_fill_what_is_lost_and_nothing_else() -> None:
    truth = rigid()
    markers = of(lose(truth, (1, 30, 60)))
    skin = truth + np.array([0.004, 0.0, 0.0])
    made = fill_gap_by_body(markers.positions, skin, RATE, Gap(1, 30, 60))
    assert made is not None and worst(made[1], truth[30:61, 1]) < 1e-9, "what is left at the ends is blended"
    late = np.concatenate([np.zeros((1500, *truth.shape[1:])), truth])
    made = fill_gap_by_body(lose(late, (1, 1530, 1560)), late + 0.004, RATE, Gap(1, 1530, 1560))
    assert made is not None and worst(made[1], truth[30:61, 1]) < 1e-9
    places = tuple(tuple(map(float, place)) for place in truth[28:63, 1] + 1.0)
    cleaned = clean_markers(CleaningSettings(placed=(PlacedFill(1, 28, places, 0.01),)), silent, markers=markers)
    assert [(f.first, f.last, f.method, f.by_hand) for f in cleaned.fills] == [(30, 60, "body", True)]
    assert np.allclose(cleaned.markers.positions[30:61, 1], truth[30:61, 1] + 1.0)
    assert np.array_equal(cleaned.measured.positions[28:30, 1], truth[28:30, 1])


def test_rejected_proposals_change_no_key_and_the_others_do() -> None:
    plain = CleaningSettings()
    assert digest_of(plain) == digest_of(replace(plain, rejected=(("swap", 0, 1, 40),)))
    for changed in ({"deletes": ((0, 1, 2),)}, {"cuts": ((0, 1, 2, 9),)}, {"fills": ((0, 1, 2, "rigid"),)}):
        assert digest_of(plain) != digest_of(replace(plain, **changed)), changed


def test_edits_by_hand_come_back_from_the_session_file() -> None:
    settings = CleaningSettings(
        deletes=((0, 1, 2),),
        cuts=((0, 5, 9, 5),),
        fills=((0, 1, 2, "rigid"),),
        placed=(PlacedFill(1, 3, ((0.1, 0.2, 0.3),), 0.002),),
        rejected=(("join", 1, 2, 7),),
    )
    assert from_table(CleaningSettings, to_table(settings)) == settings


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (CleaningSettings(deletes=((5, 0, 1),)), "there is no marker 5; they are numbered 0 to 4"),
        (CleaningSettings(fills=((6, 0, 1, "rigid"),), cuts=((0, 1, 2, 5),)), "there is no marker 6"),
        (CleaningSettings(cuts=((0, 1, 2, 7),)), "numbered on from 5"),
    ],
)
def test_edits_of_markers_that_are_not_there_are_refused(settings: CleaningSettings, says: str) -> None:
    with pytest.raises(InputError, match=says):
        clean_markers(settings, silent, markers=of(rigid(FRAMES, MARKERS)))


def test_the_whole_gap_is_meant_by_a_span_that_touches_it() -> None:
    positions = lose(rigid(), (1, 30, 60), (1, 80, 90))
    assert gaps_in(positions, 1, 60, 80) == [Gap(1, 30, 60), Gap(1, 80, 90)]
    assert gaps_in(positions, 1, 61, 79) == [] and gaps_in(positions, 2, 0, 200) == []
