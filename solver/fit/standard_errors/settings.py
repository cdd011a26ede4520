"""What can be set of the standard errors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ErrorSettings:
    """Where the standard errors are written.

    Attributes
    ----------
    columns : whether ``angles.csv`` has a column ``NAME_se`` for each angle; ``angles.json`` sums them up in any case
    """

    columns: bool = False
