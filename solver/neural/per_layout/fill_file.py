"""A fill network in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.solver.cleaning.fill import METHODS
from markerscope.solver.core.errors import InputError
from markerscope.solver.neural.layout import Layout
from markerscope.solver.neural.per_layout.filling import FillNetwork
from markerscope.solver.neural.per_layout.occlusion import Occlusion
from markerscope.solver.neural.weights import Card, load_weights, save_weights


def save_fill_network(path: str | Path, found: FillNetwork, card: Card) -> Card:
    """Write it; the card's network, configuration and layout are filled in."""
    config = {
        "network": found.network.config(),
        "layout": found.layout.plain(),
        "rest": found.rest.tolist(),
        "start": found.start,
    }
    own = {"network": found.network.kind, "config": config, "layout": found.layout.digest}
    return save_weights(path, found.params, Card(**vars(card) | own | {"labels": found.layout.labels}))


def load_fill_network(path: str | Path, layout: Layout | None = None) -> tuple[FillNetwork, Card]:
    """Read it.

    Parameters
    ----------
    layout : that it is to be used for; None takes the one that it was trained for

    Raises
    ------
    InputError : the file holds no fill network, or one for another layout
    """
    digest = None if layout is None else layout.digest
    params, card = load_weights(path, network=Occlusion.kind, layout=digest)
    try:
        network = Occlusion.from_config(card.config["network"])
        own, start = Layout.from_plain(card.config["layout"]), str(card.config["start"])
        rest = np.array(card.config["rest"], dtype=float)
        wanted = {name: value.shape for name, value in network.initial(0).items()}
        method = next(name for name in METHODS if name == start)
        if wanted != {name: value.shape for name, value in params.items()}:
            raise ValueError("shapes")
    except (KeyError, ValueError, TypeError, IndexError, StopIteration) as error:
        raise InputError("is damaged: its card does not fit its weights", path, "train it again") from error
    return FillNetwork(network, params, layout or own, rest, method), card
