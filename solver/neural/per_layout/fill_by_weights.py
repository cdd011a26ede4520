"""A trained network's correction of what distances tell, where it beats the default on the recording at hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.cleaning.gaps import Filled, FillMethod, FillSettings
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers

if TYPE_CHECKING:
    from markerscope.solver.neural.per_layout.filling import FillNetwork

_SHARE = 0.8
"""Of the network's markers that have to be in a recording."""


def fill_by_weights(path: Path, markers: Markers) -> FillMethod:
    """A way of filling a recording: by weights as ``train`` writes them, the markers told by their labels.

    Raises
    ------
    InputError : the file holds no such weights, or they are for other markers
    """
    from markerscope.solver.neural.per_layout.fill_file import load_fill_network

    network, _ = load_fill_network(path)
    layout = network.layout
    column = {label: m for m, label in enumerate(markers.labels)}
    there = [label for label in layout.labels if label in column]
    if len(there) < _SHARE * len(layout):
        lost = next(label for label in layout.labels if label not in column)
        raise InputError(
            f"was trained for other markers: {len(there)} of its {len(layout)} have a name in this recording, "
            f"{lost} has none",
            path,
            "train one on a solved session of these markers, or leave --fill network out",
        )
    # A marker that the recording does not have gets a column of its own, in which it is lost.
    columns = np.array([column.get(label, -1) for label in layout.labels])
    columns[columns < 0] = len(markers.labels) + np.arange((columns < 0).sum())
    return fill_by_network(replace(network, layout=replace(layout, columns=columns)))


def fill_by_network(network: FillNetwork) -> FillMethod:
    """A way of filling: see ``markerscope.solver.neural.per_layout.filling.fill_network``.

    Parameters
    ----------
    network : trained for the layout of the recording's markers; columns beyond the recording's are of lost markers
    """

    def fill(positions: np.ndarray, rate: float, settings: FillSettings) -> Filled:
        """Fill by the network where it is worth it, else by the default."""
        from markerscope.solver.neural.per_layout.filling import fill_network

        frames, count = positions.shape[:2]
        more = max(0, int(network.layout.columns.max()) + 1 - count)
        lost = np.full((frames, more, 3), np.nan)
        found = fill_network(np.concatenate([positions, lost], axis=1), rate, settings, network)
        return replace(found, positions=found.positions[:, :count], filled=found.filled[:, :count])

    return fill
