"""Recordings at any rate come to 30 Hz, and windows lie where the paper has them."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.core.markers import Markers
from markerscope.solver.datasets.recording import RATE
from markerscope.solver.datasets.windows import cut, from_zero, starts


def recorded(rate: float, seconds: float) -> Markers:
    """Two markers that move evenly, so that linear interpolation is exact."""
    time = np.arange(round(seconds * rate)) / rate
    one = np.stack([time, 2 * time, 1 + 0 * time], axis=1)
    return Markers(np.stack([one, one + 0.1], axis=1), rate, ("A", "B"), first_time=3.5)


@pytest.mark.parametrize(
    ("length", "window", "padding", "wanted"),
    [
        (60.0, 15.0, 5.0, (5.0, 20.0, 35.0)),
        (55.0, 15.0, 5.0, (5.0, 20.0, 35.0)),
        (54.9, 15.0, 5.0, (5.0, 20.0)),
        (25.0, 15.0, 5.0, (5.0,)),
        (24.9, 15.0, 5.0, ()),
        (3.0, 15.0, 5.0, ()),
        (10.0, 3.0, 2.0, (2.0, 5.0)),
    ],
)
def test_windows_follow_each_other_between_the_paddings(
    length: float, window: float, padding: float, wanted: tuple[float, ...]
) -> None:
    assert starts(length, window, padding) == wanted


@pytest.mark.parametrize("rate", [30.0, 60.0, 100.0, 120.0, 59.94])
def test_every_rate_comes_to_thirty_frames_a_second(rate: float) -> None:
    window = cut(from_zero(recorded(rate, 8.0)), 2.0, 3.0)
    assert window.rate == RATE
    assert window.positions.shape == (90, 2, 3)
    assert window.first_time == 2.0
    time = 2.0 + np.arange(90) / 30
    assert np.allclose(window.positions[:, 0, 0], time, atol=1e-9)
    assert np.allclose(window.positions[:, 1, 1], 2 * time + 0.1, atol=1e-9)


def test_frames_that_are_met_exactly_do_not_suffer_from_a_lost_neighbour() -> None:
    markers = from_zero(recorded(120.0, 8.0))
    positions = markers.positions.copy()
    positions[np.arange(len(positions)) % 4 != 0] = np.nan
    thinned = Markers(positions, 120.0, markers.labels)
    assert np.isfinite(cut(thinned, 2.0, 3.0).positions).all()


def test_between_a_seen_and_a_lost_frame_nothing_is_made_up() -> None:
    markers = from_zero(recorded(100.0, 8.0))
    markers.positions[210, 0] = np.nan
    lost = np.isnan(cut(markers, 2.0, 3.0).positions[..., 0])
    assert lost[3, 0], "2.1 s is the lost frame itself"
    assert lost.sum() == 1
    markers.positions[221, 0] = np.nan
    assert np.isnan(cut(markers, 2.0, 3.0).positions[..., 0]).sum() == 1, "221 lies between no two frames in use"
    markers.positions[203, 0] = np.nan
    assert np.isnan(cut(markers, 2.0, 3.0).positions[1, 0]).all(), "2.0333 s lies between frames 203 and 204"


def test_an_empty_end_is_cut_off_and_the_clock_starts_with_the_recording() -> None:
    markers = recorded(100.0, 8.0)
    markers.positions[600:] = np.nan
    trimmed = from_zero(markers)
    assert trimmed.first_time == 0.0
    assert len(trimmed.positions) == 600
