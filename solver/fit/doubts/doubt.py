"""A doubt about a result, and what the rules look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.second.results import LimbAnswer

CAP = 0.6
"""A result that a rule speaks against is said with no more confidence than this."""
_LISTED = 8


@dataclass(frozen=True)
class Doubt:
    """What one rule has against a result.

    Attributes
    ----------
    kind : which rule, one of ``rules.RULES``' names, or "second answer"
    sentence : what, how much, and what to do
    markers : columns of the markers it is about; empty where it is about the whole
    value, limit : the figure and what it should not pass, in the unit that the sentence has; NaN where there is none
    """

    kind: str
    sentence: str
    markers: tuple[int, ...] = ()
    value: float = float("nan")
    limit: float = float("nan")


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the rules look at: one solve, its markers and its video on the markers' clock.

    Attributes
    ----------
    labels : M names
    joint : (M,) bone of each marker, -1 where it was not used
    residual : (T, M) m, distance of each marker from its place; NaN where lost or not used
    skin : (M,) m, mean distance of each marker from the skin, NaN where unknown
    m2s : m, mean of the same over all samples in use
    affinity : (M, M) m, standard deviation of each pair's distance
    rotations : (T, 24, 3, 3) as fitted, root in the lab
    video : (T, 24, 3, 3) the video's, root in the camera's frame
    tracked : (T,) True where the video tracked the person
    reprojection : px, median distance of the video's landmarks from the body's; NaN without landmarks
    image_size : (width, height) px
    sync_confidence : 0..1, of the offset between the clocks; 1 where it was given
    sync_lead : nats by which the offset is ahead of every other that was tried; infinite where it was given
    sync_rival : s, the best other offset; NaN where none was judged
    still : columns of markers that stand while the others move
    cloud : (M,) number of the cloud that each marker belongs to, 0 the largest; -1 for none
    taken : number of the cloud that was solved
    far : columns of markers that fit no place on the body
    mirror : times the energy that the answer costs of what it does with the video mirrored; NaN where not tried
    span : m, greatest distance between two markers in use; NaN where unknown
    second : second answers for single limbs
    said : what the ranking of the answers itself has to say
    """

    labels: tuple[str, ...]
    joint: np.ndarray
    residual: np.ndarray
    skin: np.ndarray
    m2s: float
    affinity: np.ndarray
    rotations: np.ndarray
    video: np.ndarray
    tracked: np.ndarray
    reprojection: float
    image_size: tuple[int, int]
    sync_confidence: float
    sync_lead: float
    still: np.ndarray
    cloud: np.ndarray
    taken: int
    far: np.ndarray
    mirror: float = float("nan")
    span: float = float("nan")
    sync_rival: float = float("nan")
    second: tuple[LimbAnswer, ...] = ()
    said: tuple[str, ...] = ()


def named(labels: Sequence[str], columns: Sequence[int] | np.ndarray) -> str:
    """Some markers by name, not more than a sentence can hold."""
    names = [labels[m] for m in columns]
    if len(names) > _LISTED:
        return f"{', '.join(names[: _LISTED - 1])} and {len(names) - _LISTED + 1} more"
    return ", ".join(names)


def plural(count: int, what: str) -> str:
    """``1 marker``, ``2 markers``."""
    return f"{count} {what}{'' if count == 1 else 's'}"
