"""What the answers side by side show, as plain records."""

from __future__ import annotations

from dataclasses import dataclass

Rgb = tuple[int, int, int]


@dataclass(frozen=True)
class Term:
    """One part of an energy: its name, what it is called and measures, its value and its colour."""

    name: str
    title: str
    help: str
    value: float
    colour: Rgb


@dataclass(frozen=True)
class Hypothesis:
    """One answer.

    Attributes
    ----------
    candidate : its row in the orientation, by which it is pinned; given back by the signals
    title : the part of the body, in words
    heading_deg : degrees, which way the camera looks about the vertical; 0 along the lab's first axis
    energy : what the answers are ranked by
    terms : that it is made of, all answers in the same order
    margin : energy over the first one's: 1 for that itself
    same_as_first : whether it is the first answer found once more
    runner_up : whether it is the best different answer
    in_use : whether the fit goes on from it
    start_deg : degrees, the yaw added before it was solved; NaN where the method has none
    """

    candidate: int
    title: str
    heading_deg: float
    energy: float
    terms: tuple[Term, ...]
    margin: float
    same_as_first: bool = False
    runner_up: bool = False
    in_use: bool = False
    start_deg: float = float("nan")
