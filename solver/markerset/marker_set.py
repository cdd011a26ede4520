"""A marker set: a list of names, each with its place on the body at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.placement import Skin

FEWEST = 3
"""Names of a set without which no body can be found."""


@dataclass(frozen=True)
class SetMarker:
    """One name of a set.

    Attributes
    ----------
    name : as the laboratory writes it
    bone : index of the joint that its bone turns about
    place : (3,) m, marker centre on the set's own rest body (x to the person's left, y up, z forward)
    spread : m, how far the place varies about this: among fits of one person, or among people where it is shipped
    plate : name of the rigid plate or cluster that it is part of, empty for none
    landmark : what it was put on, in words, empty where that is not known
    """

    name: str
    bone: int
    place: tuple[float, float, float]
    spread: float
    plate: str = ""
    landmark: str = ""


@dataclass(frozen=True)
class MarkerSet:
    """Names and places.

    Attributes
    ----------
    name : of the set
    markers : at least ``FEWEST``, names unique
    betas : (S,) shape of the rest body that the places are on, bone lengths last; empty for the mean body
    origin : ``learnt`` on a trial, or ``shipped``: from published definitions
    source : the trial, or the publications
    notes : what to know about it, one sentence each
    """

    name: str
    markers: tuple[SetMarker, ...]
    betas: tuple[float, ...] = ()
    origin: str = "learnt"
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what no body can be found by."""
        names = self.names
        if len(names) < FEWEST:
            raise InputError(f"has {len(names)} markers", f"the marker set {self.name}", f"give at least {FEWEST}")
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(f"names {', '.join(twice)} twice", f"the marker set {self.name}", "names are unique")

    @property
    def names(self) -> tuple[str, ...]:
        """All U names."""
        return tuple(marker.name for marker in self.markers)

    @property
    def places(self) -> np.ndarray:
        """(U, 3) m on the set's own rest body."""
        return np.array([marker.place for marker in self.markers], dtype=float)

    @property
    def bones(self) -> np.ndarray:
        """(U,) index of the joint that each marker's bone turns about."""
        return np.array([marker.bone for marker in self.markers])

    @property
    def spreads(self) -> np.ndarray:
        """(U,) m."""
        return np.array([marker.spread for marker in self.markers], dtype=float)

    def shape(self, body: Body) -> np.ndarray:
        """(S,) shape of the rest body that the places are on; the mean where the set has another body's."""
        known = np.array(self.betas, dtype=float)
        return known if len(known) == body.shape_count else np.zeros(body.shape_count)

    def points(self, body: Body) -> Points:
        """The U markers riding on the skin below them."""
        points, _ = Skin(body, self.shape(body)).attach(self.places)
        return points

    def part(self, chosen: np.ndarray) -> MarkerSet:
        """Some of the markers, by (U,) bool or by their numbers."""
        from dataclasses import replace

        index = np.arange(len(self.markers))[chosen]
        return replace(self, markers=tuple(self.markers[i] for i in index))
