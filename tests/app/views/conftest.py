"""A made-up fit of the embedded body, every number of it known: random shape, smooth poses, markers with gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.sync.offset import Sync

FRAMES, COUNT, RATE, FIRST = 60, 14, 50.0, 0.4


@dataclass(frozen=True)
class Made:
    """What was made up; the last two markers are of no bone."""

    body: Body
    markers: Markers
    motion: FittedMotion
    sync: Sync


@pytest.fixture(scope="session")
def body() -> Body:
    return with_bone_lengths(Body.load())


@pytest.fixture(scope="session")
def made(body: Body) -> Made:
    return make(body, seed=5)


def make(body: Body, seed: int) -> Made:
    rng = np.random.default_rng(seed)
    time = FIRST + np.arange(FRAMES) / RATE
    swing = 0.5 * np.sin(time[:, None, None] * rng.uniform(1, 4, (24, 3)) + rng.uniform(0, 6, (24, 3)))
    rotations = exp_so3(swing)
    rotations[:, 0] = exp_so3(np.array([0, 0, 0.7])) @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ rotations[:, 0]
    trans = np.stack([0.2 * time, -0.1 * time, 0.9 + 0 * time], axis=1)
    betas = rng.normal(0, 0.7, body.shape_count)
    used = COUNT - 2
    vertex = rng.choice(np.flatnonzero(body.marker_mask), used, replace=False)
    posed, joints = body.pose(rotations, betas, trans, vertex)
    placed = np.full((FRAMES, COUNT, 3), np.nan)
    placed[:, :used] = posed
    positions = placed + rng.normal(0, 0.004, placed.shape)
    positions[:, used:] = rng.normal(0, 1, (FRAMES, 2, 3))
    positions[rng.random((FRAMES, COUNT)) < 0.15] = np.nan
    joint, index = np.full(COUNT, -1), np.full(COUNT, -1)
    joint[:used], index[:used] = body.weights[vertex].argmax(axis=1), vertex
    view = exp_so3(np.array([0, 0, 0.4])) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]) @ exp_so3(0.05 * np.ones(3))
    camera = CameraResult(view, np.array([1.5, -4.0, 1.1]), 1100.0, (720, 1280), 3.0)
    markers = Markers(positions, RATE, tuple(f"m{i}" for i in range(COUNT)), first_time=FIRST)
    residual = np.linalg.norm(positions - placed, axis=2)
    motion = FittedMotion(
        time, rotations, trans, betas, joints, joint, index, placed, residual, camera, 0, 0.9, ()
    )  # fmt: skip
    return Made(body, markers, motion, Sync(0.25, 1.0, 1.0, np.zeros(1), np.zeros(1)))
