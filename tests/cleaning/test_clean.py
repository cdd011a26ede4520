"""Cleaning as a whole: everything is known afterwards and can be taken back; tracks are mended only when asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from markerscope.solver.cleaning.clean import Cleaned, CleanSettings, clean, put_back
from markerscope.solver.cleaning.gaps import FillSettings
from markerscope.solver.cleaning.outliers import OutlierSettings
from markerscope.solver.cleaning.swaps import Proposal, apply_proposals, find_proposals
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import silent
from markerscope.solver.pipeline.cleaning import CleaningSettings, clean_markers
from markerscope.solver.pipeline.codec import decode, encode
from tests.cleaning.scenes import RATE, lose, rigid


def of(positions: np.ndarray, filled: np.ndarray | None = None) -> Markers:
    return Markers(positions, RATE, tuple(f"m{i}" for i in range(positions.shape[1])), first_time=2.0, filled=filled)


def damaged(seed: int = 0) -> Markers:
    """Gaps, an outlier, and a few samples that the file has as filled, one of them the outlier."""
    rng = np.random.default_rng(seed)
    positions = lose(rigid(seed=seed), (1, 30, 60), (2, 100, 101), (6, 0, 239))
    positions[80, 3] += 0.05
    filled = rng.random(positions.shape[:2]) < 0.05
    filled[80, 3] = True
    return of(positions, filled & np.isfinite(positions).all(axis=2))


def test_everything_can_be_taken_back_to_the_bit() -> None:
    markers = damaged()
    cleaned = clean(markers)
    assert cleaned.outliers.mask(markers.present.shape)[80, 3]
    assert {(f.marker, f.first, f.last) for f in cleaned.fills} >= {(1, 30, 60), (2, 100, 101), (3, 80, 80)}
    assert np.isnan(cleaned.markers.positions[:, 6]).all()
    back = put_back(cleaned)
    assert np.array_equal(back.positions, markers.positions, equal_nan=True)
    assert np.array_equal(back.filled, markers.filled)
    unfilled = put_back(cleaned, outliers=False)
    assert np.isnan(unfilled.positions[80, 3]).all()
    assert np.isnan(unfilled.positions[30:61, 1]).all()
    kept = put_back(cleaned, fills=False)
    assert np.array_equal(kept.positions[80, 3], markers.positions[80, 3])
    assert np.isfinite(kept.positions[30:61, 1]).all()


@hypothesis_settings(max_examples=20)
@given(seed=st.integers(0, 10**6), share=st.floats(0, 0.6), size=st.floats(0, 0.2))
def test_any_recording_is_whole_again_after_putting_back(seed: int, share: float, size: float) -> None:
    rng = np.random.default_rng(seed)
    positions = rigid(int(rng.integers(1, 80)), int(rng.integers(1, 8)), seed)
    positions += rng.normal(size=positions.shape) * size * (rng.random((*positions.shape[:2], 1)) < 0.05)
    positions[rng.random(positions.shape[:2]) < share] = np.nan
    positions[0, 0] = 0.5
    before = positions.copy()
    cleaned = clean(of(positions))
    assert np.array_equal(positions, before, equal_nan=True)
    assert np.array_equal(put_back(cleaned).positions, before, equal_nan=True)
    present, cut = np.isfinite(before).all(axis=2), cleaned.outliers.mask(before.shape[:2])
    assert np.array_equal(cleaned.markers.positions[present & ~cut], before[present & ~cut])
    assert not (cut & ~present).any()
    assert not (cleaned.markers.filled & present & ~cut).any()


def test_what_is_kept_is_not_cut_and_nothing_is_done_that_was_not_asked_for() -> None:
    markers = damaged()
    kept = clean(markers, CleanSettings(keep=((3, 79, 81),), fill_gaps=False))
    assert not kept.outliers.mask(markers.present.shape)[79:82, 3].any()
    idle = clean(markers, CleanSettings(OutlierSettings(method="none"), fill_gaps=False, tracks=False))
    assert np.array_equal(idle.markers.positions, markers.positions, equal_nan=True)
    assert not idle.fills
    assert not idle.proposals


@pytest.mark.parametrize(("first", "last", "cut"), [(80, 80, 0), (76, 80, 0), (80, 84, 0), (75, 79, 1), (81, 90, 1)])
def test_the_frames_to_keep_are_meant_with_both_ends(first: int, last: int, cut: int) -> None:
    markers = damaged()
    kept = clean(markers, CleanSettings(keep=((3, first, last),), fill_gaps=False))
    assert int(kept.outliers.mask(markers.present.shape)[80, 3]) == cut
    assert not clean(markers, CleanSettings(keep=((2, 80, 80),))).outliers.mask(markers.present.shape)[80, 2]
    assert clean(markers, CleanSettings(keep=((2, 80, 80),))).outliers.mask(markers.present.shape)[80, 3]


def test_what_was_done_and_what_was_left_is_counted() -> None:
    lost = lose(damaged().positions, (5, 0, 239), (0, 10, 19), (4, 100, 239))
    cleaned = clean(of(lost), CleanSettings(fill=FillSettings(method="rigid", max_gap=1.0)))
    assert cleaned.notes[0] == "1 samples of 1 markers were cut as outliers."
    counts = [fill.length for fill in cleaned.fills]
    assert sorted(counts) == [1, 2, 10, 31]
    assert cleaned.notes[1].startswith("4 gaps (44 samples) were filled; expected error ")
    mean = sum(fill.error * fill.length for fill in cleaned.fills) / 44
    assert cleaned.notes[1].endswith(f" {1000 * mean:.1f} mm.")
    assert cleaned.notes[2] == "1 gaps (140 samples) are left as they were."
    assert cleaned.notes[3] == "2 markers were never seen and stay lost."


def test_a_recording_without_any_sample_is_refused() -> None:
    with pytest.raises(InputError, match="every sample is lost"):
        clean(of(np.full((10, 3, 3), np.nan)))


def test_a_result_goes_through_the_store_whole() -> None:
    cleaned = clean(damaged())
    back = decode(*encode(cleaned), Cleaned)
    assert back.fills == cleaned.fills
    assert np.array_equal(put_back(back).positions, put_back(cleaned).positions, equal_nan=True)


def crossing() -> Markers:
    """Two markers that come near each other."""
    time = np.arange(120) / RATE
    one = np.stack([time, 0.02 + 0 * time, 1 + 0 * time], axis=1)
    other = np.stack([2 - time, -0.02 + 0 * time, 1 + 0 * time], axis=1)
    still = np.array([[0.0, 1, 1], [0.3, 1, 1]])
    return of(np.concatenate([one[:, None], other[:, None], np.broadcast_to(still, (120, 2, 3))], axis=1))


def test_nothing_is_proposed_for_tracks_that_are_right() -> None:
    assert find_proposals(crossing()) == ()
    assert find_proposals(of(rigid())) == ()
    assert find_proposals(of(lose(rigid(), (2, 40, 49), (3, 45, 60)))) == ()


@pytest.mark.parametrize("lost", [0, 6])
def test_an_exchange_is_found_and_mended_only_when_applied(lost: int) -> None:
    markers = crossing()
    wrong = markers.positions.copy()
    wrong[40:, [0, 1]] = wrong[40:, [1, 0]]
    wrong[40 - lost : 40, :2] = np.nan
    given = replace(markers, positions=wrong)
    (edit,) = find_proposals(given)
    assert (edit.kind, edit.frame, edit.last, edit.markers) == ("swap", 40, 119, (0, 1))
    assert edit.evidence > 0.5
    assert "m0 and m1 look exchanged from 2.667 s on" in edit.sentence
    cleaned = clean(given, CleanSettings(OutlierSettings(method="none"), fill_gaps=False))
    assert cleaned.proposals == (edit,)
    assert np.array_equal(cleaned.markers.positions, wrong, equal_nan=True), "nothing is mended on its own"
    mended = apply_proposals(given, cleaned.proposals)
    right = markers.positions.copy()
    right[40 - lost : 40, :2] = np.nan
    assert np.array_equal(mended.positions, right, equal_nan=True)
    assert np.array_equal(apply_proposals(mended, [edit]).positions, wrong, equal_nan=True)


def test_a_track_that_broke_in_three_is_joined() -> None:
    truth = crossing()
    pieces = np.full((120, 6, 3), np.nan)
    pieces[:, :4] = truth.positions
    pieces[50:, 0] = np.nan
    pieces[53:80, 4] = truth.positions[53:80, 0]
    pieces[82:, 5] = truth.positions[82:, 0]
    given = of(pieces)
    edits = find_proposals(given)
    assert [(e.kind, e.frame, e.last, e.markers) for e in edits] == [
        ("join", 53, 79, (0, 4)),
        ("join", 82, 119, (0, 5)),
    ]
    mended = apply_proposals(given, edits)
    assert np.isnan(mended.positions[:, 4:]).all()
    expected = truth.positions[:, 0].copy()
    expected[[50, 51, 52, 80, 81]] = np.nan
    assert np.array_equal(mended.positions[:, 0], expected, equal_nan=True)


def test_edits_by_hand_are_made_before_the_cleaning_and_unknown_markers_refused() -> None:
    truth = crossing()
    given = apply_proposals(truth, [Proposal("swap", 40, 119, (0, 1), 0.0, "")])
    cleaned = clean_markers(CleaningSettings(swaps=((0, 1, 40),)), silent, markers=given)
    assert np.array_equal(cleaned.measured.positions, truth.positions)
    assert not cleaned.proposals
    with pytest.raises(InputError, match="there is no marker 9"):
        clean_markers(CleaningSettings(keep=((9, 0, 1),)), silent, markers=given)


def test_a_join_that_is_accepted_in_a_session_is_filled_well() -> None:
    """A track that broke and went on in another column cannot be filled before it is joined, and can after."""
    truth = rigid()
    pieces = np.concatenate([truth, np.full((len(truth), 1, 3), np.nan)], axis=1)
    pieces[110:, 8], pieces[100:, 2] = truth[110:, 2], np.nan
    given = of(pieces)
    fill = CleaningSettings(fill="regression", max_gap=0.5)
    before = clean_markers(fill, silent, markers=given)
    assert np.isnan(before.markers.positions[100:, 2]).all(), "half a trial is no gap to be filled"
    (edit,) = before.proposals
    joined = replace(fill, joins=((*edit.markers, edit.frame, edit.last),))
    after = clean_markers(joined, silent, markers=given)
    assert [(f.marker, f.first, f.last) for f in after.fills] == [(2, 100, 109)]
    off = np.linalg.norm(after.markers.positions[:, :8] - truth, axis=2).max()
    assert off < 1e-6, f"{1e3 * off:.4f} mm"
    assert np.isnan(after.markers.positions[:, 8]).all()
    assert not after.proposals


def test_a_marker_that_is_another_after_the_gap_is_not_filled() -> None:
    """The column goes on with another place on the body: whatever is put between the two is wrong."""
    truth = rigid()
    given = lose(truth, (2, 100, 109))
    given[110:, 2] = truth[110:, 2] + truth[110:, 5] - truth[110:, 0]
    fills = clean(of(given), CleanSettings(OutlierSettings(method="none"))).fills
    assert (2, 100, 109) not in {(f.marker, f.first, f.last) for f in fills}, fills


def test_what_the_stage_fills_counts_as_measured_nowhere() -> None:
    markers = damaged()
    cleaned = clean_markers(CleaningSettings(fill="regression"), silent, markers=markers)
    assert np.isfinite(cleaned.markers.positions[30:61, 1]).all()
    seen = cleaned.measured.present
    assert not seen[30:61, 1].any()
    assert not seen[80, 3]
    assert (seen | ~markers.present | cleaned.outliers.mask(seen.shape)).all()
    assert np.array_equal(cleaned.filled, cleaned.markers.present & ~seen)
    assert cleaned.filled.sum() == sum(fill.length for fill in cleaned.fills)


def test_what_the_file_had_as_filled_is_not_taken_out_with_what_was_filled_here() -> None:
    already = np.zeros(damaged().present.shape, dtype=bool)
    already[5, 2] = True
    cleaned = clean(replace(damaged(), filled=already))
    measured = cleaned.measured
    assert cleaned.filled[30, 1] and not cleaned.filled[5, 2]
    assert measured.filled is not None and measured.filled[5, 2] and measured.filled.sum() == 1
    assert measured.present[5, 2] and not measured.present[30, 1]
