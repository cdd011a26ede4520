"""The answers side by side, each with its energy by kind of evidence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.views.colours import rgb
from markerscope.solver.fit.confidence import same_answer
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.published.results import PaperSolve
from markerscope.solver.fit.results import Candidate, Orientation
from markerscope.widgets import palette
from markerscope.widgets.panels.hypothesis_data import Hypothesis, Term

TERMS = {
    "markers": ("markers", "distance of the markers from their places on the body"),
    "prior": ("video pose", "how far the joints are turned from the pose that the video shows"),
    "pose": ("video pose", "how far the joints are turned from the pose that the video shows"),
    "anatomical": ("anatomy", "how unusual the joint rotations are"),
    "image": ("landmarks", "distance of the landmarks in the picture from where the body puts them"),
    "shape": ("shape", "how far the body's shape and bone lengths are from the mean"),
    "placement": ("placement", "how far the markers stand from where they should on the skin"),
    "vertices": ("uncovered skin", "distance of the body's vertices from their nearest marker"),
}
"""What each term of an energy is called, and what it measures."""


@dataclass(frozen=True)
class HypothesesPicture:
    """The refined answers, best first.

    Attributes
    ----------
    cards : see there
    highest : the greatest sum of a card's terms, so that all bars have one scale
    sentence : how sure the first is, in words
    """

    cards: tuple[Hypothesis, ...]
    highest: float
    sentence: str


def hypotheses_picture(
    ranked: Orientation,
    in_use: int | None = None,
    solved: PaperSolve | None = None,
    verdict: Verdict | None = None,
) -> HypothesesPicture:
    """The answers to compare.

    Energies of answers that were left behind cannot be compared with these, so they are not here.

    Parameters
    ----------
    in_use : row of the candidate that the fit goes on from
    verdict : what the rules say of the result, where they were asked
    solved : of the published method, whose bars then show the terms of stage 4; the ranking is by the distance alone
    """
    rows = [i for i, candidate in enumerate(ranked.candidates) if candidate.refined]
    names = _term_names(ranked, rows, solved)
    colours = {name: rgb(palette.categorical(len(names))[i]) for i, name in enumerate(names)}
    first = ranked.candidates[rows[0]] if rows else None
    cards = []
    for i in rows:
        own = ranked.candidates[i]
        energies = _energies(own, solved)
        terms = tuple(Term(n, *TERMS.get(n, (n, n)), energies.get(n, 0.0), colours[n]) for n in names)
        cards.append(
            Hypothesis(
                candidate=i,
                title=f"{candidate_number(i)}: {own.part}",
                heading_deg=own.heading_deg,
                start_deg=float("nan") if solved is None else solved.yaws[own.hypothesis].start_deg,
                energy=own.energy,
                terms=terms,
                margin=own.energy / max(first.energy if first else 0.0, 1e-12),
                same_as_first=first is not None and own is not first and same_answer(first, own),
                runner_up=i == ranked.runner_up,
                in_use=i == in_use,
            )
        )
    highest = max((sum(term.value for term in card.terms) for card in cards), default=0.0)
    sentence = _sentence(ranked, verdict)
    if in_use is not None and in_use not in rows and in_use < len(ranked.candidates):
        sentence += f" The fit goes on from candidate {candidate_number(in_use)}, which the search had left behind."
    return HypothesesPicture(tuple(cards), highest, sentence)


def _energies(own: Candidate, solved: PaperSolve | None) -> dict[str, float]:
    return own.energies if solved is None else solved.yaws[own.hypothesis].markers.descent.energies


def _term_names(ranked: Orientation, rows: list[int], solved: PaperSolve | None) -> list[str]:
    found = [name for i in rows for name in _energies(ranked.candidates[i], solved)]
    known = [name for name in TERMS if name in found]
    return known + [name for name in dict.fromkeys(found) if name not in TERMS]


def _sentence(ranked: Orientation, verdict: Verdict | None) -> str:
    confidence = ranked.confidence if verdict is None else verdict.confidence
    doubts = "" if verdict is None else "".join(f" {doubt.sentence}" for doubt in verdict.doubts)
    sure = f"confidence {100 * confidence:.0f} %"
    if ranked.runner_up < 0 or not np.isfinite(ranked.margin):
        return f"No different answer was found; {sure}.{doubts}"
    other = f"{candidate_number(ranked.runner_up)}: {ranked.candidates[ranked.runner_up].part}"
    return f"The next different answer ({other}) costs {ranked.margin:.2f} times as much; {sure}.{doubts}"
