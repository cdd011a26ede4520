"""Random recordings for the tests of reading and writing."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from markerscope.solver.core.markers import Markers, UpAxis, lab_rotation

RecordingMaker = Callable[..., Markers]


@pytest.fixture(scope="session")
def recording() -> RecordingMaker:
    """A maker of random recordings: a standing, swaying cloud 1.7 m tall, with gaps and filled spans."""

    def make(
        seed: int = 0,
        frames: int = 12,
        count: int = 7,
        labels: Sequence[str] | None = None,
        up: UpAxis = "z",
        rate: float = 100.0,
        first: int = 0,
        lost: float = 0.2,
        filled: float = 0.2,
    ) -> Markers:
        rng = np.random.default_rng(seed)
        rest = rng.uniform([-0.3, -0.2, 0.02], [0.3, 0.2, 1.7], (count, 3))
        positions = rest + 0.05 * np.cumsum(rng.normal(size=(frames, 1, 3)), axis=0) * [1, 1, 0.1]
        positions = positions + 0.002 * rng.normal(size=(frames, count, 3)) + [0.5, 0.5, 0.1]
        positions[rng.random((frames, count)) < lost] = np.nan
        flags = (rng.random((frames, count)) < filled) & np.isfinite(positions).all(axis=2)
        return Markers(
            positions=positions,
            rate=rate,
            labels=tuple(labels or (f"M{i:03d}" for i in range(count))),
            first_time=first / rate,
            R_lab_internal=lab_rotation(up),
            filled=flags,
        )

    return make
