"""The terms of the published energies (equations 1, 2, 5 and 8), each a mean, on tensors.

Lost markers are masked out: means over markers and frames are over those that were seen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from markerscope.solver.fit.published.sequence import Sequence

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

_CHUNK = 1 << 20
"""Distances held at a time: what fits the processor's cache."""


def one_way_chamfer(sequence: Sequence, rotations: Tensor, betas: Tensor, trans: Tensor, vertices: Tensor) -> Tensor:
    """Equation 1: mean squared distance (m^2) of the markers to the nearest of ``vertices`` in each frame.

    Which vertex is nearest does not change over a small step, so only the vertices that are nearest to some marker
    are posed with derivatives.
    """
    import torch

    with torch.no_grad():
        posed = sequence.posed(rotations.detach().float(), betas.detach().float(), trans.detach().float(), vertices)
        nearest = nearest_points(posed, sequence.markers.float())[sequence.seen]
        used, column = torch.unique(nearest, return_inverse=True)
    frame = sequence.seen.nonzero()[:, 0]
    points = sequence.posed(rotations, betas, trans, vertices[used])
    return (points[frame, column] - sequence.markers[sequence.seen]).square().sum(dim=1).mean()


def two_way_chamfer(posed: Tensor, markers: Tensor, seen: Tensor) -> tuple[float, float]:
    """Two-way Chamfer distance (m^2) of markers (N, U, 3) and posed vertices (N, V, 3), and its one-way part.

    The other part is the mean, over frames and vertices, of the squared distance to the nearest marker; frames without
    markers have none.
    """
    import torch

    there, back, frames = 0.0, 0.0, 0
    for chunk in _frames(posed, markers):
        here = seen[chunk]
        distance = _squared(posed[chunk], markers[chunk])
        there += float(distance.amin(dim=2)[here].sum())
        some = here.any(dim=1)
        to_marker = distance.masked_fill(~here[:, :, None], torch.inf).amin(dim=1)
        back += float(to_marker[some].mean(dim=1).sum())
        frames += int(some.sum())
    one_way = there / max(int(seen.sum()), 1)
    return one_way + back / max(frames, 1), one_way


def shape_term(betas: Tensor, reference: Tensor) -> Tensor:
    """Equation 2: mean squared difference of the shape coefficients."""
    return (betas - reference).square().mean()


def pose_term(rotations: Tensor, reference: Tensor) -> Tensor:
    """Equation 5: mean squared difference of the entries of the joints' matrices (N, 24, 3, 3), less the root's."""
    return (rotations[:, 1:] - reference[:, 1:]).square().mean()


def marker_term(points: Tensor, markers: Tensor, seen: Tensor, offset: float) -> Tensor:
    """Equation 8: mean squared difference (m^2) from ``offset`` of each marker's distance to its vertex (N, U, 3)."""
    # The root of zero has no derivative.
    distance = ((points - markers)[seen].square().sum(dim=1) + 1e-16).sqrt()
    return (distance - offset).square().mean()


def summed_distances(posed: Tensor, markers: Tensor, use: Tensor) -> Tensor:
    """(U, V) m, sum over the frames in ``use`` (N, U) of each marker's distance to each vertex (equation 6)."""
    total = posed.new_zeros(markers.shape[1], posed.shape[1])
    for chunk in _frames(posed, markers):
        distance = _squared(posed[chunk], markers[chunk].to(posed.dtype)).clamp_min_(0).sqrt_()
        total += (distance * use[chunk, :, None]).sum(dim=0)
    return total


def nearest_points(posed: Tensor, markers: Tensor) -> Tensor:
    """(N, U) which of the posed vertices (N, V, 3) is nearest to each marker."""
    import torch

    return torch.cat([_compared(posed[chunk], markers[chunk])[0].argmin(dim=2) for chunk in _frames(posed, markers)])


def _squared(points: Tensor, markers: Tensor) -> Tensor:
    """(n, U, V) m^2, every marker to every point."""
    less, own = _compared(points, markers)
    return less.add_(own)


def _compared(points: Tensor, markers: Tensor) -> tuple[Tensor, Tensor]:
    """(n, U, V) m^2, squared distances less what is the same for all points (n, U, 1), and that.

    About the points' middle, so that single precision suffices.
    """
    import torch

    centre = points.mean(dim=1, keepdim=True)
    points, markers = points - centre, markers - centre
    less = torch.baddbmm(points.square().sum(dim=2)[:, None], markers, points.transpose(1, 2), alpha=-2)
    return less, markers.square().sum(dim=2, keepdim=True)


def _frames(posed: Tensor, markers: Tensor) -> list[slice]:
    step = max(1, _CHUNK // (posed.shape[1] * markers.shape[1]))
    return [slice(i, i + step) for i in range(0, len(posed), step)]
