"""What the table of candidates shows, as plain records."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CandidateRecord:
    """One way to put the markers on the body.

    Attributes
    ----------
    part : the bones that carry markers, in words
    bones : their names
    fate : how far it got
    yaw_deg, heading_deg : degrees, the yaw it started from, and which way the camera looks; NaN if there is none
    distance : mm, from the markers to the body as first laid over them; NaN if it was not
    score : what it is ranked by; NaN if not scored
    margin : score over that of the best
    covered : share 0..1 of the markers that it explains
    same_as_first : whether it is the first candidate's answer found once more
    in_use : whether the fit goes on from it
    number : by which other views call it, 0 if it has none yet
    differs : those of its bones that not every row has, the rarest first
    chain : number of the chain of bones, 0 where the method has none
    repeats : number of the chain that it nearly repeats, 0 for none
    energy : of laying it over the markers, E_S of the published method; NaN where it was not
    """

    part: str
    fate: str
    yaw_deg: float = float("nan")
    heading_deg: float = float("nan")
    distance: float = float("nan")
    score: float = float("nan")
    margin: float = float("nan")
    covered: float = float("nan")
    same_as_first: bool = False
    in_use: bool = False
    bones: tuple[str, ...] = ()
    number: int = 0
    differs: tuple[str, ...] = ()
    chain: int = 0
    repeats: int = 0
    energy: float = float("nan")


@dataclass(frozen=True)
class SearchStep:
    """One step of the selection: its name, what happened there, and the rows that are in it."""

    name: str
    help: str
    rows: tuple[int, ...]
