"""A trained network's correction of what distances tell, where it beats the default on the recording at hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solver.clean.gaps import Filled, FillMethod, FillSettings

if TYPE_CHECKING:
    from solver.neural.filling import FillNetwork


def fill_by_network(network: FillNetwork) -> FillMethod:
    """A way of filling: see ``solver.neural.filling.fill_network``.

    Parameters
    ----------
    network : trained for the layout of the recording's markers
    """

    def fill(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
        """Fill by the network where it is worth it, else by the default."""
        from solver.neural.filling import fill_network

        return fill_network(positions, rate, settings, network)

    return fill
