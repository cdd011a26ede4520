"""Joints that turn otherwise than the video says."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import log_so3, mean_rotation
from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

LEAST = 0.5
FEWEST_JOINTS = 4
_MOVES_DEG = 5.0
_FRAMES = 400


def agreement(rotations: np.ndarray, video: np.ndarray, tracked: np.ndarray, joint: np.ndarray) -> float:
    """Correlation of fitted with video joint rotations; NaN where fewer than four joints can be compared.

    Only joints count between two bones that carry markers, and that turn: others say nothing, or only what the video
    said. Each is taken as rotation vectors about its own mean; the median over the joints is returned.

    Parameters
    ----------
    rotations, video : (T, 24, 3, 3)
    tracked : (T,) True where the video tracked the person
    joint : (M,) bone of each marker, -1 where it was not used
    """
    marked = np.zeros(len(JOINTS), dtype=bool)
    marked[joint[joint >= 0]] = True
    frames = np.flatnonzero(tracked)
    frames = frames[:: max(1, len(frames) // _FRAMES)]
    held = [j for j in range(1, len(JOINTS)) if marked[j] and marked[PARENTS[j]]]
    if len(held) < FEWEST_JOINTS or len(frames) < 10:
        return float("nan")
    ours, theirs = (_about_mean(one[frames][:, held]) for one in (rotations, video))
    spread = np.degrees(np.sqrt((ours**2).sum(axis=2).mean(axis=0)))
    moving = spread >= _MOVES_DEG
    if moving.sum() < FEWEST_JOINTS:
        return float("nan")
    both = (ours * theirs).sum(axis=(0, 2))
    scale = np.sqrt((ours**2).sum(axis=(0, 2)) * (theirs**2).sum(axis=(0, 2)))
    return float(np.median((both / np.maximum(scale, 1e-12))[moving]))


def _about_mean(rotations: np.ndarray) -> np.ndarray:
    """(T, J, 3) rad, rotation vectors about each joint's mean."""
    mean = mean_rotation(rotations)
    turned: np.ndarray = log_so3(np.swapaxes(mean, -1, -2) @ rotations)
    return turned


def disagreement(seen: Evidence) -> Doubt | None:
    """Say that the joints do not move as in the video."""
    value = agreement(seen.rotations, seen.video, seen.tracked, seen.joint)
    if not value < LEAST:
        return None
    return Doubt(
        "another movement",
        f"The fitted joints do not turn as those of the video do (correlation {value:.2f}, at least {LEAST} is usual): "
        "check that the video is of this movement and this person, its offset, and that it is not mirrored.",
        value=value,
        limit=LEAST,
    )
