"""The gait page of a solve, where the body took steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.angles.angles import world_rotations
from markerscope.solver.body.model import Body
from markerscope.solver.cycles.curve import cut_all
from markerscope.solver.cycles.cycle import gait_cycles, judged
from markerscope.solver.cycles.gait import gait_curves, progression
from markerscope.solver.events.feet import feet_of_body
from markerscope.solver.events.steps import find_steps
from markerscope.solver.figures.drawing import Page
from markerscope.solver.figures.gait_page import gait_page
from markerscope.solver.fit.results import FittedMotion

_LEAST_FRAMES = 10


@dataclass(frozen=True, eq=False)
class GaitReport:
    """The page, and what is to be said about it, one sentence each."""

    page: Page
    notes: tuple[str, ...]


def gait_of(motion: FittedMotion, body: Body, rate: float, title: str) -> GaitReport | None:
    """Mean curves over the whole gait cycles of a solved body; None where there is none.

    Parameters
    ----------
    rate : Hz
    """
    if len(motion.time) < _LEAST_FRAMES:
        return None
    turn = world_rotations(motion.rotations)
    landmarks, rest = body.landmarks(motion.betas), body.joints(motion.betas)
    feet = feet_of_body(motion.time, rate, turn, motion.joints, rest, landmarks)
    steps = find_steps(feet, body=True)
    cycles = gait_cycles(steps.events)
    if not cycles:
        return None
    ahead, way = progression(feet)
    curves = gait_curves(motion.time, turn, landmarks, rest, ahead)
    known = np.stack([np.isfinite(curve.values) for curve in curves], axis=1)
    cycles = judged(cycles, motion.time, known)
    cut = cut_all([(title, curves, cycles)])
    if not cut:
        return None
    notes = (
        f"{len(steps.events)} foot strikes and offs were told by the solved body.",
        f"Pelvis and feet are read against the direction of progression ({way}); signs as in Plug-in Gait.",
        "The angles are not filtered.",
        *(f"The {c.name} cycle is left out: {c.why_not}." for c in cycles if not c.used),
        *steps.notes,
    )
    return GaitReport(gait_page(cut, title), notes)
