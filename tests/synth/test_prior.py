"""A corrupted prior errs by as much as is asked, and says truly where its camera and clock are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import mirror_index
from markerscope.solver.synth import Motion, demo_motion
from markerscope.solver.synth.prior import PriorError, corrupt_prior, left_for_right

SIDES = mirror_index()


@pytest.fixture(scope="module")
def motion() -> Motion:
    return demo_motion(Body.load(), np.zeros(10), seconds=5, rate=30)


def error_deg(motion: Motion, settings: PriorError, seed: int = 3) -> np.ndarray:
    """(T, 24) degrees, once the camera is undone and the clocks agree."""
    prior, R_lab_cam, offset = corrupt_prior(motion, np.random.default_rng(seed), settings)
    found = prior.rotations.copy()
    found[:, 0] = R_lab_cam @ found[:, 0]
    start = round((prior.time[0] + offset) * motion.rate)
    truth = motion.rotations[start : start + len(found)]
    return np.degrees(np.linalg.norm(log_so3(truth.swapaxes(2, 3) @ found), axis=2))


def test_the_nominal_error_is_that_of_real_reconstructions(motion: Motion) -> None:
    mean = error_deg(motion, PriorError()).mean()
    assert 7 < mean < 11, f"{mean:.1f} degrees a joint"


def test_without_noise_camera_and_clock_explain_everything(motion: Motion) -> None:
    off = error_deg(motion, PriorError(noise=0, late_frames=6))
    assert off.shape == (144, 24)
    assert off.max() < 1e-5, f"{off.max():.1e} degrees"


def test_three_times_the_noise_is_three_times_the_error(motion: Motion) -> None:
    ratio = error_deg(motion, PriorError(noise=3)).mean() / error_deg(motion, PriorError()).mean()
    assert ratio == pytest.approx(3, rel=0.05)


def test_the_seed_decides(motion: Motion) -> None:
    one, same, other = (corrupt_prior(motion, np.random.default_rng(s))[0].rotations for s in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert not np.allclose(one, other)


def test_each_error_is_drawn_on_its_own(motion: Motion) -> None:
    plain, R, _ = corrupt_prior(motion, np.random.default_rng(3))
    for more in (PriorError(lost=0.3), PriorError(flips=2)):
        other, R_other, _ = corrupt_prior(motion, np.random.default_rng(3), more)
        np.testing.assert_array_equal(R, R_other)
        same = np.isclose(plain.rotations, other.rotations).all(axis=(1, 2, 3))
        assert 0.3 < same.mean() < 0.99
        assert (same | ~other.tracked).all() == (more.flips == 0)


def test_lost_spans_are_as_long_as_asked_and_filled_from_their_ends(motion: Motion) -> None:
    prior, _, _ = corrupt_prior(motion, np.random.default_rng(5), PriorError(lost=0.3))
    assert (~prior.tracked).sum() == round(0.3 * len(prior.tracked))
    spans = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], ~prior.tracked, [0]]))))[::2]
    assert spans.max() >= 9, "no span of 0.3 s"
    np.testing.assert_allclose(np.linalg.det(prior.rotations), 1)
    first = np.flatnonzero(prior.tracked)[0]
    np.testing.assert_allclose(prior.rotations[:first], np.broadcast_to(prior.rotations[first], (first, 24, 3, 3)))


def test_a_flip_leaves_the_picture_and_exchanges_left_and_right(motion: Motion) -> None:
    body = Body.load()
    both_alike = replace(body, joint_template=0.5 * (body.joint_template + body.joint_template[SIDES] * [-1, 1, 1]))
    seen, _, _ = corrupt_prior(motion, np.random.default_rng(1), PriorError(noise=0))
    flipped = left_for_right(seen.rotations)
    np.testing.assert_allclose(np.linalg.det(flipped), 1)
    np.testing.assert_allclose(left_for_right(flipped), seen.rotations, atol=1e-12)
    rest = both_alike.joint_template[0]
    places = [
        both_alike.pose(r, np.zeros(10), np.tile(-rest, (len(r), 1)), want_vertices=False)[1]
        for r in (seen.rotations, flipped)
    ]
    np.testing.assert_allclose(places[1], places[0][:, SIDES] * [1, 1, -1], atol=1e-9)


def test_flips_are_in_spans(motion: Motion) -> None:
    plain, flipped = (
        corrupt_prior(motion, np.random.default_rng(2), PriorError(noise=0, flips=n))[0].rotations for n in (0, 1)
    )
    changed = ~np.isclose(plain, flipped).all(axis=(1, 2, 3))
    at = np.flatnonzero(changed)
    assert len(at) == at[-1] - at[0] + 1 and 1 <= len(at) <= 30
    np.testing.assert_allclose(flipped[changed], left_for_right(plain[changed]))
