"""What a video says of the pose: the start and the prior of every solve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class PosePrior:
    """Body poses reconstructed from a video, root in the camera's (or any one fixed) frame.

    Attributes
    ----------
    rotations : (F, 24, 3, 3), entry 0 turns the rest body (y up, facing +z) into the camera frame
        (x right, y down, z away), the others are parent-relative in the rest body's axes (SMPL layout)
    tracked : (F,) True where the video tracked the person; elsewhere the pose is filled in
    time : (F,) s in the video's clock
    betas : (S,) shape coefficients that the program found, median over its frames, None where it says none; they mean
        something on a body of ``kind`` alone
    source : path it was read from or made from
    notes : what was assumed while reading, one sentence each
    kind : of the body that ``betas`` belong to: "smpl", "smplh", "smplx"; "" where that is not known
    """

    rotations: np.ndarray
    tracked: np.ndarray
    time: np.ndarray
    betas: np.ndarray | None = None
    source: str = ""
    notes: tuple[str, ...] = ()
    kind: str = ""
