"""What stands in the scene at a frame, in which colours, with trails and lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.app.views.bodies import of_motion
from markerscope.app.views.colours import by_bone, by_cluster, by_residual, by_selection, by_state
from markerscope.app.views.scene import extent, markers_at, middle, misses, outline, ties, trails
from markerscope.app.views.tracks import FILLED, LOST, MEASURED, OUTLIER, pooled, tracks_of
from markerscope.solver.cleaning.clean import Cut
from markerscope.solver.clustering.segment import segment
from markerscope.solver.core.markers import Markers
from markerscope.widgets import palette
from markerscope.widgets.colour_bar import ColourBar
from tests.app.views.conftest import Made


def test_states_tell_measured_filled_taken_out_and_lost() -> None:
    positions = np.ones((4, 2, 3))
    positions[2, 0] = np.nan  # lost, stays so
    positions[0, 1] = np.nan  # taken out
    filled = np.zeros((4, 2), bool)
    filled[1, 0] = True  # lost, then filled
    filled[3, 1] = True  # taken out, then filled
    filled[3, 0] = True  # filled by the file, taken out, filled again
    markers = Markers(positions, 10.0, ("a", "b"), filled=filled)
    frame, marker = np.array([0, 3, 3]), np.array([1, 1, 0])
    cut = Cut(frame, marker, np.zeros((3, 3)), np.array([False, False, True]))
    state = tracks_of(markers, cut=cut).state
    assert state[:, 0].tolist() == [MEASURED, FILLED, LOST, FILLED]
    assert state[:, 1].tolist() == [OUTLIER, MEASURED, MEASURED, OUTLIER]
    assert tracks_of(markers).state[:, 1].tolist() == [LOST, MEASURED, MEASURED, FILLED]


def test_pooling_keeps_the_worst_of_every_bin() -> None:
    rng = np.random.default_rng(0)
    states = (4 * rng.random((1003, 5)) ** 6).astype(np.uint8)
    small = pooled(states, 90)
    assert small.shape == (90, 5)
    for i in range(90):
        first, last = i * 1003 // 90, (i + 1) * 1003 // 90
        assert np.array_equal(small[i], states[first:last].max(axis=0)), i
    assert pooled(states, 2000) is states


def test_time_runs_between_frames(made: Made) -> None:
    tracks = tracks_of(made.markers)
    positions = made.markers.positions
    for frame in (0, 31, 59):
        assert np.array_equal(tracks.at(tracks.time(frame)), positions[frame], equal_nan=True)
        assert tracks.nearest(tracks.time(frame) + 0.009) == frame
    half = tracks.at(tracks.time(31) + 0.25 / 50)
    assert np.allclose(half, 0.75 * positions[31] + 0.25 * positions[32], equal_nan=True)
    assert np.isnan(tracks.at(tracks.time(0) - 0.01)).all() and np.isnan(tracks.at(tracks.time(59) + 0.01)).all()
    assert (tracks.nearest(-5.0), tracks.nearest(99.0)) == (0, 59)
    one = tracks_of(made.markers.select(slice(0, 1)))
    assert np.array_equal(one.at(one.time(0)), positions[0], equal_nan=True)


def test_lost_markers_are_drawn_where_the_fit_puts_them_only_by_gap_state(made: Made) -> None:
    tracks = tracks_of(made.markers, made.motion)
    lost = ~made.markers.present
    frame = int(lost[:, :12].sum(axis=1).argmax())
    shown = markers_at(tracks, frame, "gaps").positions
    gone = np.flatnonzero(lost[frame])
    assert np.array_equal(shown[gone], made.motion.placed[frame, gone], equal_nan=True)
    assert np.isnan(markers_at(tracks, frame, "bone", motion=made.motion).positions[gone]).all()


def test_what_cannot_be_coloured_yet_falls_back_to_gap_states(made: Made) -> None:
    tracks = tracks_of(made.markers)
    for by in ("cluster", "bone", "residual"):
        assert markers_at(tracks, 3, by).coloured.legend.title == "Gap state"  # type: ignore[arg-type]


def test_colours_follow_a_cut_that_is_dragged(made: Made) -> None:
    tracks, found = tracks_of(made.markers), segment(made.markers)
    settled = markers_at(tracks, 0, "cluster", segmentation=found).coloured
    assert np.array_equal(settled.colours, by_cluster(found.clusters).colours)
    dragged = np.arange(14) % 3
    moved = markers_at(tracks, 0, "cluster", segmentation=found, clusters=dragged).coloured
    assert np.array_equal(moved.colours, palette.categorical(3)[dragged])


def test_cluster_colours_and_their_legend() -> None:
    found = by_cluster(np.array([1, 0, -1, 1]))
    assert np.array_equal(found.colours[0], found.colours[3])
    assert np.array_equal(found.colours[2], palette.LOST)
    texts = [text for text, _ in found.legend.entries]
    assert texts == ["Group 1 (1)", "Group 2 (2)", "no group (1)"]
    for text, colour in found.legend.entries[:2]:
        member = {"Group 1 (1)": 1, "Group 2 (2)": 0}[text]
        assert tuple(found.colours[member]) == colour
    assert by_cluster(np.full(3, -1)).legend.entries == (("no group (3)", palette.LOST),)


def test_a_bone_keeps_its_colour_whatever_else_is_there() -> None:
    one, other = by_bone(np.array([4, 1, -1])), by_bone(np.array([4, 20, 20]))
    assert np.array_equal(one.colours[0], other.colours[0])
    assert [t for t, _ in one.legend.entries] == ["left thigh (1)", "left shank (1)", "no bone (1)"]
    assert len({t for t, _ in by_bone(np.arange(24)).legend.entries}) == 24


def test_residual_colours_run_over_their_bar() -> None:
    found = by_residual(np.array([0.0, 0.015, 0.03, 0.5, np.nan]))
    table = palette.scale_table()
    assert np.array_equal(found.colours[[0, 2, 3]], table[[0, 255, 255]])
    assert np.array_equal(found.colours[4], palette.LOST)
    bar = found.legend.entries
    assert isinstance(bar, ColourBar)
    assert (bar.lo, bar.hi, bar.unit) == (0.0, 30.0, "mm")


def test_state_and_selection_colours_count_what_they_show() -> None:
    found = by_state(np.array([MEASURED, LOST, LOST, FILLED], dtype=np.uint8))
    assert [text for text, _ in found.legend.entries] == ["measured (1)", "filled (1)", "lost (2)"]
    assert len(np.unique(found.colours, axis=0)) == 3
    chosen = by_selection(5, {4, 1, 77})
    assert np.flatnonzero((chosen.colours == palette.SELECTED).all(axis=1)).tolist() == [1, 4]
    assert chosen.legend.entries[0][0] == "selected (2)"


@pytest.mark.parametrize(("frame", "seconds", "most", "length"), [(40, 0.2, 24, 11), (40, 0.4, 6, 6), (3, 0.2, 24, 4)])
def test_a_trail_ends_at_its_marker(made: Made, frame: int, seconds: float, most: int, length: int) -> None:
    tracks = tracks_of(made.markers)
    found = trails(tracks, frame, seconds, most)
    assert len(found) == length <= most
    assert np.array_equal(found[-1], made.markers.positions[frame], equal_nan=True)
    assert len(trails(tracks, 0)) == 1


def test_lines_join_what_is_seen_to_its_place(made: Made) -> None:
    tracks, body = tracks_of(made.markers, made.motion), of_motion(made.body, made.motion)
    frame = 21
    seen = np.flatnonzero(made.markers.present[frame, :12])
    found = ties(tracks, body, frame)
    assert np.array_equal(found.owner, seen)
    assert np.allclose(found.start, made.markers.positions[frame, seen])
    assert np.abs(found.end - made.motion.placed[frame, seen]).max() < 2e-6
    short = misses(tracks.seen(frame), made.motion.placed[frame])
    assert np.allclose(np.linalg.norm(short.end - short.start, axis=1), made.motion.residual[frame, seen])


def test_the_middle_and_the_extent_ignore_the_lost_and_the_odd(made: Made) -> None:
    positions = np.zeros((500, 3, 3))
    positions[:, 1] = [1.0, 2, 3]
    positions[:, 2] = np.nan
    positions[7, 0] = 900.0
    tracks = tracks_of(Markers(positions, 100.0, ("a", "b", "c")))
    low, high = extent(tracks)
    assert np.allclose(low, 0) and np.allclose(high, [1, 2, 3])
    assert np.allclose(middle(tracks, 0), [0.5, 1, 1.5])
    nothing = tracks_of(replace(made.markers, positions=np.full((2, 3, 3), np.nan)))
    assert np.isnan(middle(nothing, 0)).all()
    assert not extent(nothing)[1].any()
    assert len(outline(nothing)) == 0
    assert np.abs(outline(tracks, most=500)).max() == 3.0, "the ghost is not looked at"


def test_the_outline_holds_the_body_from_crown_to_sole(made: Made) -> None:
    track = of_motion(made.body, made.motion)
    points = outline(tracks_of(made.markers, made.motion), track)
    seen = np.concatenate([track.vertices(float(time)) for time in made.motion.time[::20]])
    missed = np.maximum(seen.max(axis=0) - points.max(axis=0), points.min(axis=0) - seen.min(axis=0))
    assert missed.max() < 0.12, f"the body reaches {missed} m beyond what is framed"
    assert missed[2] < 0.02, "neither crown nor soles are cut off"
