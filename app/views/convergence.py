"""How the energies fell, iteration by iteration, and which iterations can be shown on the body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.views.colours import RGB, rgb
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.published.results import Descent, PaperLocalization, PaperSolve, Trace
from markerscope.solver.fit.results import Candidate, Orientation
from markerscope.widgets import palette
from markerscope.widgets.plots.convergence_data import EnergyCurve
from markerscope.widgets.plots.scales import degrees

_CHAINS_SHOWN = 5
TO_THE_END = "all phases"
"""What the stage of the default method's curves that were not left behind is called."""


@dataclass(frozen=True, eq=False)
class TracedCurve(EnergyCurve):
    """A descent, and what is known of the body on the way.

    Attributes
    ----------
    candidate : its row in the orientation, -1 if it has none
    trace : poses at the iterations, where the method keeps them: then row k is iteration ``iteration[k]``
    vertex : (U,) of each marker in that stage, (0,) before any were given
    """

    candidate: int = -1
    trace: Trace | None = None
    vertex: np.ndarray | None = None

    def step(self, iteration: int) -> int:
        """The row at or before an iteration."""
        return max(0, int(np.searchsorted(self.iteration, iteration, side="right")) - 1)


def of_orientation(ranked: Orientation) -> tuple[TracedCurve, ...]:
    """The default method's descents, one a candidate; between its phases the terms are weighed anew, so curves jump."""
    colours = palette.categorical(len(ranked.candidates))
    return tuple(
        TracedCurve(
            stage=TO_THE_END if own.refined else "first phases, then left behind",
            label=f"{candidate_number(i)}: {own.part}, camera heading {degrees(own.heading_deg)}°",
            candidate=i,
            iteration=1 + np.arange(len(own.trace)),
            energy=np.array(own.trace, dtype=float),
            colour=rgb(colours[i]),
            trace=_trace(own),
            vertex=np.zeros(0, dtype=np.intp),
        )
        for i, own in enumerate(ranked.candidates)
    )


def _trace(own: Candidate) -> Trace | None:
    """The steps that a candidate kept."""
    if own.steps is None:
        return None
    count, frames = own.steps.trans.shape[:2]
    return Trace(
        iteration=1 + np.arange(count),
        energy=np.array(own.trace, dtype=float),
        frames=np.arange(frames),
        rotation_vectors=own.steps.rotation_vectors,
        trans=own.steps.trans,
        betas=own.steps.betas,
    )


def of_paper(
    found: PaperLocalization, solved: PaperSolve | None = None, ranked: Orientation | None = None
) -> tuple[TracedCurve, ...]:
    """The published method's descents: the best chains, then stages 2, 4 and 5 of every yaw."""
    curves = []
    nothing = np.zeros(0, dtype=np.intp)
    order = np.argsort([fit.chamfer for fit in found.candidates], kind="stable")[:_CHAINS_SHOWN]
    chain_row = _rows(ranked, refined=False)
    for place, row in enumerate(order):
        fit = found.candidates[row]
        label = f"chain {place + 1}, yaw {degrees(fit.yaw_deg)}°"
        colour = rgb(palette.categorical(_CHAINS_SHOWN)[place])
        curves.append(_curve("part search", label, chain_row.get(int(row), -1), fit.descent, colour, nothing))
    if solved is None:
        return tuple(curves)
    yaw_row = _rows(ranked, refined=True)
    colours = palette.categorical(len(solved.yaws))
    for i, yaw in enumerate(solved.yaws):
        label, row, colour = f"start yaw {degrees(yaw.start_deg)}°", yaw_row.get(i, -1), rgb(colours[i])
        curves.append(_curve("2: pose", label, row, yaw.pose.descent, colour, nothing))
        curves.append(_curve("4: markers on vertices", label, row, yaw.markers.descent, colour, yaw.vertex))
        if i == solved.chosen:
            curves.append(_curve("5: refinement", label, row, solved.refined.descent, colour, solved.vertex))
    return tuple(curves)


def _rows(ranked: Orientation | None, *, refined: bool) -> dict[int, int]:
    """Row in the orientation of each yaw (refined) or chain (not)."""
    if ranked is None:
        return {}
    return {own.hypothesis: i for i, own in enumerate(ranked.candidates) if own.refined == refined}


def _curve(stage: str, label: str, row: int, descent: Descent, colour: RGB, vertex: np.ndarray) -> TracedCurve:
    ended = "converged" if descent.converged else f"stopped at the cap of {descent.iterations} iterations"
    trace = descent.trace
    return TracedCurve(stage, label, trace.iteration, trace.energy, colour, ended, row, trace, vertex)
