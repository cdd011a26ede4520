"""Lost frames of a pose prior."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from markerscope.solver.core.prior_fill import fill_lost


@settings(max_examples=40, deadline=None)
@given(st.lists(st.booleans(), min_size=1, max_size=30).filter(any), st.integers(0, 100))
def test_filled_frames_lie_on_the_arc_between_their_neighbours(tracked: list[bool], seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = np.array(tracked)
    time = np.cumsum(rng.uniform(0.01, 0.1, len(seen)))
    rotations = Rotation.from_rotvec(rng.uniform(-1, 1, (len(seen) * 2, 3))).as_matrix().reshape(-1, 2, 3, 3)
    broken = np.where(seen[:, None, None, None], rotations, np.nan)
    filled = fill_lost(broken, seen, time)
    assert np.array_equal(filled[seen], rotations[seen])
    index = np.flatnonzero(seen)
    clipped = np.clip(time, time[index[0]], time[index[-1]])
    for joint in range(2):
        if len(index) > 1:
            expected = Slerp(time[index], Rotation.from_matrix(rotations[index, joint]))(clipped).as_matrix()
        else:
            expected = np.repeat(rotations[index, joint], len(seen), axis=0)
        worst = np.abs(filled[:, joint] - expected).max()
        assert worst < 1e-9, f"off scipy's slerp by {worst}"


def test_nothing_tracked_is_an_error() -> None:
    with pytest.raises(ValueError, match="no frame"):
        fill_lost(np.zeros((3, 1, 3, 3)), np.zeros(3, bool))
