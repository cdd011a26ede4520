"""What a standing pose cannot tell, told by the movements: which way to put the markers on the body is right."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.confidence import same_answer
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.known.body import KnownBody, spread_out
from markerscope.solver.fit.known.method import energy_of
from markerscope.solver.fit.known.track import follow
from markerscope.solver.fit.results import Candidate, Orientation

_ANSWERS = 3
KEYFRAMES = 16
CLEAR = 1.3
"""Movements that cost the next way less than so many times as much settle nothing."""


@dataclass(frozen=True)
class Resolved:
    """What the movements say of the standing trial.

    Attributes
    ----------
    rows : (P,) the static trial's candidates that were tried, the first among them
    energies : (P,) what each costs in the movements, a frame, on average
    row : of the cheapest
    trials : names of the movements that were looked at
    """

    rows: tuple[int, ...]
    energies: tuple[float, ...]
    row: int
    trials: tuple[str, ...]

    @property
    def margin(self) -> float:
        """Times as much that the next way costs; infinite where there is no other."""
        if len(self.rows) < 2:
            return float("inf")
        first, second = sorted(self.energies)[:2]
        return second / max(first, 1e-9)

    @property
    def sentence(self) -> str:
        """What to say of it."""
        if not self.trials:
            return (
                "The body was found in a standing pose alone, which tells front from back and left from right by the "
                "markers' places only: add a movement trial, or a video."
            )
        told = f"The movements ({', '.join(self.trials)})"
        if len(self.rows) < 2:
            return f"{told} had nothing to decide: the standing pose allowed one way to put the markers on the body."
        if self.margin < CLEAR:
            return (
                f"{told} do not tell two ways to put the markers on the body apart (the other costs {self.margin:.2f} "
                "times as much): front and back, or left and right, may be exchanged; give one trial a video."
            )
        how = "confirm" if self.row == self.rows[0] else "correct"
        return f"{told} {how} the standing pose's answer: the next way costs {self.margin:.1f} times as much there."


def ways(ranked: Orientation) -> tuple[int, ...]:
    """Rows of the different answers of a static trial that movements can decide between, the best first."""
    rows: list[int] = []
    for row, candidate in enumerate(ranked.candidates):
        if all(not same_answer(candidate, ranked.candidates[other]) for other in rows):
            rows.append(row)
        if len(rows) == _ANSWERS:
            break
    return tuple(rows)


def person_of(candidate: Candidate, markers: np.ndarray, off_m: float = float("nan")) -> KnownBody:
    """The person that a candidate says it is; ``markers`` (U,) are its columns in the trial."""
    placement = Points(candidate.rest, candidate.dirs, candidate.weights)
    return KnownBody(candidate.betas, placement, markers, spread_out(candidate.rotations), off_m)


def resolve(
    body: Body,
    ranked: Orientation,
    columns: np.ndarray,
    movements: dict[str, np.ndarray],
    progress: Progress = silent,
) -> Resolved:
    """Each answer of the static trial tried on some movements.

    Parameters
    ----------
    ranked, columns : the static trial's answers, and the columns of its markers in use
    movements : (T, M, 3) m, by the name of the trial
    """
    rows = ways(ranked)
    if not movements or len(rows) < 2:
        return Resolved(rows, (0.0,) * len(rows), rows[0], tuple(movements))
    energies = []
    for i, row in enumerate(rows):
        known, costs = person_of(ranked.candidates[row], columns), []
        for k, markers in enumerate(movements.values()):
            at = (i + k / len(movements)) / len(rows)
            share = part_of(progress, at, at + 1 / len(rows) / len(movements))
            try:
                tracked = follow(body, known, markers, KEYFRAMES, share)
                costs.append(energy_of(body, known, tracked, markers))
            except InputError:
                continue
        energies.append(float(np.mean(costs)) if costs else float("inf"))
    return Resolved(rows, tuple(energies), rows[int(np.argmin(energies))], tuple(movements))
