"""The offset between a video's clock and the markers', from motion seen by both."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.sync.offset import Sync, find_offset, lead

OFFSET = 1.234  # s


def dancer(seed: int, still: float = 1.0):
    """Paths of 12 joints (callable of time, (T,) -> (T, 12, 3) m): five smooth signals, mixed, never repeating."""
    rng = np.random.default_rng(seed)
    frequency = rng.uniform(0.2, 3.0, (5, 8))
    size, phase = rng.normal(size=(5, 8)) / frequency, rng.uniform(0, 2 * np.pi, (5, 8))
    mixing = still * 0.04 * rng.normal(size=(5, 12, 3))
    home = rng.normal(0, 0.4, (12, 3)) + np.array([0, 0, 1])

    def path(time: np.ndarray) -> np.ndarray:
        signals = (size * np.sin(2 * np.pi * frequency * time[:, None, None] + phase)).sum(axis=2)
        return home + np.tensordot(signals, mixing, axes=1)

    return path


def filmed(path, time: np.ndarray, seed: int, noise: float = 4.0) -> Landmarks:
    """Landmarks of the joints by a pitched camera 4 m away, with the trembling of a pose network."""
    rng = np.random.default_rng(seed)
    yaw, pitch = rng.uniform(0, 6.28), 0.2
    turn = np.array([[-np.sin(yaw), np.cos(yaw), 0], [0, 0, -1], [np.cos(yaw), np.sin(yaw), 0]])
    tilt = np.array([[1, 0, 0], [0, np.cos(pitch), -np.sin(pitch)], [0, np.sin(pitch), np.cos(pitch)]])
    points = (path(time) - [0, 0, 1]) @ (tilt @ turn).T + [0, 0, 4]
    image = 900 * points[..., :2] / points[..., 2:] + [360, 640]
    image = image[:, np.arange(33) % 12] + rng.normal(0, noise, (len(time), 33, 2))
    count = len(time)
    clock = time - time[0]
    return Landmarks(
        image,
        np.zeros((count, 33, 3)),
        np.full((count, 33), 0.9),
        np.ones(count, dtype=bool),
        clock,
        np.arange(count),
        (720, 1280),
    )


def captured(path, time: np.ndarray, seed: int, chosen=range(12), rate: float = 100.0) -> Markers:
    """Three markers about each chosen joint."""
    rng = np.random.default_rng(seed)
    joints = np.repeat(path(time)[:, list(chosen)], 3, axis=1)
    positions = joints + rng.normal(0, 0.08, joints.shape[1:]) + rng.normal(0, 0.0005, joints.shape)
    return Markers(positions, rate, tuple(f"M{i}" for i in range(positions.shape[1])))


@pytest.mark.parametrize("chosen", [range(12), range(3)], ids=["whole", "limb"])
@pytest.mark.parametrize("seed", range(4))
def test_the_offset_comes_back(seed: int, chosen) -> None:
    path = dancer(seed)
    video = filmed(path, OFFSET + np.arange(0, 8, 1 / 30), seed)
    found = find_offset(video, captured(path, np.arange(0, 10, 0.01), seed, chosen))
    error = abs(found.offset - OFFSET)
    assert error < 0.01, f"{error:.4f} s off"
    assert found.confidence > 0.9 and found.rate_ratio == 1.0 and not found.notes
    np.testing.assert_allclose(found.marker_time(np.array([2.0])), 2.0 + OFFSET, atol=0.01)


def test_the_markers_clock_counts_from_its_first_time() -> None:
    path = dancer(5)
    markers = replace(captured(path, np.arange(0, 9, 0.01), 5), first_time=100.0)
    found = find_offset(filmed(path, OFFSET + np.arange(0, 7, 1 / 30), 5), markers)
    assert abs(found.offset - OFFSET - 100) < 0.01


def test_a_video_longer_than_the_markers_and_a_partial_overlap() -> None:
    path = dancer(6)
    inside = find_offset(filmed(path, np.arange(0, 20, 1 / 30), 6), captured(path, np.arange(7, 13, 0.01), 6))
    assert abs(inside.offset + 7) < 0.01 and inside.confidence > 0.9
    beside = find_offset(filmed(path, np.arange(0, 8, 1 / 30), 6), captured(path, np.arange(1.7, 9.7, 0.01), 6))
    assert abs(beside.offset + 1.7) < 0.01 and beside.confidence > 0.9


def test_gaps_untracked_frames_and_a_variable_rate() -> None:
    rng = np.random.default_rng(7)
    path = dancer(7)
    time = OFFSET + np.cumsum(rng.uniform(0.025, 0.045, 230))
    video = filmed(path, time, 7)
    tracked = np.ones(len(time), dtype=bool)
    tracked[60:90] = False
    video = replace(video, tracked=tracked, image=np.where(tracked[:, None, None], video.image, np.nan))
    markers = captured(path, np.arange(0, 10, 0.01), 7)
    positions = markers.positions.copy()
    for m in range(positions.shape[1]):
        for start in rng.integers(0, 1000, 3):
            positions[start : start + rng.integers(5, 150), m] = np.nan
    positions[:, 0] = np.nan
    positions[500, 1] += 3.0  # a wrong sample
    found = find_offset(video, replace(markers, positions=positions))
    assert abs(found.offset - time[0]) < 0.015, f"{found.offset - time[0]:+.4f} s off"
    assert found.confidence > 0.9


@pytest.mark.parametrize("seed", range(5))
def test_other_motion_or_none_gives_no_confidence(seed: int) -> None:
    path = dancer(seed)
    other = dancer(seed + 50)
    video = filmed(path, np.arange(0, 8, 1 / 30), seed)
    mistaken = find_offset(video, captured(other, np.arange(0, 8, 0.01), seed))
    assert mistaken.confidence < 0.5 and "give the offset" in mistaken.notes[0]
    still = dancer(seed, still=0.0)
    motionless = find_offset(filmed(still, np.arange(0, 8, 1 / 30), seed), captured(still, np.arange(0, 8, 0.01), seed))
    assert motionless.confidence < 0.5


@pytest.mark.parametrize("seed", range(3))
def test_a_purely_periodic_motion_is_ambiguous_by_whole_cycles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size, phase = rng.normal(size=(2, 6)), rng.uniform(0, 6.28, (2, 6))
    mixing, home = 0.05 * rng.normal(size=(2, 12, 3)), rng.normal(0, 0.4, (12, 3)) + np.array([0, 0, 1])

    def path(time: np.ndarray) -> np.ndarray:
        signals = size * np.sin(2 * np.pi / 0.8 * np.arange(1, 7) * time[:, None, None] + phase)
        return home + np.tensordot(signals.sum(axis=2), mixing, axes=1)

    video = filmed(path, np.arange(0.5, 8.5, 1 / 30), seed)
    found = find_offset(video, captured(path, np.arange(0, 10, 0.01), seed))
    cycles = (found.offset - 0.5) / 0.8
    assert abs(cycles - round(cycles)) < 0.02, f"{found.offset:.3f} s"
    assert found.confidence < 0.5, f"{found.confidence:.2f} for one of many equal cycles"


@pytest.mark.parametrize("ratio", [30 / 29.97, 29.97 / 30])
def test_a_clock_at_2997_is_found_in_a_long_recording(ratio: float) -> None:
    path = dancer(8)
    time = OFFSET + ratio * np.arange(0, 120, 1 / 30)
    video = filmed(path, time, 8)
    video = replace(video, time=np.arange(len(time)) / 30)
    found = find_offset(video, captured(path, np.arange(0, 122, 0.02), 8, rate=50.0))
    assert found.rate_ratio == pytest.approx(ratio, abs=1e-9)
    assert abs(found.offset - OFFSET) < 0.01


def test_a_given_range_is_kept_and_one_without_overlap_is_refused() -> None:
    path = dancer(9)
    video = filmed(path, OFFSET + np.arange(0, 8, 1 / 30), 9)
    markers = captured(path, np.arange(0, 10, 0.01), 9)
    found = find_offset(video, markers, search=(1.0, 1.5))
    assert abs(found.offset - OFFSET) < 0.01 and found.lags[0] == 1.0 and found.lags[-1] <= 1.5 + 1e-9
    with pytest.raises(InputError, match="share less than"):
        find_offset(video, markers, search=(20.0, 22.0))


def test_a_trial_too_short_for_a_rival_claims_none() -> None:
    """No other offset can be judged in 1.25 s: none is named, least of all one at the end of the range searched."""
    path = dancer(9)
    found = find_offset(filmed(path, np.arange(0, 1.25, 1 / 30), 9), captured(path, np.arange(0, 1.25, 0.01), 9))
    assert np.abs(found.lags).max() <= 0.3, "further apart they share less than a second"
    assert found.confidence <= 0.2
    (note,) = found.notes
    assert "too short (1.2" in note and "-2.00" not in note and "hardly better" not in note


@pytest.mark.parametrize("short", ["video", "markers"])
def test_a_trial_under_a_second_is_refused_with_what_can_be_done(short: str) -> None:
    path = dancer(9)
    lasts = {"video": 8.0, "markers": 8.0, short: 0.85}
    video = filmed(path, np.arange(0, lasts["video"], 1 / 30), 9)
    markers = captured(path, np.arange(0, lasts["markers"], 0.01), 9)
    with pytest.raises(InputError, match=rf"the {short} lasts? 0.8\d? s, and 1 s of movement") as refused:
        find_offset(video, markers)
    assert "--offset" in str(refused.value) and "range" not in str(refused.value)


def test_the_lead_is_that_over_every_offset_outside_the_peak() -> None:
    lags = np.arange(-1, 1.01, 0.05)
    score = np.where(np.abs(lags) < 0.2, 30.0, 10.0)
    score[2] = 27.0
    assert lead(Sync(0.0, 1.0, 0.2, lags, score)) == pytest.approx(3.0)
    assert lead(Sync(0.0, 1.0, 1.0, lags[:1], np.array([np.nan]))) == np.inf


def test_too_little_to_compare_is_refused() -> None:
    path = dancer(9)
    video = filmed(path, np.arange(0, 8, 1 / 30), 9)
    markers = captured(path, np.arange(0, 10, 0.01), 9)
    nobody = replace(video, tracked=np.zeros(len(video.time), dtype=bool))
    for bad_video, bad_markers in (
        (nobody, markers),
        (video, replace(markers, positions=markers.positions[:1])),
        (video, replace(markers, positions=np.full_like(markers.positions, np.nan))),
    ):
        with pytest.raises(InputError):
            find_offset(bad_video, bad_markers)


@pytest.mark.parametrize(("only", "limit"), [(None, 0.012), ("left_leg", 0.03), ("right_arm", 0.02)])
def test_the_real_squat(shared_data: Path, squat_landmarks: Landmarks, only: str | None, limit: float) -> None:
    sys.path.insert(0, str(shared_data.parent / "checks"))
    try:
        judge = pytest.importorskip("real_squat")
    finally:
        sys.path.pop(0)
    labels, rate, positions = judge.read_trc(judge.TRIAL / "squats1.trc")
    segment_of, _ = judge.segments()
    keep = [i for i, n in enumerate(labels) if n not in judge.COMPUTED]
    if only:
        keep = [i for i in keep if segment_of[labels[i]] in judge.PARTS[only]]
    found = find_offset(squat_landmarks, Markers(positions[:, keep], rate, tuple(str(i) for i in keep)))
    error = abs(found.offset + 0.010)
    assert error < limit, f"{error:.4f} s off"
    assert found.confidence > 0.9


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("shift", [0.0, 0.0025, 0.005, 0.0075])
def test_the_offset_is_found_between_the_steps_of_the_search(seed: int, shift: float) -> None:
    """Steps are 10 ms apart; what is left of a clean recording's error is a fraction of one."""
    path = dancer(seed + 20)
    offset = OFFSET + shift
    video = filmed(path, offset + np.arange(0, 8, 1 / 30), seed, noise=0.5)
    found = find_offset(video, captured(path, np.arange(0, 10, 0.01), seed))
    assert abs(found.offset - offset) < 0.0015, f"{1e3 * (found.offset - offset):+.2f} ms off"


@pytest.mark.parametrize("seed", range(3))
def test_a_movement_that_is_done_twice_alike_fits_at_both_times(seed: int) -> None:
    """Nothing else is as good, the video played backwards least of all; but which of the two it was, nobody knows."""
    once = dancer(seed + 30)
    twice = lambda time: once(np.mod(time, 6.0))  # noqa: E731
    video = filmed(twice, np.arange(1.0, 5.0, 1 / 30), seed)
    found = find_offset(video, captured(twice, np.arange(0, 12, 0.01), seed))
    assert min(abs(found.offset - 1.0), abs(found.offset - 7.0)) < 0.02
    assert found.margin < 3
    assert found.confidence < 0.2
    assert "give the offset" in found.notes[0]
    rival = 1.0 if found.offset > 4 else 7.0
    said = float(found.notes[0].split("hardly better than ")[1].split(" s;")[0])
    assert said == pytest.approx(rival, abs=0.06)


def test_recordings_of_other_movements_are_hardly_ever_believed() -> None:
    """Short ones fit somewhere by chance, and the video played backwards fits as well somewhere."""
    stated = []
    for seed in range(12):
        video = filmed(dancer(seed), np.arange(0, 4, 1 / 30), seed)
        stated.append(find_offset(video, captured(dancer(seed + 70), np.arange(0, 4, 0.01), seed)).confidence)
    assert np.mean(stated) < 0.15, np.round(stated, 2)
    assert max(stated) < 0.6, np.round(stated, 2)


def test_offsets_are_judged_where_a_second_or_more_is_shared() -> None:
    path = dancer(11)
    video = filmed(path, OFFSET + np.arange(0, 8, 1 / 30), 11)
    markers = captured(path, np.arange(0, 10, 0.01), 11)
    found = find_offset(video, markers, search=(-8.5, 10.5))
    shared = np.minimum(found.lags + video.time[-1], markers.time[-1]) - np.maximum(found.lags, 0.0)
    judged = np.isfinite(found.score)
    assert judged[shared > 1.07].all()
    assert not judged[shared < 0.93].any()
    assert abs(found.offset - OFFSET) < 0.01
