"""Rows along the session's clock, against plain loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.app.views.clocks import on_clock, over_markers, thinned
from markerscope.app.views.timelines import (
    TRACKED,
    UNSEEN,
    marker_motion,
    offset_row,
    overview,
    presence_row,
    residual_row,
    strip_order,
    video_motion,
    video_row,
)
from markerscope.app.views.tracks import tracks_of
from markerscope.solver.cleaning.clean import Cut
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.sync.offset import Sync
from tests.app.views.conftest import Made


@pytest.mark.parametrize(
    ("statistic", "plain"),
    [
        ("mean", np.mean),
        ("median", np.median),
        ("worst", np.max),
        ("p95", lambda v: np.percentile(v, 95)),
    ],
)
def test_statistics_over_markers_leave_out_the_lost(statistic: str, plain: object) -> None:
    rng = np.random.default_rng(0)
    values = rng.random((80, 9))
    values[rng.random((80, 9)) < 0.4] = np.nan
    values[5] = np.nan
    values[6, 1:] = np.nan
    values[6, 0] = 0.3
    found = over_markers(values, statistic)  # type: ignore[arg-type]
    for t, row in enumerate(values):
        known = row[np.isfinite(row)]
        wanted = plain(known) if len(known) else np.nan  # type: ignore[operator]
        assert np.isclose(found[t], wanted, equal_nan=True), t


def test_another_clock_takes_the_nearest_frame_or_none() -> None:
    time = np.array([1.0, 1.1, 1.2, 1.3])
    values = np.array([10.0, 11, np.nan, 13])
    wanted = np.array([0.8, 0.96, 1.04, 1.06, 1.2, 1.34, 1.4])
    assert np.array_equal(on_clock(wanted, time, values), [np.nan, 10, 10, 11, np.nan, 13, np.nan], equal_nan=True)
    assert on_clock(time.copy(), time, values) is values


def test_thinning_keeps_peaks_and_gaps() -> None:
    time = np.arange(10_000) / 100
    values = np.sin(time)
    values[4321] = 50.0
    values[1234] = -50.0
    values[6000:6500] = np.nan
    thin_time, thin = thinned(time, values, 400)
    assert len(thin) == len(thin_time) == 400
    assert np.nanmax(thin) == 50 and np.nanmin(thin) == -50
    gap = np.isnan(thin)
    assert gap.any() and thin_time[gap].min() >= 60.0 and thin_time[gap].max() <= 65.0
    assert (np.diff(thin_time) >= 0).all()
    assert thinned(time, values, 20_000)[1] is values


def test_strips_come_in_the_order_asked_for(made: Made) -> None:
    tracks = tracks_of(made.markers, made.motion)
    clusters = np.array([1, 0, -1, 1, 0] + [2] * 9)
    order = strip_order(clusters)
    assert order[:5].tolist() == [1, 4, 0, 3, 5] and order[-1] == 2
    colours = np.arange(42, dtype=np.uint8).reshape(14, 3)
    row = presence_row(tracks, order, colours)
    assert row.labels[:3] == ("m1", "m4", "m0")
    assert np.array_equal(row.present, made.markers.present[:, order])
    assert row.colours is not None and np.array_equal(row.colours[0], colours[1])
    assert row.filled is None and row.outlier is None
    assert np.array_equal(row.time, made.markers.time)


def test_filled_and_taken_out_samples_show(made: Made) -> None:
    present = made.markers.present
    positions, filled = made.markers.positions.copy(), np.zeros(present.shape, bool)
    gap, taken = tuple(np.argwhere(~present)[0]), tuple(np.argwhere(present)[-1])
    positions[gap], filled[gap], positions[taken] = 0.5, True, np.nan
    cut = Cut(np.array([taken[0]]), np.array([taken[1]]), np.zeros((1, 3)), np.zeros(1, bool))
    row = presence_row(tracks_of(replace(made.markers, positions=positions, filled=filled), cut=cut))
    assert row.filled is not None and row.outlier is not None
    assert np.argwhere(row.filled).tolist() == [list(gap)]
    assert np.argwhere(row.outlier).tolist() == [list(taken)]
    assert not row.present[gap] and not row.present[taken]


def test_the_overview_dips_where_one_frame_is_lost() -> None:
    positions = np.ones((5000, 4, 3))
    positions[2500, 1] = np.nan
    curve = overview(tracks_of(Markers(positions, 100.0, tuple("abcd"), first_time=3.0)), most=100)
    assert curve.time is not None and len(curve.values) == 100
    assert curve.values.min() == 75 and (curve.values == 100).sum() == 99
    assert curve.time[0] == 3.0 and np.isclose(curve.time[curve.values.argmin()], 28.0)


def test_the_video_lies_on_the_markers_clock() -> None:
    watched = PosePrior(np.zeros((4, 24, 3, 3)), np.array([True, False, True, True]), np.array([0.0, 0.5, 1, 1.5]))
    row = video_row(watched, Sync(2.0, 1.5, 1.0, np.zeros(1), np.zeros(1)))
    assert row.time.tolist() == [2.0, 2.75, 3.5, 4.25]
    assert row.states.tolist() == [TRACKED, UNSEEN, TRACKED, TRACKED]
    assert UNSEEN > TRACKED, "a loss must show where both fall on one pixel"


def test_residuals_of_several_fits_share_one_clock(made: Made) -> None:
    """A second fit of frames 10 to 29 alone, twice as far off."""
    part = slice(10, 30)
    second = replace(made.motion, time=made.motion.time[part], residual=2 * made.motion.residual[part])
    row = residual_row({"now": made.motion, "before": second}, made.motion.time, own="now")
    now, before = row.curves
    assert row.unit == "mm" and (now.dashed, before.dashed) == (False, True)
    for t in (0, 15, 29):
        known = [r for r in made.motion.residual[t] if np.isfinite(r)]
        assert np.isclose(now.values[t], 1000 * sum(known) / len(known))
    assert np.isnan(before.values[:10]).all() and np.isnan(before.values[30:]).all()
    assert np.allclose(before.values[part], 2 * now.values[part])
    assert not np.array_equal(now.colour, before.colour)
    one = residual_row({"now": made.motion}, made.motion.time, markers=np.array([4]))
    assert np.allclose(one.curves[0].values, 1000 * made.motion.residual[:, 4], equal_nan=True)


def sync(offset: float, method: str = "canonical correlation of velocities") -> Sync:
    return Sync(offset, 1.0, 0.8, np.zeros(1), np.zeros(1), method=method)


def test_the_offset_in_use_and_the_automatic_one(made: Made) -> None:
    watched = PosePrior(np.zeros((3, 24, 3, 3)), np.ones(3, bool), np.array([0.1, 0.5, 1.9]))
    row = offset_row(sync(0.4), made.markers, watched)
    assert (row.start, row.end, row.offset, row.automatic) == (0.1, 1.9, 0.4, 0.4)
    assert row.moving is None and row.fixed is not None
    given = offset_row(sync(0.7, "given"), made.markers, watched, sync(0.4))
    assert (given.offset, given.automatic) == (0.7, 0.4)
    assert offset_row(sync(0.7, "given"), made.markers, watched).automatic is None


def test_motion_of_markers_is_their_speed() -> None:
    """Two markers at 2 m/s and one that stands: the median is 2; one that is lost does not count."""
    time = np.arange(300) / 100
    positions = np.zeros((300, 4, 3))
    positions[:, 0, 0] = positions[:, 1, 1] = 2 * time
    positions[:, 3] = np.nan
    curve = marker_motion(Markers(positions, 100.0, tuple("abcd"), first_time=1.0))
    assert np.allclose(curve.values, 2.0)
    assert curve.time is not None and curve.time[0] > 1.0 and curve.time[-1] < 4.0


def test_motion_of_the_video_is_in_heights_of_the_person() -> None:
    """A person 200 px tall moves 100 px a second: half a height."""
    time = np.arange(20) / 10
    image = np.zeros((20, 33, 2))
    image[:, :, 1] = np.linspace(0, 200, 33)
    image[:, :, 0] = 100 * time[:, None]
    tracked = np.ones(20, bool)
    image[7], tracked[7] = np.nan, False
    landmarks = Landmarks(image, np.zeros((20, 33, 3)), np.ones((20, 33)), tracked, time, np.arange(20), (640, 480))
    curve = video_motion(landmarks)
    assert np.isnan(curve.values[[6, 7]]).all()
    assert np.allclose(np.delete(curve.values, [6, 7]), 0.5)
