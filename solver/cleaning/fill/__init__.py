"""Ways of filling gaps, all behind one interface."""

from __future__ import annotations

import numpy as np

from markerscope.solver.cleaning.fill.edm import fill_edm
from markerscope.solver.cleaning.fill.linear import fill_linear
from markerscope.solver.cleaning.fill.pattern import fill_pattern
from markerscope.solver.cleaning.fill.regression import fill_regression
from markerscope.solver.cleaning.fill.rigid import fill_rigid
from markerscope.solver.cleaning.fill.spline import fill_spline
from markerscope.solver.cleaning.gaps import Filled, FillMethod, FillSettings
from markerscope.solver.cleaning.request import Method

METHODS: dict[Method, FillMethod] = {
    "regression": fill_regression,
    "rigid": fill_rigid,
    "edm": fill_edm,
    "pattern": fill_pattern,
    "spline": fill_spline,
    "linear": fill_linear,
}
"""By name; a further one is added here and to ``markerscope.solver.cleaning.request.Method``."""


def fill(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """Gaps filled by the method that the settings name; samples that were there stay as they were.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    rate : Hz
    """
    return METHODS[settings.method](positions, rate, settings)
