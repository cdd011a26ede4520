"""How long work reports on itself, without knowing who listens."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with the fraction done, 0..1, and what is being done. It may raise ``Cancelled``."""


def silent(fraction: float, text: str) -> None:
    """Report to nobody."""


def part_of(progress: Progress, start: float, stop: float) -> Progress:
    """A reporter for a sub-task that fills ``start..stop`` of ``progress``."""
    return lambda fraction, text: progress(start + (stop - start) * fraction, text)
