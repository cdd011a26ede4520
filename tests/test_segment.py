"""Grouping markers by rigidity: known bodies recovered, numbers compared with plain loops and other libraries."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from markerscope.solver.clustering.affinity import affinity, bridged
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings, regroup, segment
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers

SIZES = (4, 3, 5, 6)


def rigid_bodies(seed: int = 0, noise: float = 0.001, frames: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """(T, M, 3) m and the body (M,) of each marker: four bodies turning each in its own way, 0.3 m apart."""
    rng = np.random.default_rng(seed)
    tracks, owner = [], []
    time = np.linspace(0, 10, frames)
    for body, size in enumerate(SIZES):
        local = rng.uniform(-0.1, 0.1, (size, 3))
        turn = Rotation.from_rotvec(np.sin(time[:, None] * rng.uniform(0.5, 2, 3) + rng.uniform(0, 6, 3)))
        centre = np.array([0.3 * body, 0, 1.0]) + 0.1 * np.sin(time[:, None] * rng.uniform(0.5, 2, 3))
        tracks.append(turn.as_matrix()[:, None] @ local[None, :, :, None])
        tracks[-1] = tracks[-1][..., 0] + centre[:, None]
        owner += [body] * size
    positions = np.concatenate(tracks, axis=1)
    return positions + rng.normal(0, noise, positions.shape), np.array(owner)


def with_gaps(positions: np.ndarray, seed: int, share: float) -> np.ndarray:
    gone = np.random.default_rng(seed).uniform(size=positions.shape[:2]) < share
    return np.where(gone[..., None], np.nan, positions)


def markers(positions: np.ndarray) -> Markers:
    return Markers(positions, 100.0, tuple(f"M{i}" for i in range(positions.shape[1])))


def same_partition(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(((a[:, None] == a) == (b[:, None] == b)).all())


def brute_force(positions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    count = positions.shape[1]
    deviation, mean, overlap = (np.full((count, count), np.nan) for _ in range(3))
    for i in range(count):
        for j in range(count):
            apart = [np.sqrt(((p[i] - p[j]) ** 2).sum()) for p in positions]
            apart = [d for d in apart if np.isfinite(d)]
            overlap[i, j] = len(apart)
            if apart:
                deviation[i, j], mean[i, j] = np.std(apart), np.mean(apart)
    return deviation, mean, overlap


# affinity -------------------------------------------------------------------------------------------------------------
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 30), st.integers(1, 7), st.floats(0, 0.9))
def test_affinity_is_what_plain_loops_give(seed: int, frames: int, count: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    positions = with_gaps(rng.uniform(-2, 2, (frames, count, 3)) + np.array([10, -5, 1]), seed, share)
    found = affinity(positions)
    deviation, mean, overlap = brute_force(positions)
    np.testing.assert_array_equal(found.overlap, overlap)
    np.testing.assert_allclose(found.deviation, deviation, atol=1e-7)
    np.testing.assert_allclose(found.distance, mean, atol=1e-9)


def test_rigid_pairs_have_no_deviation_far_from_the_origin() -> None:
    positions, owner = rigid_bodies(noise=0.0)
    found = affinity(positions + np.array([50.0, 20.0, 0.0]))
    worst = found.deviation[owner[:, None] == owner].max()
    assert worst < 1e-7, f"{worst} m between markers of one rigid body"


def test_chunks_do_not_change_the_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    positions = with_gaps(rigid_bodies()[0], 1, 0.3)
    whole = affinity(positions)
    monkeypatch.setattr("markerscope.solver.clustering.affinity._CHUNK_BYTES", 8 * positions.shape[1] ** 2 * 7)
    pieces = affinity(positions)
    np.testing.assert_allclose(whole.deviation, pieces.deviation, atol=1e-12)
    np.testing.assert_allclose(whole.distance, pieces.distance, atol=1e-12)


def test_a_long_recording_is_sampled_evenly() -> None:
    positions, _ = rigid_bodies(frames=2000)
    found = affinity(positions, max_frames=200)
    assert found.frames == 200
    assert np.abs(found.deviation - affinity(positions).deviation).max() < 0.004


def test_an_hour_of_100_markers_fits_in_memory() -> None:
    import tracemalloc

    positions = np.broadcast_to(rigid_bodies(frames=1)[0][:, :1], (60_000, 100, 3))
    tracemalloc.start()
    found = affinity(positions, max_frames=1000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.frames == 1000
    assert peak < 300e6, f"{peak / 1e6:.0f} MB"


def test_a_bridge_is_as_bad_as_its_worst_step() -> None:
    deviation = np.array([[0, 1, 9, 4], [1, 0, 2, 9], [9, 2, 0, 9], [4, 9, 9, 0.0]])
    measured = np.ones((4, 4), bool)
    measured[0, 2] = measured[2, 0] = False
    measured[3, 1:3] = measured[1:3, 3] = False
    found = bridged(deviation, measured)
    assert found[0, 2] == 2 and found[3, 2] == 4 and found[0, 1] == 1
    alone = bridged(deviation, np.eye(4, dtype=bool))
    assert np.isnan(alone[0, 1]) and alone[0, 0] == 0


# groups ---------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_known_rigid_bodies_are_recovered(seed: int, share: float) -> None:
    positions, owner = rigid_bodies(seed)
    shuffle = np.random.default_rng(seed).permutation(len(owner))
    found = segment(markers(with_gaps(positions[:, shuffle], seed, share)))
    assert same_partition(found.clusters, owner[shuffle]), f"{found.clusters} for {owner[shuffle]}"
    assert found.count == len(SIZES)


def test_the_pieces_of_a_broken_track_stay_together() -> None:
    positions, owner = rigid_bodies()
    early, late = positions.copy(), positions[:, [0, 5]].copy()
    early[120:, [0, 5]] = np.nan
    late[:120] = np.nan
    found = segment(markers(np.concatenate([early, late], axis=1)))
    assert same_partition(found.clusters, np.append(owner, owner[[0, 5]]))
    assert not found.measured[0, len(owner)] and found.overlap[0, len(owner)] == 0


def test_two_halves_without_a_common_marker_are_not_joined() -> None:
    positions, owner = rigid_bodies(noise=0.0)
    positions[:100, :7] = np.nan
    positions[100:, 7:] = np.nan
    found = segment(markers(positions))
    assert same_partition(found.clusters, owner)
    assert np.isnan(found.affinity[0, 10])


@pytest.mark.parametrize(("together", "measured"), [(9, False), (10, True), (15, True)])
def test_a_pair_is_measured_where_ten_compared_frames_show_both(together: int, measured: bool) -> None:
    """Few frames show any two markers as rigid; then the way over the others counts."""
    positions, owner = rigid_bodies(frames=120)
    positions[: 60 - together // 2, 0] = np.nan
    positions[60 + together - together // 2 :, 4] = np.nan  # of the next body
    found = segment(markers(positions))
    assert found.overlap[0, 4] == together
    assert found.measured[0, 4] == measured
    if not measured:
        assert found.affinity[0, 4] >= np.sort(found.affinity[0, owner == 1])[0] - 1e-12
        assert found.affinity[0, 4] != affinity(positions).deviation[0, 4]
    short = segment(markers(positions[60 - together // 2 : 64 - together // 2]))
    assert short.measured[0, 4], "a recording of four frames has no more of them"


def test_a_marker_that_is_never_seen_belongs_to_no_group() -> None:
    positions, owner = rigid_bodies()
    positions[:, 2] = np.nan
    found = segment(markers(positions))
    assert found.clusters[2] == -1 and 2 not in found.order
    seen = np.arange(len(owner)) != 2
    assert same_partition(found.clusters[seen], owner[seen])


@pytest.mark.parametrize("count", [1, 2])
def test_very_few_markers(count: int) -> None:
    found = segment(markers(rigid_bodies()[0][:, :count]))
    assert found.clusters.tolist() == [0] * count and len(found.linkage) == count - 1


def test_nothing_seen_is_said() -> None:
    with pytest.raises(InputError, match="no marker is seen"):
        segment(markers(np.full((5, 3, 3), np.nan)))


@pytest.mark.parametrize("groups", [1, 2, 4, 9, 18, 40])
def test_a_number_of_groups(groups: int) -> None:
    found = segment(markers(rigid_bodies()[0]), SegmentSettings(groups=groups))
    assert found.count == min(groups, sum(SIZES))


def test_the_tree_is_that_of_scikit_learn() -> None:
    cluster = pytest.importorskip("sklearn.cluster")
    positions = with_gaps(rigid_bodies(3, noise=0.004)[0], 3, 0.2)
    for far in (0.0, 0.35):
        for threshold in (0.004, 0.006, 0.02, 0.05):
            found = segment(markers(positions), SegmentSettings(threshold=threshold, far=far))
            matrix = found.affinity + (0.1 * np.maximum(found.distance - far, 0) if far else 0)
            other = cluster.AgglomerativeClustering(
                None, metric="precomputed", linkage="average", distance_threshold=threshold
            )
            expected = other.fit_predict(matrix)
            assert same_partition(found.clusters, expected), f"far {far}, threshold {threshold}"
            heights = cluster.AgglomerativeClustering(
                None, metric="precomputed", linkage="average", distance_threshold=0
            )
            np.testing.assert_allclose(found.linkage[:, 2], heights.fit(matrix).distances_, atol=1e-12)


def test_groups_are_numbered_as_the_tree_is_drawn() -> None:
    found = segment(markers(rigid_bodies()[0]))
    along = found.clusters[found.order]
    assert (np.diff(along) >= 0).all() and along[0] == 0
    assert sorted(found.order) == list(range(sum(SIZES)))


# edits ----------------------------------------------------------------------------------------------------------------
def edit(**changes: tuple) -> tuple[Segmentation, Segmentation]:
    positions = markers(rigid_bodies()[0])
    return segment(positions), segment(positions, replace(SegmentSettings(), **changes))


def test_merging_two_groups() -> None:
    plain, found = edit(merges=((0, 5),))
    assert found.count == plain.count - 1
    expected = np.where(plain.clusters == plain.clusters[5], plain.clusters[0], plain.clusters)
    assert same_partition(found.clusters, expected)


def test_splitting_markers_off() -> None:
    plain, found = edit(splits=((0, 1),))
    expected = plain.clusters.copy()
    expected[:2] = 99
    assert same_partition(found.clusters, expected)


def test_moving_a_marker() -> None:
    plain, found = edit(moves=((0, 10),))
    expected = plain.clusters.copy()
    expected[0] = expected[10]
    assert same_partition(found.clusters, expected)


def test_leaving_markers_out() -> None:
    _, found = edit(left_out=(0, 1, 2, 3))
    assert (found.clusters[:4] == -1).all() and found.count == len(SIZES) - 1
    assert set(found.clusters[4:]) == set(range(len(SIZES) - 1))


def test_edits_leave_the_tree_alone() -> None:
    plain, found = edit(left_out=(0,), merges=((4, 8),), splits=((9, 10),), moves=((5, 12),))
    np.testing.assert_array_equal(plain.linkage, found.linkage)
    np.testing.assert_array_equal(plain.affinity, found.affinity)


@pytest.mark.parametrize(
    "changes",
    [
        {"threshold": -1.0},
        {"threshold": float("nan")},
        {"groups": 0},
        {"max_frames": 1},
        {"merges": ((0, 99),)},
        {"splits": ((-1,),)},
        {"moves": ((0, 18),)},
        {"left_out": (50,)},
    ],
)
def test_impossible_settings_name_the_setting(changes: dict) -> None:
    with pytest.raises(InputError, match=r"segment\." + next(iter(changes))):
        segment(markers(rigid_bodies()[0]), replace(SegmentSettings(), **changes))


# real markers ---------------------------------------------------------------------------------------------------------
ONE_BONE = {
    "knee": "thigh",
    "ankle": "shank",
    "elbow": "upper_arm",
    "wrist": "forearm",
}


def squat(shared_data: Path) -> tuple[Markers, list[str]]:
    """The squat's 47 physical markers and the bone of each, joints counted to the segment above."""
    lines = (shared_data / "squat_video" / "squats1.trc").read_text().splitlines()
    labels = [x for x in lines[3].split("\t")[2:] if x.strip()]
    rows = [line.split("\t")[2 : 2 + 3 * len(labels)] for line in lines[5:] if line.strip()]
    positions = np.array([[float(x) if x.strip() else np.nan for x in row] for row in rows]).reshape(len(rows), -1, 3)
    table = tomllib.loads((shared_data / "segments_squat.toml").read_text())
    del table["joints"]
    owner = {marker: name for name, members in table.items() for marker in members}
    keep = [i for i, name in enumerate(labels) if name in owner]
    bones = []
    for i in keep:
        side, _, part = owner[labels[i]].partition("_")
        bones.append("upper_trunk" if part == "shoulder" else f"{side}_{ONE_BONE.get(part, part)}")
    return markers(positions[:, keep]), bones


@pytest.mark.parametrize(("far", "least"), [(0.0, 0.68), (0.35, 0.77)])
def test_real_markers_fall_into_their_bones(shared_data: Path, far: float, least: float) -> None:
    metrics = pytest.importorskip("sklearn.metrics")
    recording, bones = squat(shared_data)
    assert len(bones) == 47 and len(set(bones)) == 12
    found = segment(recording, SegmentSettings(far=far))
    score = metrics.adjusted_rand_score(bones, found.clusters)
    assert score > least, f"adjusted Rand index {score:.3f} with {found.count} groups"
    feet = [i for i, bone in enumerate(bones) if bone.endswith("foot")]
    apart = len({(bones[i], found.clusters[i]) for i in feet}) == len({found.clusters[i] for i in feet})
    assert apart == (far > 0), "planted feet are told apart by the distance between them alone"


@given(st.floats(0.0, 0.05), st.one_of(st.none(), st.integers(1, 12)), st.lists(st.integers(0, 9), max_size=4))
def test_cutting_a_tree_anew_finds_what_grouping_anew_does(threshold, groups, chosen) -> None:
    rng = np.random.default_rng(3)
    positions = rng.normal(size=(60, 1, 3)) + 0.3 * rng.normal(size=(1, 10, 3)) + 0.01 * rng.normal(size=(60, 10, 3))
    positions[:, 4] = np.nan
    markers = Markers(positions, 100.0, tuple("abcdefghij"))
    first = segment(markers)
    again = SegmentSettings(
        threshold=threshold, groups=groups, merges=(tuple(chosen),), splits=((0, 1),), left_out=tuple(chosen[:1])
    )
    anew, cut = segment(markers, again), regroup(first, again)
    assert np.array_equal(anew.clusters, cut.clusters)
    assert anew.cut == cut.cut
