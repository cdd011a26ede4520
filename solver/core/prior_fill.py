"""What stands in a pose prior where the video lost the person."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import slerp


def fill_lost(rotations: np.ndarray, tracked: np.ndarray, time: np.ndarray | None = None) -> np.ndarray:
    """Poses for every frame: the nearest tracked one at the ends, a slerp between neighbours in the middle.

    Milef et al. (2024), appendix D. The filled poses are no observations: keep ``tracked`` beside them.

    Parameters
    ----------
    rotations : (F, J, 3, 3); what stands in lost frames is not looked at and may be NaN
    tracked : (F,) True where a pose was observed, at least once
    time : (F,) s, ascending; equal steps where not given

    Returns
    -------
    (F, J, 3, 3), unchanged where ``tracked``
    """
    seen = np.flatnonzero(tracked)
    if not len(seen):
        raise ValueError("no frame is tracked")
    time = np.arange(len(tracked), dtype=float) if time is None else time
    filled = slerp(rotations[seen], time[seen], time)
    filled[seen] = rotations[seen]
    return filled
