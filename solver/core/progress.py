"""How long work reports on itself, without knowing who listens."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

Progress = Callable[[float, str], None]
"""Called with the fraction done, 0..1, and what is being done. It may raise ``Cancelled``."""


def silent(fraction: float, text: str) -> None:
    """Report to nobody."""


@dataclass(frozen=True)
class Found:
    """A piece of a result that is known before the rest.

    Attributes
    ----------
    kind : what it is: "candidate", "chain", "yaw", "iteration"
    index : which one, counted from 0
    values : what is known of it: numbers, text, small arrays
    stage, key : of the stage that is at work; who runs the stages fills them in
    """

    kind: str
    index: int
    values: Mapping[str, Any]
    stage: str = ""
    key: str = ""


def tell(progress: Progress, found: Found) -> None:
    """Report something found on the way to a listener that cares (has a method ``found``); others hear nothing."""
    listener = getattr(progress, "found", None)
    if listener is not None:
        listener(found)


class Pieces(Protocol):
    """Where pieces of an unfinished result are kept, so that work which is stopped can go on from them."""

    def get(self, name: str, declared: Any) -> Any | None:
        """A piece of the declared type; None where it is not there."""

    def keep(self, name: str, value: Any) -> None:
        """Keep a piece."""


def pieces_of(progress: Progress) -> Pieces | None:
    """Where who runs the stages keeps pieces of this one's result; None where nobody does."""
    return getattr(progress, "pieces", None)


def part_of(progress: Progress, start: float, stop: float) -> Progress:
    """A reporter for a sub-task that fills ``start..stop`` of ``progress``; what is found on the way is passed on."""
    return _Part(progress, start, stop)


@dataclass(frozen=True)
class _Part:
    whole: Progress
    start: float
    stop: float

    def __call__(self, fraction: float, text: str) -> None:
        self.whole(self.start + (self.stop - self.start) * fraction, text)

    def found(self, found: Found) -> None:
        tell(self.whole, found)

    @property
    def pieces(self) -> Pieces | None:
        return pieces_of(self.whole)
