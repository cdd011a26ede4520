"""Where labelled markers are known to sit: a vertex of the body, or only a bone of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import BONES, INDEX
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.state import Surface

FEWEST = 3
_BONE = {**INDEX, **{bone: INDEX[joint] for joint, bone in BONES.items()}}
"""Names of bones, and of joints where no bone is called the same: ``left_foot`` is the foot, not its toes."""
_REMEDY = 'give a JSON object such as {"LKNE": "left_shank", "C7": 5120}'


@dataclass(frozen=True)
class Places:
    """What is known of the markers in use.

    Attributes
    ----------
    markers : (U,) index of each among the recording's markers, ascending
    vertex : (U,) vertex it sits on, -1 where only the bone is known
    bone : (U,) joint of the bone it sits on
    notes : labels that were passed over, one sentence each
    """

    markers: np.ndarray
    vertex: np.ndarray
    bone: np.ndarray
    notes: tuple[str, ...] = ()


def read_places(path: str | Path) -> dict[str, str | int]:
    """Read a JSON object from labels to bones or vertices.

    Raises
    ------
    InputError : it cannot be read, or is something else
    """
    from markerscope.solver.io.text import decode, read_bytes

    try:
        data: Any = json.loads(decode(read_bytes(path), path))
    except (ValueError, RecursionError) as error:
        raise InputError("is not JSON", path, _REMEDY) from error
    if not isinstance(data, dict):
        raise InputError("holds no labels", path, _REMEDY)
    return data


def places_of(body: Body, labels: tuple[str, ...], known: Mapping[str, str | int], where: str = "the labels") -> Places:
    """The places of those of the recording's markers that the mapping knows.

    Parameters
    ----------
    labels : (M) of the recording
    known : label -> vertex index, or name of a bone (``left_shank``) or of the joint it turns about (``left_knee``)
    where : what to call the mapping in messages

    Raises
    ------
    InputError : the mapping names no bone or vertex of this body, or too few of these markers
    """
    found = {label: _place(body, label, place, where) for label, place in known.items()}
    used = [m for m, label in enumerate(labels) if label in found]
    if len(used) < FEWEST:
        some = ", ".join(labels[:5])
        what = f"names only {len(used)} of the {len(labels)} recorded markers ({some}...)"
        raise InputError(what, where, f"give the places of at least {FEWEST} of them")
    absent = [label for label in known if label not in labels]
    unplaced = [label for label in labels if label not in found]
    notes = tuple(
        f"{sentence}: {', '.join(names[:8])}{f' and {len(names) - 8} more' if len(names) > 8 else ''}."
        for sentence, names in (
            ("Markers without a known place were left out", unplaced),
            ("Not among the recorded markers", absent),
        )
        if names
    )
    vertex, bone = np.array([found[labels[m]] for m in used]).T
    return Places(np.array(used), vertex, bone, notes)


def _place(body: Body, label: str, place: object, where: str) -> tuple[int, int]:
    """Vertex (-1 if unknown) and bone."""
    if isinstance(place, str):
        if place not in _BONE:
            raise InputError(f'"{place}" of {label} is no bone', where, "use names such as left_shank or left_knee")
        return -1, _BONE[place]
    if isinstance(place, bool) or not isinstance(place, int | np.integer):
        raise InputError(f"the place of {label} is neither a bone's name nor a vertex", where, _REMEDY)
    count = len(body.template)
    if not 0 <= place < count:
        raise InputError(f"{label} is on vertex {place}", where, f"this body's vertices are 0 to {count - 1}")
    return int(place), int(body.weights[int(place)].argmax())


def first_guess(body: Body, betas: np.ndarray, places: Places, height: float) -> tuple[Points, Surface]:
    """Markers ``height`` m above their vertices; those of which only the bone is known in the middle of its skin."""
    skin = Skin(body, betas)
    points, surface = skin.on_vertices(np.maximum(places.vertex, 0), height)
    rest, dirs, weights = points.rest.copy(), points.dirs.copy(), points.weights.copy()
    below, normal = surface.point.copy(), surface.normal.copy()
    for i in np.flatnonzero(places.vertex < 0):
        own = bone_vertices(body, int(places.bone[i]))
        rest[i], dirs[i] = body.template[own].mean(0), body.shape_dirs[own].mean(0)
        weights[i] = np.eye(weights.shape[1])[places.bone[i]]
        below[i] = skin.surface[own].mean(0) - height * normal[i]
    return Points(rest, dirs, weights), Surface(below, normal)


def bone_vertices(body: Body, bone: int) -> np.ndarray:
    """Vertices that follow a bone more than any other and can carry a marker; all of its vertices if none can."""
    own = body.weights.argmax(axis=1) == bone
    allowed = np.flatnonzero(own & body.marker_mask)
    return allowed if len(allowed) else np.flatnonzero(own)
