"""A video that was mirrored: told by solving with its mirror image, which is only done where the video is in doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.core.skeleton import JOINTS, mirror_index
from markerscope.solver.fit.doubts.agreement import LEAST, agreement
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence
from markerscope.solver.fit.doubts.picture import SHARE
from markerscope.solver.fit.doubts.turn import DRIFT_DEG, SPREAD_DEG, camera_turn, holds_pelvis
from markerscope.solver.fit.lift import mirror_landmarks
from markerscope.solver.fit.state import Observations

BETTER = 1.3
"""The mirror image of the right video costs more; that of a mirrored one this much less, usually 2.4 to 17 times."""


def in_mirror(seen: Observations) -> Observations:
    """The same markers with the video's mirror image.

    A mirrored picture shows the mirrored person: every joint as its mirror joint, in camera axes that are mirrored too.
    """
    across = np.diag([-1.0, 1, 1])
    prior = across @ seen.prior[:, mirror_index()] @ across
    if not seen.image.shape[1]:
        return replace(seen, prior=prior)
    other = mirror_landmarks()
    image = seen.image[:, other].copy()
    image[..., 0] = seen.image_size[0] - image[..., 0]
    return replace(seen, prior=prior, image=image, visibility=seen.visibility[:, other])


def both_sides(joint: np.ndarray) -> bool:
    """Whether markers (M,) sit on the left and on the right: of a lone limb the mirror image is the other limb."""
    return {"left", "right"} <= {JOINTS[j].split("_")[0] for j in joint if j >= 0}


def video_in_doubt(rotations: np.ndarray, seen: Observations, joint: np.ndarray, reprojection: float) -> bool:
    """Whether an answer (N, 24, 3, 3) of the frames that are seen contradicts its video."""
    spread, drift = camera_turn(rotations, seen.prior, seen.tracked) if holds_pelvis(joint) else (0.0, 0.0)
    limit = SHARE * max(seen.image_size)
    agree = agreement(rotations, seen.prior, seen.tracked, joint)
    return bool(agree < LEAST or spread > SPREAD_DEG or drift > DRIFT_DEG or reprojection > limit > 0)


def mirrored(seen: Evidence) -> Doubt | None:
    """Say that the video seems to be mirrored."""
    if not seen.mirror > BETTER:
        return None
    return Doubt(
        "mirrored video",
        f"The video seems to be mirrored: with its mirror image the answer costs {seen.mirror:.1f} times less. Flip "
        "the video (or the poses made from it) left to right and solve again.",
        value=seen.mirror,
        limit=BETTER,
    )
