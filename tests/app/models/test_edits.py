"""Decisions as functions: what each changes, what it says, and that groups come out as the user made them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as tried
from hypothesis import strategies as st

from markerscope.app.models import clean_edits, edits, group_edits, landmark_edits
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.clustering.segment import Segmentation, regroup, segment
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session, load_session, save_session

EMPTY = Session(Path("/nowhere"))
LABELS = tuple("abcdefgh")


def stage(session: Session, name: str):
    return session.stage_settings(graph_of(session))[name]


def test_a_setting_goes_to_the_settings_and_a_decision_to_the_edits() -> None:
    edit = edits.set_value(EMPTY, "orient", "offset_mm", 12.0)
    assert edit.sentence == "Orientation: offset 12 mm, was 9.5 mm"
    assert (edit.session.settings, edit.session.edits) == ({"orient": {"offset_mm": 12.0}}, {})
    edit = edits.set_value(EMPTY, "segment", "threshold", 6.5)
    assert (edit.session.settings, edit.session.edits) == ({}, {"segment": {"threshold": 0.0065}})
    assert stage(edit.session, "segment").threshold == 0.0065


def test_none_can_be_decided_over_a_value_and_taken_back() -> None:
    given_offset = replace(EMPTY, settings={"sync": {"offset": 0.5}})
    found = edits.find_offset(given_offset).session
    assert stage(found, "sync").offset is None
    set_again = edits.set_offset(found, 0.25).session
    assert stage(set_again, "sync").offset == 0.25
    assert stage(edits.reset_value(set_again, "sync", "offset").session, "sync").offset is None
    assert stage(edits.take_back(found, "sync").session, "sync").offset == 0.5


def test_offset_and_pin_leave_no_trace_when_taken_back() -> None:
    assert edits.find_offset(edits.set_offset(EMPTY, 1.0).session).session == EMPTY
    assert edits.unpin_candidate(edits.pin_candidate(EMPTY, 1).session).session == EMPTY


def test_a_cloud_is_chosen_for_this_recording_and_can_be_taken_back() -> None:
    edit = edits.choose_cloud(EMPTY, 2)
    assert edit.sentence == "Solve cloud 2 of the markers"
    assert edit.session.edits == {"localize": {"part_of_cloud": 2}} and not edit.session.settings
    assert stage(edit.session, "localize").part_of_cloud == 2
    assert edits.take_back(edit.session, "localize").session == EMPTY


def test_sentences_count_from_one_and_name_units() -> None:
    assert edits.pin_candidate(EMPTY, 1).sentence == "Candidate 2 pinned"
    assert edits.set_offset(EMPTY, 0.37).sentence == "Offset of the video +0.370 s"
    assert edits.set_range(EMPTY, 2.0, None).sentence == "Solve from 2.00 s to the end"
    assert edits.set_range(EMPTY, None, None).sentence == "Solve the whole recording"
    assert group_edits.cut_at(EMPTY, 0.0123).sentence == "Groups cut at 12.3 mm"


def test_a_range_may_be_open_at_either_end() -> None:
    session = edits.set_range(edits.set_range(EMPTY, 1.0, 2.0).session, None, 3.0).session
    assert (stage(session, "markers").start, stage(session, "markers").stop) == (None, 3.0)


def test_a_value_that_cannot_be_is_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match="refine"):
        stage(edits.set_value(EMPTY, "orient", "refine", 0).session, "orient")
    with pytest.raises(InputError, match="seed"):
        edits.set_seed(EMPTY, -1)


def test_inputs_are_files_that_are_there(tmp_path: Path) -> None:
    video = tmp_path / "film.mp4"
    with pytest.raises(InputError, match="there is no such video"):
        edits.set_input(EMPTY, "video_file", video)
    with pytest.raises(InputError, match="is a folder"):
        edits.set_input(EMPTY, "video_file", tmp_path)
    video.touch()
    edit = edits.set_input(EMPTY, "video_file", video)
    assert (edit.sentence, edit.session.inputs["video_file"].path) == ("Video film.mp4", video)
    assert edits.set_input(edit.session, "video_file", None).session == EMPTY
    with pytest.raises(InputError, match="cannot be without one"):
        edits.set_input(EMPTY, "marker_file", None)


def test_another_method_keeps_what_it_shares() -> None:
    session = edits.set_offset(edits.pin_candidate(EMPTY, 1).session, 0.3).session
    other = edits.set_method(session, "paper").session
    assert other.run.method == "paper"
    assert stage(other, "sync").offset == 0.3
    assert stage(other, "fit").candidate is None


def test_restoring_gives_settings_and_decisions_back() -> None:
    before = edits.set_offset(edits.set_value(EMPTY, "localize", "keep", 5).session, 0.3).session
    wanted = {name: stage(before, name) for name in ("sync", "localize")}
    later = edits.find_offset(edits.set_value(before, "localize", "keep", 9).session).session
    again = edits.restore(later, wanted, "bundle", "back").session
    assert {name: stage(again, name) for name in wanted} == wanted
    assert again.edits == {"sync": {"offset": 0.3}}


@pytest.fixture(scope="module")
def found() -> Segmentation:
    return grouping()


@cache
def grouping() -> Segmentation:
    """Eight markers on three rigid bodies, one never seen."""
    rng = np.random.default_rng(1)
    owner = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    paths = np.cumsum(0.02 * rng.normal(size=(200, 3, 3)), axis=0) + rng.normal(size=(3, 3)) * 0.2
    positions = paths[:, owner] + 0.02 * rng.normal(size=(8, 3)) + 0.001 * rng.normal(size=(200, 8, 3))
    positions[:, 7] = np.nan
    return segment(Markers(positions, 100.0, LABELS))


def partition(groups: np.ndarray) -> set[frozenset[int]]:
    return {frozenset(np.flatnonzero(groups == k).tolist()) for k in set(groups.tolist()) - {-1}}


def shown(session: Session, found: Segmentation) -> Segmentation:
    return regroup(found, stage(session, "segment"))


def test_the_made_up_bodies_are_found(found: Segmentation) -> None:
    assert partition(found.clusters) == {frozenset({0, 1, 2}), frozenset({3, 4, 5}), frozenset({6})}


def test_group_edits_say_which_markers(found: Segmentation) -> None:
    edit = group_edits.merge(EMPTY, found, {0, 1, 2, 3}, LABELS)
    assert edit.sentence == "Groups of a, b and 2 more merged"
    assert stage(edit.session, "segment").merges == ((0, 1, 2, 3),)
    assert group_edits.move(EMPTY, found, [2], 4, LABELS).sentence == "c moved to the group of e"
    assert group_edits.leave_out(EMPTY, found, [2, 4], LABELS).sentence == "c and e left out"


@pytest.mark.parametrize(
    ("do", "said"),
    [
        (lambda f: group_edits.merge(EMPTY, f, [0, 1], LABELS), "of one group already"),
        (lambda f: group_edits.split(EMPTY, f, [0, 1, 2], LABELS), "of their own already"),
        (lambda f: group_edits.split(EMPTY, f, [7], LABELS), "in no group"),
        (lambda f: group_edits.move(EMPTY, f, [0], 1, LABELS), "in that group already"),
        (lambda f: group_edits.move(EMPTY, f, [0], 7, LABELS), "h is in no group"),
        (lambda f: group_edits.take_in(EMPTY, [0], LABELS), "not left out"),
    ],
)
def test_what_would_change_nothing_is_said(found: Segmentation, do, said: str) -> None:
    with pytest.raises(InputError, match=said):
        do(found)


one = st.integers(0, 7)
some = st.lists(one, min_size=1, max_size=4, unique=True)
actions = st.one_of(
    st.tuples(st.just("merge"), some),
    st.tuples(st.just("split"), some),
    st.tuples(st.just("move"), some, one),
    st.tuples(st.just("leave_out"), some),
)


@tried(max_examples=60)
@given(st.lists(actions, max_size=8))
def test_any_sequence_of_edits_makes_the_groups_it_says(sequence: list[tuple]) -> None:
    found = grouping()
    session, wanted = EMPTY, partition(found.clusters)
    for kind, markers, *host in sequence:
        try:
            edit = getattr(group_edits, kind)(session, shown(session, found), markers, *host, LABELS)
        except InputError:
            continue
        chosen = {m for m in markers if any(m in group for group in wanted)}
        if kind == "merge":
            touched = {group for group in wanted if group & chosen}
            wanted = (wanted - touched) | {frozenset().union(*touched)}
        else:
            rest = {group - chosen for group in wanted}
            (home,) = [group for group in wanted if host and host[0] in group] or [frozenset()]
            if kind == "split":
                rest.add(frozenset(chosen))
            elif kind == "move":
                rest = (rest - {home - chosen}) | {home | chosen}
            wanted = rest - {frozenset()}
        session = edit.session
        assert partition(shown(session, found).clusters) == wanted, (kind, markers, host)


def test_what_was_left_out_comes_back_where_it_was(found: Segmentation) -> None:
    out = group_edits.leave_out(EMPTY, found, [1, 4], LABELS).session
    assert shown(out, found).clusters[[1, 4]].tolist() == [-1, -1]
    back = group_edits.take_in(out, [1], LABELS)
    assert back.sentence == "b taken in again"
    assert shown(back.session, found).clusters[4] == -1
    assert partition(shown(group_edits.undo_all(out).session, found).clusters) == partition(found.clusters)


def test_hand_edits_survive_the_session_file(found: Segmentation, tmp_path: Path) -> None:
    session = group_edits.move(replace(EMPTY, folder=tmp_path), found, [0], 4, LABELS).session
    session = group_edits.cut_into(edits.set_range(session, 1.0, None).session, 2).session
    save_session(session)
    again = load_session(tmp_path)
    assert again.stage_settings(graph_of(again)) == session.stage_settings(graph_of(session))
    assert again.edits == session.edits


def test_proposed_edits_of_tracks_are_made_once() -> None:
    swap = Proposal("swap", 30, 99, (2, 5), 0.1, "c and f exchange from frame 30 on.")
    join = Proposal("join", 10, 20, (1, 7), 0.1, "h goes on as b.")
    session = clean_edits.accept(EMPTY, swap).session
    session = clean_edits.accept(session, join).session
    session = clean_edits.keep_samples(session, {3: (4, 8)}, LABELS).session
    assert clean_edits.accept(session, swap).session == session
    assert clean_edits.accept(session, swap).sentence == "c and f exchange from frame 30 on"
    found = stage(session, "clean")
    assert (found.swaps, found.joins, found.keep) == (((2, 5, 30),), ((1, 7, 10, 20),), ((3, 4, 8),))


def test_samples_of_several_markers_are_put_back_in_one_step() -> None:
    edit = clean_edits.keep_samples(EMPTY, {3: (4, 8), 5: (2, 6)}, LABELS)
    assert stage(edit.session, "clean").keep == ((3, 4, 8), (5, 2, 6))
    assert edit.sentence == "2 markers kept as measured between frames 2 and 8"
    one = clean_edits.keep_samples(EMPTY, {3: (4, 8)}, LABELS)
    assert one.sentence == "d kept as measured in frames 4 to 8"


def test_a_marker_is_pinned_to_a_landmark_kept_from_it_and_left_to_the_program() -> None:
    pinned = landmark_edits.pin(EMPTY, 2, "left_asis", LABELS)
    assert pinned.sentence == "c pinned to left asis"
    assert stage(pinned.session, "fit").pinned == ((2, "left_asis"),)
    taken = landmark_edits.pin(pinned.session, 3, "left_asis", LABELS).session
    assert stage(taken, "fit").pinned == ((3, "left_asis"),), "a landmark holds one marker"
    moved = landmark_edits.pin(pinned.session, 2, "right_asis", LABELS).session
    assert stage(moved, "fit").pinned == ((2, "right_asis"),), "a marker sits on one landmark"
    kept = landmark_edits.refuse(pinned.session, [(2, "left_asis"), (4, "")], LABELS)
    assert kept.sentence == "c kept from left asis and 1 more"
    assert (stage(kept.session, "fit").pinned, stage(kept.session, "fit").refused) == ((), ((2, "left_asis"), (4, "")))
    assert stage(landmark_edits.pin(kept.session, 4, "c7", LABELS).session, "fit").refused == ((2, "left_asis"),)
    assert landmark_edits.release(kept.session, [2, 4], LABELS).session == EMPTY
    with pytest.raises(InputError, match="nothing was decided"):
        landmark_edits.release(EMPTY, [2], LABELS)
    with pytest.raises(InputError, match="kept from landmarks already"):
        landmark_edits.refuse(kept.session, [(2, "left_asis")], LABELS)


def test_landmarks_decided_in_the_settings_can_be_released_too() -> None:
    written = replace(EMPTY, settings={"fit": {"pinned": [[1, "c7"]]}})
    assert stage(landmark_edits.release(written, [1], LABELS).session, "fit").pinned == ()
