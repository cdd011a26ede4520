"""A camera that turns, or a body that turns otherwise than in the video."""

from __future__ import annotations

import numpy as np

from solver.rotations import log_so3, mean_rotation
from solver.solve.doubts.doubt import Doubt, Evidence

SPREAD_DEG = 32.0
DRIFT_DEG = 30.0


def camera_turn(rotations: np.ndarray, video: np.ndarray, tracked: np.ndarray) -> tuple[float, float]:
    """How far the camera seems to turn: spread about its mean (root mean square) and from the first to the last third.

    Parameters
    ----------
    rotations, video : (T, 24, 3, 3), of which the root counts: in the lab, and in the camera's frame
    tracked : (T,) True where the video tracked the person

    Returns
    -------
    Degrees; NaN where there is too little to see
    """
    frames = np.flatnonzero(tracked)
    if len(frames) < 6:
        return float("nan"), float("nan")
    turn = rotations[frames, 0] @ np.swapaxes(video[frames, 0], -1, -2)
    mean = mean_rotation(turn)
    apart = np.degrees(np.linalg.norm(log_so3(mean.T @ turn), axis=1))
    third = len(turn) // 3
    ends = [mean_rotation(turn[:third]), mean_rotation(turn[-third:])]
    drift = np.degrees(np.linalg.norm(log_so3(ends[0].T @ ends[1])))
    return float(np.sqrt((apart**2).mean())), float(drift)


def turning_camera(seen: Evidence) -> Doubt | None:
    """Say that the camera does not seem to have stood still."""
    spread, drift = camera_turn(seen.rotations, seen.video, seen.tracked)
    if not (spread > SPREAD_DEG or drift > DRIFT_DEG):
        return None
    drifts = drift > DRIFT_DEG
    value, limit = (drift, DRIFT_DEG) if drifts else (spread, SPREAD_DEG)
    how = f"by {drift:.0f} degrees from start to end" if drifts else f"to and fro by {spread:.0f} degrees"
    return Doubt(
        "turning camera",
        f"Against the markers the video's camera seems to turn {how} (up to {limit:.0f} are usual): use a video whose "
        "camera stands still, and check that it is of this movement.",
        value=value,
        limit=limit,
    )
