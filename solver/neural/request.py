"""What ``train`` is asked for. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from markerscope.solver.core.errors import InputError

Network = Literal["agnostic", "graph", "occlusion"]
Size = Literal["compact", "published"]
NETWORKS, SIZES = get_args(Network), get_args(Size)

NAMED = ("full_body", "body_53", "body_hands")
"""Layouts that can be named: those of ``markerscope.solver.neural.layout``."""


@dataclass(frozen=True)
class TrainRequest:
    """One training.

    Attributes
    ----------
    out : file for the weights
    session : session whose layout and body the network is trained for
    layout : name of a layout instead, for anybody
    network : which one: that of the method ``neural``, for any layout; the published solver of one layout, a graph of
        markers and joints; or the published network that fills gaps
    size : of the published ones
    motions : folders of BVH and AMC files to learn from, beside made motions
    made : so many made motions of 8 s
    minutes, steps : that it may take; with steps alone to end it, the same request gives the same weights
    start : weights to begin with, of the same network, and but for ``agnostic`` of the same layout; None: those that
        ship, where there are any
    resume : whether a training that was stopped goes on
    seed : of every random choice
    """

    out: Path
    session: Path | None = None
    layout: str | None = None
    network: Network = "agnostic"
    size: Size = "compact"
    motions: tuple[Path, ...] = ()
    made: int = 120
    minutes: float = 15.0
    steps: int | None = None
    start: Path | None = None
    resume: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be trained."""
        if (self.session is None) == (self.layout is None):
            raise InputError("either a session or a layout is trained for", None, "name a session, or --layout NAME")
        if self.layout is not None and self.layout not in NAMED:
            raise InputError(f'there is no layout "{self.layout}"', "--layout", f"use {' or '.join(NAMED)}")
        if self.network not in NETWORKS:
            raise InputError(f'there is no network "{self.network}"', "--network", f"use {' or '.join(NETWORKS)}")
        if self.network == "agnostic" and self.layout == "body_hands":
            raise InputError("the network agnostic solves no fingers", "--layout", "use body_53, or another network")
        if self.network == "agnostic" and self.size != "compact":
            raise InputError("the network agnostic has one size", "--size", "leave it out, or use another network")
        if self.start is not None and self.size != "compact":
            raise InputError("the weights to begin with say the size", "--size", "leave it, or --start, out")
        if not (math.isfinite(self.minutes) and self.minutes > 0):
            raise InputError(f"{self.minutes:g} is not possible", "--minutes", "give a number above 0")
        if self.steps is not None and self.steps < 1:
            raise InputError(f"{self.steps} is not possible", "--steps", "give 1 or more")
        if self.made < 0 or (self.made == 0 and not self.motions):
            raise InputError("there is no motion to learn from", "--made", "give 1 or more, or --motions FOLDER")
        if self.seed < 0:
            raise InputError(f"{self.seed} is not possible", "--seed", "give 0 or a positive whole number")

    @property
    def checkpoint(self) -> Path:
        """Where a training that is stopped leaves what it reached."""
        return self.out.with_suffix(".checkpoint")
