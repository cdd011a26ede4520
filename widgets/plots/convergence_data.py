"""What the view of convergence shows, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class EnergyCurve:
    """One descent.

    Attributes
    ----------
    stage : of the solve, in words; only curves of one stage have the same energy
    label : which candidate or yaw
    iteration, energy : (n,)
    colour : of the candidate
    ended : how it ended, in words, "" where that is not known
    """

    stage: str
    label: str
    iteration: np.ndarray
    energy: np.ndarray
    colour: tuple[int, int, int]
    ended: str = ""
