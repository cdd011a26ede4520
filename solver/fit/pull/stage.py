"""The pull as a step of a solve, told which markers the fit uses and what was decided by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.body.bony import bony_sites
from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.pull.by_hand import decided
from markerscope.solver.fit.pull.earn import Drawn, draw
from markerscope.solver.fit.pull.results import nothing_drawn
from markerscope.solver.fit.state import Observations, State, Surface, Weights

if TYPE_CHECKING:
    from markerscope.solver.fit.settings import FitSettings


def to_landmarks(
    body: Body,
    seen: Observations,
    landmarks: Points,
    used: np.ndarray,
    frames: np.ndarray,
    state: State,
    surface: Surface,
    weights: Weights,
    settings: FitSettings,
) -> Drawn:
    """The keyframes' fit drawn to bony landmarks, as far as settings and layout say; the pull tells of all markers.

    Parameters
    ----------
    seen : all T frames and M markers
    used : (U,) columns of the markers that the fit uses
    frames : (N,) the keyframes
    state, surface, weights : their fit

    Raises
    ------
    InputError : a decision by hand names a marker or landmark that there is not
    """
    count = seen.markers.shape[1]
    fixed, allowed = decided(settings.pinned, settings.refused, bony_sites(body).names, used, count)
    if settings.landmark_pull == "off":
        return Drawn(state, surface, nothing_drawn("off", float("nan"), count))
    part = replace(seen, markers=seen.markers[:, used]).at(frames)
    drawn = draw(body, part, landmarks, state, surface, weights, fixed, allowed)
    return replace(drawn, pull=drawn.pull.over(used, count))
