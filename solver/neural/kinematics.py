"""Rotations and forward kinematics on batches of bodies that all differ, for torch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.core.skeleton import PARENTS

if TYPE_CHECKING:
    from torch import Tensor

SMPL = tuple(int(parent) for parent in PARENTS)
"""Parents of the 24 joints, as ``forward`` takes them."""


@cache
def _levels(parents: tuple[int, ...]) -> tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]:
    """For each depth below the root: the joints there, and where their parents are among those above."""
    levels: list[list[int]] = [[j for j, parent in enumerate(parents) if parent < 0]]
    while True:
        below = [j for j, parent in enumerate(parents) if parent in levels[-1]]
        if not below:
            break
        levels.append(below)
    return tuple((tuple(joints), tuple(above.index(parents[j]) for j in joints)) for above, joints in pairwise(levels))


def forward(rotations: Tensor, bones: Tensor, parents: tuple[int, ...] = SMPL) -> tuple[Tensor, Tensor]:
    """World rotations (B, J, 3, 3) and places (B, J, 3) m of every joint.

    Parameters
    ----------
    rotations : (B, J, 3, 3), each relative to its parent, the root's to the world
    bones : (B, J, 3) m from the parent's joint, in the parent's axes; the root's is its place in the world
    parents : J, parents before children, one root
    """
    import torch

    order = [0]
    turns, places = [rotations[:, :1]], [bones[:, :1]]
    for joints, above in _levels(parents):
        own, chosen = list(joints), list(above)
        turn, place = turns[-1][:, chosen], places[-1][:, chosen]
        places.append(place + (turn @ bones[:, own, :, None])[..., 0])
        turns.append(turn @ rotations[:, own])
        order += own
    back = np.argsort(order).tolist()
    return torch.cat(turns, 1)[:, back], torch.cat(places, 1)[:, back]


def bones_of(joints: Tensor, parents: Sequence[int] = SMPL) -> Tensor:
    """(B, J, 3) m from each joint's parent to it, of joints at rest (B, J, 3); the root's is its place."""
    above = [max(parent, 0) for parent in parents]
    bones = joints - joints[:, above]
    bones[:, 0] = joints[:, 0]
    return bones


def local_of(world: Tensor, parents: Sequence[int] = SMPL) -> Tensor:
    """(B, J, 3, 3) relative to the parent, of world rotations; the root's stays."""
    import torch

    above = [max(parent, 0) for parent in parents]
    local = world[:, above].transpose(-1, -2) @ world
    return torch.cat([world[:, :1], local[:, 1:]], 1)


def orthonormal(numbers: Tensor) -> Tensor:
    """(..., 6), the first two columns of a matrix that need not be square to each other, to (..., 3, 3) rotations."""
    import torch

    a, b = numbers[..., :3], numbers[..., 3:]
    first = a / a.norm(dim=-1, keepdim=True).clamp_min(1e-8)
    rest = b - (first * b).sum(-1, keepdim=True) * first
    second = rest / rest.norm(dim=-1, keepdim=True).clamp_min(1e-8)
    return torch.stack([first, second, torch.linalg.cross(first, second, dim=-1)], dim=-1)


def exp(vector: Tensor) -> Tensor:
    """(..., 3) rotation vectors in rad to (..., 3, 3)."""
    import torch

    angle = vector.norm(dim=-1).clamp_min(1e-8)
    axis = vector / angle[..., None]
    zero = torch.zeros_like(angle)
    x, y, z = axis.unbind(-1)
    k = torch.stack([zero, -z, y, z, zero, -x, -y, x, zero], -1).reshape(*angle.shape, 3, 3)
    eye = torch.eye(3, dtype=vector.dtype)
    return eye + angle.sin()[..., None, None] * k + (1 - angle.cos())[..., None, None] * (k @ k)


def angle_between(one: Tensor, other: Tensor) -> Tensor:
    """(...) degrees by which rotations (..., 3, 3) differ."""
    import torch

    chord = (one - other).flatten(-2).norm(dim=-1) / (2 * 2**0.5)
    return torch.rad2deg(2 * torch.asin(chord.clamp(0, 1)))
