"""Cutting anew is what a run with that threshold would give, whatever was edited by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from markerscope.app.views.affinity import affinity_picture, cut_for, pair_distance, recut
from markerscope.solver.clustering.segment import SegmentSettings, segment
from markerscope.solver.core.markers import Markers

COUNT = 12


@pytest.fixture(scope="module")
def markers() -> Markers:
    """Markers on three loose bodies, the last one never seen."""
    rng = np.random.default_rng(3)
    base = rng.normal(0, 0.3, (1, COUNT + 1, 3)) + 0.05 * rng.normal(0, 1, (60, 3, 3))[:, np.arange(COUNT + 1) % 3]
    positions = base + 0.004 * rng.normal(0, 1, base.shape)
    positions[rng.random(positions.shape[:2]) < 0.1] = np.nan
    positions[:, COUNT] = np.nan
    return Markers(positions, 100.0, tuple(f"m{i}" for i in range(COUNT + 1)))


index = st.integers(0, COUNT - 1)
edits = st.builds(
    SegmentSettings,
    groups=st.none() | st.integers(1, 5),
    merges=st.lists(st.lists(index, min_size=2, max_size=3, unique=True).map(tuple), max_size=2).map(tuple),
    splits=st.lists(st.lists(index, min_size=1, max_size=3, unique=True).map(tuple), max_size=2).map(tuple),
    moves=st.lists(st.tuples(index, index), max_size=2).map(tuple),
    left_out=st.lists(index, max_size=2, unique=True).map(tuple),
)


@given(made_with=edits, height=st.floats(1e-4, 0.3))
@settings(max_examples=60)
def test_dragging_gives_what_running_would(markers: Markers, made_with: SegmentSettings, height: float) -> None:
    found = segment(markers, made_with)
    wanted = segment(markers, replace(made_with, threshold=height, groups=None))
    cut = recut(found, made_with, height)
    assert np.array_equal(cut.clusters, wanted.clusters)
    assert cut.count == wanted.count
    assert cut.height == height


@given(groups=st.integers(1, COUNT))
@settings(max_examples=20)
def test_the_height_for_a_number_of_groups_gives_that_number(markers: Markers, groups: int) -> None:
    plain = SegmentSettings()
    found = segment(markers, plain)
    assert recut(found, plain, cut_for(found, groups)).count == groups
    wanted = segment(markers, replace(plain, groups=groups))
    assert np.array_equal(recut(found, plain, cut_for(found, groups)).clusters, wanted.clusters)


def test_a_single_marker_can_be_cut(markers: Markers) -> None:
    alone = markers.select(markers=np.array([2]))
    found = segment(alone)
    assert recut(found, SegmentSettings(), 0.1).clusters.tolist() == [0]
    assert cut_for(found, 1) > 0


def test_the_picture_names_every_leaf_and_colours_every_marker(markers: Markers) -> None:
    found = segment(markers)
    shown = affinity_picture(found, markers.labels)
    assert sorted(shown.order) == sorted(shown.leaves) == list(range(COUNT))
    assert shown.marker_colours.shape == (COUNT + 1, 3)
    same = found.clusters[:, None] == found.clusters
    alike = (shown.marker_colours[:, None] == shown.marker_colours).all(axis=2)
    assert np.array_equal(same, alike)


def test_a_pair_over_time_with_mean_and_spread(markers: Markers) -> None:
    found = segment(markers)
    shown = pair_distance(found, markers, 0, 3)
    by_hand = [np.sqrt(((p[0] - p[3]) ** 2).sum()) for p in markers.positions]
    assert np.allclose(shown.distance, by_hand, equal_nan=True)
    known = [d for d in by_hand if np.isfinite(d)]
    assert shown.frames == len(known) < 60
    assert np.isclose(shown.mean, sum(known) / len(known))
    assert np.isclose(shown.deviation, np.std(known))
    assert np.isclose(shown.affinity, shown.deviation), "all frames were compared"
    assert not shown.bridged
    never = pair_distance(found, markers, 0, COUNT)
    assert never.frames == 0 and np.isnan(never.mean) and np.isnan(never.affinity)
    assert never.bridged and not never.same_group
