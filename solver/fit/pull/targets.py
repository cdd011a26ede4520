"""Where a marker on each palpable landmark has its centre on the rest body, and how that moves with shape."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from markerscope.solver.body.bony import BonySites, bony_sites
from markerscope.solver.body.model import Body


@dataclass(frozen=True, eq=False)
class Targets:
    """Places of L landmarks.

    Attributes
    ----------
    names : as the body has them
    bone : (L,) index of the joint whose bone each belongs to
    rest : (L, 3) m, centres of markers there on the mean rest body, the offset included
    dirs : (L, 3, S) m per unit of each shape coefficient; the offset's direction is held
    """

    names: tuple[str, ...]
    bone: np.ndarray
    rest: np.ndarray
    dirs: np.ndarray

    def shaped(self, betas: np.ndarray) -> np.ndarray:
        """(L, 3) m on the shaped rest body."""
        return self.rest + self.dirs @ betas


def targets_of(body: Body, betas: np.ndarray, offset: float) -> Targets:
    """Markers centred ``offset`` m above the skin of the landmarks of a body of shape ``betas``."""
    sites, dirs = _sites(body)
    surface = body.surface(betas)
    centre = sites.points(surface) + offset * sites.normals(body, surface)
    return Targets(sites.names, sites.bone, centre - dirs @ betas, dirs)


@lru_cache(maxsize=2)
def _sites(body: Body) -> tuple[BonySites, np.ndarray]:
    sites = bony_sites(body)
    return sites, np.einsum("lk,lkds->lds", sites.values, body.shape_dirs[sites.vertices])


@lru_cache(maxsize=2)
def skin_area(body: Body) -> float:
    """m^2 of the mean body's skin where markers can sit."""
    corners = body.template[body.faces[body.marker_mask[body.faces].all(axis=1)]]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(cross, axis=1).sum()) / 2
