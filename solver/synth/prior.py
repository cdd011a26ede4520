"""What a monocular reconstruction makes of a known motion: every joint off by a constant and by slow noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solver.body.skeleton import JOINTS
from solver.prior import PosePrior
from solver.rotations import exp_so3
from solver.synth.motion import Motion


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
    """

    noise: float = 1.0
    bias_deg: float = 4.5
    wander_deg: float = 3.4
    memory_s: float = 0.15
    tilt_deg: float = 5.0
    late_frames: int = 0


def corrupt_prior(
    motion: Motion, rng: np.random.Generator, settings: PriorError | None = None
) -> tuple[PosePrior, np.ndarray, float]:
    """A prior of the motion, seen by a camera that looks anywhere.

    Returns
    -------
    prior : root in the camera's axes, on the video's clock, which starts at 0
    R_lab_cam : (3, 3) turns camera axes (x right, y down, z away) into the lab
    offset : s, marker time = video time + offset
    """
    from scipy.ndimage import gaussian_filter1d

    settings = settings or PriorError()
    rotations = motion.rotations[settings.late_frames :]
    count = len(JOINTS)
    bias = rng.normal(size=(count, 3))
    slow = gaussian_filter1d(rng.normal(size=(len(rotations), count, 3)), settings.memory_s * motion.rate, axis=0)
    slow /= np.maximum(slow.std(axis=0).mean(), 1e-12)
    error = settings.noise * np.radians(settings.bias_deg * bias + settings.wander_deg * slow)
    level = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    tilt = np.radians(settings.tilt_deg) * rng.normal(size=3) * [1, 0, 1]
    R_lab_cam = exp_so3(np.array([0, 0, rng.uniform(-np.pi, np.pi)])) @ level @ exp_so3(tilt)
    seen = rotations @ exp_so3(error)
    seen[:, 0] = R_lab_cam.T @ seen[:, 0]
    time = np.arange(len(seen)) / motion.rate
    prior = PosePrior(seen, np.ones(len(seen), dtype=bool), time, source="synthetic")
    return prior, R_lab_cam, settings.late_frames / motion.rate
