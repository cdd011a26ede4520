"""Markers where they were seen, robust."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.kinematics import blended_turn, place_points, shape_jacobian
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks, group_jacobian, groups
from markerscope.solver.fit.state import Weights
from markerscope.solver.fit.terms.term import Estimate


def marker_residual(
    where: np.ndarray, target: np.ndarray, present: np.ndarray, weights: Weights
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, M, 3) m between where markers should be and where they were seen; Geman-McClure weight and cost (N, M)."""
    residual = where - target
    squared = np.einsum("nmk,nmk->nm", residual, residual)
    factor = 1 / (1 + squared / weights.marker_kernel**2)
    information = present / weights.marker**2
    return residual, information * factor**2, information * squared * factor


@dataclass(frozen=True, eq=False)
class Markers:
    """How far each marker is from its place on the body.

    Attributes
    ----------
    target : (N, M, 3) m, lab frame, finite
    present : (N, M) False where the marker was lost
    """

    target: np.ndarray
    present: np.ndarray
    name: str = "markers"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        where = place_points(at.state.placement, at.links, at.state.pose.betas)
        return float(marker_residual(where, self.target, self.present, at.weights)[2].sum()) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        points, betas, links = at.state.placement, at.state.pose.betas, at.links
        where = place_points(points, links, betas)
        residual, information, _ = marker_residual(where, self.target, self.present, at.weights)
        root = np.sqrt(information)[..., None]
        by_shape = root[..., None] * shape_jacobian(at.body, points, links) if at.weights.free_shape else None
        by_place = root[..., None] * blended_turn(points, links) if at.weights.free_placement else None
        scaled = root * residual
        frames = len(residual)
        for group in groups(points.weights):
            p = group.points
            rows = root[:, p, :, None] * group_jacobian(points, group, links, betas)
            flat = rows.reshape(frames, -1, rows.shape[3])
            shape_rows = None if by_shape is None else by_shape[:, p].reshape(frames, flat.shape[1], -1)
            sums.add_rows(group, flat, scaled[:, p].reshape(frames, -1), at.unknowns.shape, shape_rows)
            if by_place is not None:
                cross = np.swapaxes(rows, 2, 3) @ by_place[:, p]  # (F, p, C, 3)
                columns = (at.unknowns.placement.start + 3 * p[:, None] + np.arange(3)).ravel()
                block = cross.transpose(0, 2, 1, 3).reshape(frames, len(group.columns), -1)
                for there, of in group.runs:
                    sums.h_fs[:, there, columns] += block[:, of]
        if by_place is not None:
            _add_placement(sums, at, by_place, by_shape, scaled)


def _add_placement(
    sums: NormalEquations, at: Estimate, by_place: np.ndarray, by_shape: np.ndarray | None, scaled: np.ndarray
) -> None:
    """What the markers say of their own places, and of the shape together with them."""
    placement, shape = at.unknowns.placement, at.unknowns.shape
    transposed = by_place.transpose(1, 3, 0, 2).reshape(by_place.shape[1], 3, -1)  # (M, 3, F * 3)
    own = transposed @ np.swapaxes(transposed, 1, 2)
    diagonal_blocks(sums.h_ss[None, placement, placement])[:, 0] += own
    target = scaled.transpose(1, 0, 2).reshape(len(own), -1, 1)
    sums.g_s[placement] += (transposed @ target).ravel()
    if by_shape is not None:
        shape_rows = by_shape.transpose(1, 0, 2, 3).reshape(len(own), -1, by_shape.shape[3])
        cross = (transposed @ shape_rows).reshape(-1, by_shape.shape[3])
        sums.h_ss[placement, shape] += cross
        sums.h_ss[shape, placement] += cross.T
