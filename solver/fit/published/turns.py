"""Rotations as free parameters: six numbers each (the first two columns of a matrix), and yaw."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any


def to_six(matrix: Tensor) -> Tensor:
    """(..., 3, 3) rotation matrices to (..., 3, 2)."""
    return matrix[..., :2].clone()


def from_six(six: Tensor) -> Tensor:
    """(..., 3, 2) to (..., 3, 3): the columns made orthonormal (Gram-Schmidt), the third their cross product."""
    import torch

    first = torch.nn.functional.normalize(six[..., 0], dim=-1)
    second = six[..., 1] - (first * six[..., 1]).sum(dim=-1, keepdim=True) * first
    second = torch.nn.functional.normalize(second, dim=-1)
    return torch.stack([first, second, torch.linalg.cross(first, second)], dim=-1)


def about_vertical(angle: Tensor) -> Tensor:
    """(...) rad to (..., 3, 3) turns about z."""
    import torch

    cosine, sine = torch.cos(angle), torch.sin(angle)
    zero, one = torch.zeros_like(angle), torch.ones_like(angle)
    rows = (cosine, -sine, zero, sine, cosine, zero, zero, zero, one)
    return torch.stack(rows, dim=-1).reshape(*angle.shape, 3, 3)


def turned(root: Tensor, rotations: Tensor) -> Tensor:
    """(N, 24, 3, 3) with the root's rotation (N, 3, 3) replaced."""
    import torch

    return torch.cat([root[:, None], rotations[:, 1:]], dim=1)
