"""Parts of a recording: which frames a range of times takes, and that everything goes along with them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers, UpAxis, lab_rotation


def recording(count: int = 200, rate: float = 100.0, first: float = 5.0) -> Markers:
    """Each sample says which frame and marker it is."""
    positions = np.stack(np.broadcast_arrays(np.arange(count)[:, None], np.arange(4), 0.0), axis=2)
    filled = (np.arange(count)[:, None] + np.arange(4)) % 7 == 0
    return Markers(positions, rate, tuple("abcd"), first_time=first, filled=filled, source="trial.c3d")


@given(
    rate=st.sampled_from([29.97, 50.0, 60.0, 100.0, 119.88, 1000.0]),
    first=st.sampled_from([-3.0, 0.0, 5.0, 1234.56]),
    ends=st.tuples(st.integers(0, 199), st.integers(0, 199)).map(sorted),
)
def test_a_range_takes_both_its_ends_whatever_the_clock(rate: float, first: float, ends: list[int]) -> None:
    whole = recording(rate=rate, first=first)
    a, b = ends
    part = whole.between(float(whole.time[a]), float(whole.time[b]))
    assert part.positions[:, 0, 0].tolist() == list(range(a, b + 1))
    np.testing.assert_allclose(part.time, whole.time[a : b + 1], atol=1e-9)
    assert part.filled is not None
    assert whole.filled is not None
    np.testing.assert_array_equal(part.filled, whole.filled[a : b + 1])


def test_a_range_that_lies_between_frames_takes_those_inside() -> None:
    whole = recording()
    assert whole.between(5.014, 5.046).positions[:, 0, 0].tolist() == [2, 3, 4]
    assert whole.between(None, 5.02).positions[:, 0, 0].tolist() == [0, 1, 2]
    assert whole.between(6.98, None).positions[:, 0, 0].tolist() == [198, 199]
    assert whole.between(None, None) is whole
    for start, stop in ((5.012, 5.018), (0.0, 4.99), (7.0, 9.0), (6.0, 5.5)):
        with pytest.raises(InputError, match=r"runs from 5 s to 6\.99 s"):
            whole.between(start, stop)


def test_some_markers_keep_their_names_and_flags() -> None:
    whole = recording()
    part = whole.select(slice(10, 14), np.array([3, 1]))
    assert part.labels == ("d", "b")
    assert part.positions[:, :, 1].tolist() == [[3, 1]] * 4
    assert part.first_time == pytest.approx(5.1)
    assert part.filled is not None
    assert whole.filled is not None
    np.testing.assert_array_equal(part.filled, whole.filled[10:14][:, [3, 1]])


@pytest.mark.parametrize(("up", "axis"), [("x", 0), ("y", 1), ("z", 2)])
def test_the_files_axes_are_a_turn_that_takes_up_to_up(up: UpAxis, axis: int) -> None:
    turn = lab_rotation(up)
    np.testing.assert_allclose(turn @ [0, 0, 1], np.eye(3)[axis])
    assert np.linalg.det(turn) == pytest.approx(1)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3))
