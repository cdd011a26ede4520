"""Layouts to learn from: markers anywhere on the skin, as laboratories put them, or on one part of the body alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, PARTS
from markerscope.solver.synth.layouts import LAYOUTS, place_vertex

_NAMED = 0.25  # of the layouts: places of laboratories
_ON_PART = (8, 16)
_NUDGES = 5  # a hand puts a marker on one of so many places about the right one


@dataclass(frozen=True, eq=False)
class Skin:
    """Where markers may sit.

    Attributes
    ----------
    vertex : (V,) vertices of the body
    owner : (V,) the joint that each follows most
    chance : (V,) share of the skin that is nearest to each
    near : (V, 5) places about each, itself the first
    named : places of the named layout of the whole body
    """

    vertex: np.ndarray
    owner: np.ndarray
    chance: np.ndarray
    near: np.ndarray
    named: np.ndarray

    @classmethod
    def of(cls, body: Body) -> Skin:
        """The coarse skin of a body, as far as markers can sit on it, and the places that have names."""
        from scipy.spatial import cKDTree

        shape = np.zeros(body.shape_count)
        named = np.array([place_vertex(body, shape, name) for name in LAYOUTS["full_body"]])
        vertex = np.union1d(body.lod_index[body.marker_mask[body.lod_index]], named)
        corners = body.template[body.faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        area[~body.marker_mask[body.faces].all(axis=1)] = 0
        nearest = cKDTree(body.template[vertex])
        chance = np.bincount(nearest.query(corners.mean(axis=1))[1], area, minlength=len(vertex))
        near = np.asarray(nearest.query(body.template[vertex], k=_NUDGES)[1])
        owner = body.weights[vertex].argmax(axis=1)
        return cls(vertex, owner, chance / chance.sum(), near, np.searchsorted(vertex, named))

    def layouts(
        self, count: int, markers: int, rng: np.random.Generator, parts: float = 0.1
    ) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (count, markers), and (count, markers) whether there is a marker: some layouts have fewer.

        Parameters
        ----------
        parts : share of the layouts that are of one part of the body alone
        """
        chosen = np.searchsorted(np.cumsum(self.chance), rng.random((count, markers))).clip(max=len(self.vertex) - 1)
        there = np.ones((count, markers), dtype=bool)
        kind = rng.random(count)
        for row in np.flatnonzero(kind < _NAMED):
            few = rng.permutation(self.named)[:markers]
            chosen[row, : len(few)] = self.near[few, rng.integers(0, _NUDGES, len(few))]
            there[row, len(few) :] = False
        owners = [np.isin(self.owner, [INDEX[name] for name in names]) for names in PARTS.values()]
        for row in np.flatnonzero(kind > 1 - parts):
            own = np.where(owners[rng.integers(len(owners))], self.chance, 0)
            last = int(rng.integers(*_ON_PART))
            chosen[row] = rng.choice(len(own), size=markers, p=own / own.sum())
            there[row, last:] = False
        return self.vertex[chosen], there
