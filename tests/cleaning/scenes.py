"""Markers whose truth is known: a rigid cluster, a hinge, and how samples of them get lost."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import exp_so3

RATE = 60.0


def turning(frames: int, rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    """(T, 3, 3) smooth rotations."""
    time = np.arange(frames)[:, None] / RATE
    phase, speed = rng.uniform(0, 6, 3), rng.uniform(0.5, 1.5, 3)
    return exp_so3(size * np.sin(2 * np.pi * 0.3 * speed * time + phase))


def path(frames: int, rng: np.random.Generator) -> np.ndarray:
    """(T, 3) m, a smooth walk about."""
    time = np.arange(frames)[:, None] / RATE
    return 0.4 * np.sin(2 * np.pi * 0.25 * rng.uniform(0.5, 1.5, 3) * time + rng.uniform(0, 6, 3))


def rigid(frames: int = 240, markers: int = 8, seed: int = 0) -> np.ndarray:
    """(T, M, 3) m, markers on one rigid body."""
    rng = np.random.default_rng(seed)
    shape = rng.uniform(-0.15, 0.15, (markers, 3))
    return np.einsum("tij,mj->tmi", turning(frames, rng), shape) + path(frames, rng)[:, None]


def soft(frames: int = 400, seed: int = 0) -> np.ndarray:
    """(T, 9, 3) m: a rigid body whose last markers slide on it together, the very last by the sum of two others."""
    rng = np.random.default_rng(seed)
    shape = rng.uniform(-0.15, 0.15, (9, 3))
    time = np.arange(frames)[:, None] / RATE
    slide = np.zeros((frames, 9, 3))
    slide[:, 6] = 0.03 * np.sin(2 * np.pi * 0.9 * time) * [1, 0, 0]
    slide[:, 7] = 0.03 * np.sin(2 * np.pi * 0.53 * time + 1) * [0, 1, 0]
    slide[:, 8] = slide[:, 6] + slide[:, 7]
    R = turning(frames, rng)
    return np.einsum("tij,tmj->tmi", R, shape + slide) + path(frames, rng)[:, None]


def lose(positions: np.ndarray, *spans: tuple[int, int, int]) -> np.ndarray:
    """A copy in which (marker, first, last) are lost."""
    given = positions.copy()
    for marker, first, last in spans:
        given[first : last + 1, marker] = np.nan
    return given


def worst(found: np.ndarray, truth: np.ndarray) -> float:
    """m."""
    return float(np.linalg.norm(found - truth, axis=-1).max())
