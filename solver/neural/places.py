"""Whether weights that were trained for one layout are used with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.neural.layout import Layout
from markerscope.solver.neural.weights import Card

_NEAR = 0.06
"""m on the mean body: a marker as far as this from a trained place is the same one, put on by another hand."""
_SHARE = 0.8
"""Of the session's markers that must have a trained place; where each place has weights of its own, of these."""


def places_of(body: Body, vertex: np.ndarray) -> dict[str, Any]:
    """What a card says of the layout: the body, and the vertex below each marker."""
    return {"body": body.digest, "vertex": [int(v) for v in vertex]}


def check_places(card: Card, body: Body, vertex: np.ndarray, path: Path | None) -> None:
    """Refuse weights that were trained for another layout.

    Parameters
    ----------
    vertex : (M,) vertices below the markers that there are
    path : of the weights, for the message

    Raises
    ------
    InputError : they are for another layout, or for another body
    """
    trained = card.config.get("places")
    if not trained:
        return
    check_body(trained["body"], body, path)
    known = len(same_places(body, vertex, np.array(trained["vertex"], int))[0])
    if known < _SHARE * len(vertex):
        raise _another(f"only {known} of these {len(vertex)} markers sit where its {len(trained['vertex'])} do", path)


def columns_of(body: Body, vertex: np.ndarray, layout: Layout, path: Path | None) -> np.ndarray:
    """(L,) which of the markers each of a layout's is, -1 for one that there is none of.

    Parameters
    ----------
    vertex : (M,) vertices below the markers that there are
    path : of the weights, for the message

    Raises
    ------
    InputError : the layout is another, or on another body
    """
    check_body(layout.body, body, path)
    own, trained = same_places(body, vertex, layout.vertex)
    if len(own) < _SHARE * len(layout):
        raise _another(f"only {len(own)} of its {len(layout)} markers sit where these {len(vertex)} do", path)
    columns = np.full(len(layout), -1, dtype=np.intp)
    columns[trained] = own
    return columns


def _another(why: str, path: Path | None) -> InputError:
    what = f"was trained for another layout: {why}"
    return InputError(what, path, "train on this session, or leave --weights out")


def check_body(trained: str, body: Body, path: Path | None) -> None:
    """Refuse weights whose layout is on the vertices of a body of another digest."""
    if trained != body.digest:
        raise InputError("was trained on another body model", path, "solve with that body, or train on this one")


def same_places(body: Body, vertex: np.ndarray, trained: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The markers that have a trained place near, each another, and these places: two rows of indices."""
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    apart = cdist(body.template[vertex], body.template[trained])
    rows, columns = linear_sum_assignment(np.minimum(apart, 10 * _NEAR))
    near = apart[rows, columns] < _NEAR
    return rows[near], columns[near]
