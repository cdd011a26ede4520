"""Ways of filling gaps, all behind one interface."""

from __future__ import annotations

import numpy as np

from solver.clean.fill.edm import fill_edm
from solver.clean.fill.linear import fill_linear
from solver.clean.fill.pattern import fill_pattern
from solver.clean.fill.regression import fill_regression
from solver.clean.fill.rigid import fill_rigid
from solver.clean.fill.spline import fill_spline
from solver.clean.gaps import Filled, FillMethod, FillSettings
from solver.clean.request import Method

METHODS: dict[Method, FillMethod] = {
    "regression": fill_regression,
    "rigid": fill_rigid,
    "edm": fill_edm,
    "pattern": fill_pattern,
    "spline": fill_spline,
    "linear": fill_linear,
}
"""By name; a further one is added here and to ``solver.clean.request.Method``."""


def fill(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
    """Gaps filled by the method that the settings name; samples that were there stay as they were.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    rate : Hz
    """
    return METHODS[settings.method](positions, rate, settings)
