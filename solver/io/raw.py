"""What a marker file holds, before units, axes and subject are settled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.markers import UpAxis


@dataclass(frozen=True)
class RawMarkers:
    """One file's trajectories in its own axes and units.

    Attributes
    ----------
    positions : (T, M, 3) file units, file axes, NaN = lost
    labels : M names as they stand in the file, subject prefixes included, possibly repeated or empty
    rate : Hz, None where the file does not say
    first_time : s, time of the first frame, None to have it follow from ``first_frame`` and the rate
    first_frame : number of frames before the first one in the file's own count
    units : unit of length the file declares, as it spells it, None where it is silent
    up : vertical axis the file declares, None where it is silent
    usual_up : vertical axis that such files have by custom, a hint for guessing
    filled : (T, M) True where the file flags a position as filled or modelled
    subjects : names of subjects the file lists apart from the labels
    assets : prefixes of labels that name a thing with markers on it, not a person
    virtual : (M,) True where the file itself lists a point as computed, not a marker
    points : (M,) number of each marker among the file's points, None where that says nothing
    notes : what was assumed or left out so far, one sentence each
    """

    positions: np.ndarray
    labels: tuple[str, ...]
    rate: float | None
    first_time: float | None = None
    first_frame: int = 0
    units: str | None = None
    up: UpAxis | None = None
    usual_up: UpAxis | None = None
    filled: np.ndarray | None = None
    subjects: tuple[str, ...] = ()
    assets: tuple[str, ...] = ()
    virtual: np.ndarray | None = None
    points: np.ndarray | None = None
    notes: tuple[str, ...] = ()
