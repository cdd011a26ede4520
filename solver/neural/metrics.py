"""How far filled markers and solved poses are from the truth, as Pan et al. (2023), section 4.2, define it."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import JOINTS

BODY = tuple(range(22))
"""The 22 joints that both papers call the body: all but the two that stand for the fingers."""
FINGERS = tuple(range(22, len(JOINTS)))


def ompe(positions: np.ndarray, truth: np.ndarray, hidden: np.ndarray) -> float:
    """Occluded marker position error: mean distance in cm over the samples that were hidden and filled.

    Parameters
    ----------
    positions, truth : (..., M, 3) m
    hidden : (..., M) True where the sample was hidden
    """
    apart = np.linalg.norm(np.asarray(positions, float) - np.asarray(truth, float), axis=-1)
    counted = np.asarray(hidden, bool) & np.isfinite(apart)
    return 100 * float(apart[counted].mean()) if counted.any() else float("nan")


def angles_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(...) degrees by which rotations (..., 3, 3) differ."""
    one, other = np.asarray(one, float), np.asarray(other, float)
    # The chord |A - B| = 2 sqrt(2) sin(angle / 2) is exact for small angles, where the trace is not.
    chord = np.linalg.norm(one - other, axis=(-2, -1)) / (2 * np.sqrt(2))
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(chord, 0, 1))))


def joe(rotations: np.ndarray, truth: np.ndarray, joints: tuple[int, ...] = BODY) -> float:
    """Joint orientation error: mean angle in degrees over the joints.

    Parameters
    ----------
    rotations, truth : (..., 24, 3, 3), both relative to the parent, or both in the lab
    joints : those that count
    """
    chosen = list(joints)
    return float(angles_between(rotations[..., chosen, :, :], truth[..., chosen, :, :]).mean())


def jpe(joints: np.ndarray, truth: np.ndarray, counted: tuple[int, ...] = BODY) -> float:
    """Joint position error: mean distance in cm over the joints, in the lab.

    Parameters
    ----------
    joints, truth : (..., 24, 3) m
    """
    chosen = list(counted)
    apart = np.asarray(joints, float)[..., chosen, :] - np.asarray(truth, float)[..., chosen, :]
    return 100 * float(np.linalg.norm(apart, axis=-1).mean())
