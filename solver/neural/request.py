"""What ``train`` is asked for. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from solver.errors import InputError

NAMED = ("full_body", "body_53")
"""Layouts that can be named: of ``solver.neural.layout``, those without fingers."""


@dataclass(frozen=True)
class TrainRequest:
    """One training.

    Attributes
    ----------
    out : file for the weights
    session : session whose layout and body the network is trained for
    layout : name of a layout instead, for anybody
    motions : folders of BVH and AMC files to learn from, beside made motions
    made : so many made motions of 8 s
    minutes, steps : that it may take; with steps alone to end it, the same request gives the same weights
    start : weights to begin with instead of those that ship
    resume : whether a training that was stopped goes on
    seed : of every random choice
    """

    out: Path
    session: Path | None = None
    layout: str | None = None
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
