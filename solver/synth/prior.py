"""What a monocular reconstruction makes of a known motion: every joint off by a constant and by slow noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.prior_fill import fill_lost
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import JOINTS, mirror_index
from markerscope.solver.synth.motion import Motion

_LOST_SPAN, _FLIP_SPAN = (0.3, 2.0), (0.2, 1.0)  # s, shortest and longest


@dataclass(frozen=True)
class PriorError:
    """How a reconstruction errs.

    Attributes
    ----------
    noise : times the usual error
    bias_deg, wander_deg : spread about each axis of the constant and of the slow part of a joint's error
    memory_s : s over which the slow part is alike
    tilt_deg : spread of the camera's pitch and roll; its yaw is any
    late_frames : frames of the motion that the video misses at its start, so that its clock begins later
    lost : fraction of the frames, in spans, in which the person is not tracked
    flips : spans in which left is taken for right
    """

    noise: float = 1.0
    bias_deg: float = 4.5
    wander_deg: float = 3.4
    memory_s: float = 0.15
    tilt_deg: float = 5.0
    late_frames: int = 0
    lost: float = 0.0
    flips: int = 0


def corrupt_prior(
    motion: Motion, rng: np.random.Generator, settings: PriorError | None = None
) -> tuple[PosePrior, np.ndarray, float]:
    """A prior of the motion, seen by a camera that looks anywhere.

    Each kind of error is drawn on its own: changing one leaves the others as they are.

    Returns
    -------
    prior : root in the camera's axes, on the video's clock, which starts at 0
    R_lab_cam : (3, 3) turns camera axes (x right, y down, z away) into the lab
    offset : s, marker time = video time + offset
    """
    settings = settings or PriorError()
    noise, camera, flips, lost = rng.spawn(4)
    R_lab_cam = _camera(settings, camera)
    seen = motion.rotations @ exp_so3(_error(motion, settings, noise))
    seen[:, 0] = R_lab_cam.T @ seen[:, 0]
    frames = len(seen)
    for _ in range(settings.flips):
        span = _span(frames, motion.rate, _FLIP_SPAN, flips)
        seen[span] = left_for_right(seen[span])
    tracked = np.ones(frames, dtype=bool)
    missing = round(settings.lost * frames)
    while missing > (~tracked).sum():
        gap = np.arange(frames)[_span(frames, motion.rate, _LOST_SPAN, lost)]
        tracked[gap[tracked[gap]][: missing - int((~tracked).sum())]] = False
    seen, tracked = seen[settings.late_frames :], tracked[settings.late_frames :]
    time = np.arange(len(seen)) / motion.rate
    if tracked.any():
        seen = fill_lost(seen, tracked, time)
    prior = PosePrior(seen, tracked, time, source="synthetic")
    return prior, R_lab_cam, settings.late_frames / motion.rate


def left_for_right(rotations: np.ndarray) -> np.ndarray:
    """Poses (F, 24, 3, 3), root in the camera's axes, as a detector has them that takes left for right.

    The picture stays as it was: each joint is seen where its mirror joint was, and depth, which a picture does not
    tell, is mirrored with it, so that a person who faces the camera seems to face away.
    """
    across, deep = np.diag([-1.0, 1, 1]), np.diag([1.0, 1, -1])
    flipped = across @ rotations[:, mirror_index()] @ across
    flipped[:, 0] = deep @ rotations[:, 0] @ across
    return flipped


def other_shape(prior: PosePrior, count: int, rng: np.random.Generator) -> PosePrior:
    """The prior with anybody's shape."""
    return replace(prior, betas=rng.normal(0, 1, count))


def _camera(settings: PriorError, rng: np.random.Generator) -> np.ndarray:
    """(3, 3) ``R_lab_cam`` of a camera that looks anywhere, nearly level."""
    level = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    tilt = np.radians(settings.tilt_deg) * rng.normal(size=3) * [1, 0, 1]
    turn: np.ndarray = exp_so3(np.array([0, 0, rng.uniform(-np.pi, np.pi)])) @ level @ exp_so3(tilt)
    return turn


def _error(motion: Motion, settings: PriorError, rng: np.random.Generator) -> np.ndarray:
    """(T, 24, 3) rad."""
    from scipy.ndimage import gaussian_filter1d

    count = len(JOINTS)
    bias = rng.normal(size=(count, 3))
    slow = gaussian_filter1d(rng.normal(size=(len(motion.trans), count, 3)), settings.memory_s * motion.rate, axis=0)
    slow /= np.maximum(slow.std(axis=0).mean(), 1e-12)
    error: np.ndarray = settings.noise * np.radians(settings.bias_deg * bias + settings.wander_deg * slow)
    return error


def _span(frames: int, rate: float, seconds: tuple[float, float], rng: np.random.Generator) -> slice:
    length = max(1, round(float(rng.uniform(*seconds)) * rate))
    start = int(rng.integers(1 - length, frames))
    return slice(max(start, 0), min(start + length, frames))
