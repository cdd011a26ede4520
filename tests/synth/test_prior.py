"""A corrupted prior errs by as much as is asked, and says truly where its camera and clock are."""

from __future__ import annotations

import numpy as np
import pytest

from solver.body.model import Body
from solver.rotations import log_so3
from solver.synth import Motion, demo_motion
from solver.synth.prior import PriorError, corrupt_prior


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
