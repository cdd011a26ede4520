"""The video brought onto the markers' clock: what is seen when, and what is not bridged."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.fit.observe import observe
from markerscope.solver.sync.offset import Sync

SPEED = 0.4  # rad a second of the video's own clock
DRIFT = 7.0  # px a second of the same


def filmed(rate: float = 25.0, seconds: float = 6.0) -> tuple[PosePrior, Landmarks]:
    """Every joint turns and every landmark drifts evenly, each of its own, so that a picture tells its time."""
    time = np.arange(0, seconds, 1 / rate)
    axis = np.random.default_rng(0).normal(size=(24, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    rotations = exp_so3(SPEED * time[:, None, None] * axis)
    image = DRIFT * time[:, None, None] * np.arange(1, 34)[:, None] * [1.0, -1]
    sight = np.clip(0.1 + 0.1 * time[:, None] * np.ones(33), 0, 1)
    everywhere = np.ones(len(time), dtype=bool)
    seen = Landmarks(image, np.zeros((len(time), 33, 3)), sight, everywhere, time, np.arange(len(time)), (640, 480))
    return PosePrior(rotations, everywhere.copy(), time), seen


def markers(count: int, rate: float = 50.0, first: float = 0.0) -> Markers:
    return Markers(np.zeros((count, 3, 3)), rate, ("a", "b", "c"), first_time=first)


@pytest.mark.parametrize("ratio", [0.5, 29.97 / 30, 1.0, 30 / 29.97, 2.0])
@pytest.mark.parametrize("offset", [-1.25, 0.0, 10.0])
def test_a_clock_that_runs_at_another_rate_shows_each_picture_when_it_was_taken(ratio: float, offset: float) -> None:
    prior, landmarks = filmed()
    body = Body.load()
    given = markers(100, first=offset + 1.0)
    seen, points = observe(given, prior, landmarks, body, offset, ratio)
    taken = (given.time - offset) / ratio  # of the video's clock
    inside = taken < prior.time[-1]
    assert inside.sum() > 40
    assert seen.tracked[inside].all()
    turned = np.linalg.norm(log_so3(seen.prior[inside]), axis=-1)
    np.testing.assert_allclose(turned, SPEED * taken[inside][:, None] * np.ones(24), atol=1e-9)
    shown = {name: i for i, name in enumerate(n for n in LANDMARKS if "mouth" not in n and "_eye_" not in n)}
    assert len(points.rest) == len(shown) == seen.image.shape[1]
    for name, column in shown.items():
        expected = DRIFT * taken[inside] * (LANDMARKS.index(name) + 1)
        np.testing.assert_allclose(seen.image[inside, column], np.stack([expected, -expected], 1), atol=1e-6)
    np.testing.assert_allclose(seen.visibility[inside], 0.1 + 0.1 * taken[inside][:, None] * np.ones(27), atol=1e-9)
    sync = Sync(offset, ratio, 1.0, np.zeros(1), np.zeros(1))
    np.testing.assert_allclose(sync.marker_time(taken), given.time, atol=1e-9)


def test_beyond_the_video_and_in_long_gaps_nothing_is_seen_and_short_ones_are_bridged() -> None:
    prior, landmarks = filmed(rate=25.0, seconds=4.0)
    keep = np.ones(len(prior.time), dtype=bool)
    keep[30:33] = False  # 1.20 to 1.28 s: 0.16 s from picture to picture
    keep[60:70] = False  # 2.40 to 2.76 s: 0.44 s
    body = Body.load()
    fewer = Landmarks(
        landmarks.image[keep], landmarks.world[keep], landmarks.visibility[keep], landmarks.tracked[keep],
        landmarks.time[keep], landmarks.frame[keep], landmarks.image_size,
    )  # fmt: skip
    given = markers(260, rate=50.0)
    seen, _ = observe(given, prior, fewer, body, 0.0, 1.0)
    there = np.isfinite(seen.image).all(axis=(1, 2))
    time = given.time
    assert there[(time > 1.15) & (time < 1.33)].all(), "no frame is more than 0.1 s from a picture"
    assert not there[(time > 2.47) & (time < 2.69)].any(), "more than 0.1 s from either side"
    assert there[(time < 2.36) | ((time > 2.81) & (time < 3.96))].all()
    assert not there[time > 4.1].any()
    assert not seen.tracked[time > 4.1].any()


def test_frames_next_to_one_without_a_person_are_not_tracked() -> None:
    prior, landmarks = filmed(rate=25.0, seconds=2.0)
    tracked = np.ones(50, dtype=bool)
    tracked[20] = False
    lost = PosePrior(prior.rotations, tracked, prior.time)
    seen, _ = observe(markers(99, rate=50.0), lost, None, Body.load(), 0.0, 1.0)
    assert np.flatnonzero(~seen.tracked).tolist() == [39, 40, 41], "0.78, 0.80 and 0.82 s"
    assert seen.image.shape == (99, 0, 2)
    assert seen.image_size == (0, 0)
    assert landmarks.tracked.all()
