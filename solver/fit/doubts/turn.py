"""A camera that turns, or a body that turns otherwise than in the video."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import log_so3, mean_rotation
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

SPREAD_DEG = 26.0
DRIFT_DEG = 28.0
_ROUNDS = 8
_LOWER_TRUNK, _HOLD_A_TURN = ("pelvis", "spine1"), 3


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
    turn = _without_bias(rotations[frames, 0], video[frames, 0])
    mean = mean_rotation(turn)
    apart = np.degrees(np.linalg.norm(log_so3(mean.T @ turn), axis=1))
    third = len(turn) // 3
    ends = [mean_rotation(turn[:third]), mean_rotation(turn[-third:])]
    drift = np.degrees(np.linalg.norm(log_so3(ends[0].T @ ends[1])))
    return float(np.sqrt((apart**2).mean())), float(drift)


def _without_bias(ours: np.ndarray, theirs: np.ndarray) -> np.ndarray:
    """(N, 3, 3) camera to lab in each frame, the video's constant error of the root taken out.

    Such an error turns with the person: of somebody who walks back and forth it would look like a camera that does.
    """
    bias = np.eye(3)
    for _ in range(_ROUNDS):
        camera = mean_rotation(ours @ np.swapaxes(theirs @ bias, -1, -2))
        bias = mean_rotation(np.swapaxes(camera @ theirs, -1, -2) @ ours)
    turn: np.ndarray = ours @ np.swapaxes(theirs @ bias, -1, -2)
    return turn


def holds_pelvis(joint: np.ndarray) -> bool:
    """Whether markers (M,), by their bones, hold the pelvis: three on itself and the lower back, or both thighs.

    Of a lone limb, or of two arms, the pelvis is where the video has it, and says nothing of the camera. One marker of
    a leg that came to lie on the hip bone does not change that: it takes three to hold a bone's turn.
    """
    marked = [JOINTS[j] for j in joint if j >= 0]
    return sum(name in _LOWER_TRUNK for name in marked) >= _HOLD_A_TURN or {"left_hip", "right_hip"} <= set(marked)


def turning_camera(seen: Evidence) -> Doubt | None:
    """Say that the camera does not seem to have stood still."""
    if not holds_pelvis(seen.joint):
        return None
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
