"""What the markers on each bone say together: sums over markers, so that neither their number nor order matters.

All in torch, float32, batched over B frames; ``share`` (B, 24, M) is how much each marker counts for each bone: its
skinning weights where it is seen, 0 where it is lost.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from markerscope.solver.core.skeleton import descendants

if TYPE_CHECKING:
    from torch import Tensor

_RIDGE = 4e-4
"""m2, two centimetres squared: markers nearer to each other than that say little about a rotation."""

OBSERVED, COMPARED = 35, 46
"""Numbers a bone that ``observed`` and ``compared`` return."""


def observed(share: Tensor, markers: Tensor, rest: Tensor, joints: Tensor, parents: Tensor) -> Tensor:
    """(B, 24, 35): of each bone, where its markers are, where they are at rest, and how it is turned.

    The rotation is the least-squares affine map from rest to now, held towards nothing where markers lie close.

    Parameters
    ----------
    markers, rest : (B, M, 3) m
    joints, parents : (B, 24, 3) m at rest, each joint and its parent
    """
    import torch

    outer = (markers[..., :, None] * rest[..., None, :]).flatten(2)
    square = (rest[..., :, None] * rest[..., None, :]).flatten(2)
    ones = torch.ones_like(markers[..., :1])
    sums = share @ torch.cat([ones, markers, rest, outer, square], dim=2)
    count = sums[..., :1]
    means = sums[..., 1:] / (count + 1e-3)
    now, then = means[..., :3], means[..., 3:6]
    cross = means[..., 6:15].unflatten(2, (3, 3)) - now[..., :, None] * then[..., None, :]
    spread = means[..., 15:].unflatten(2, (3, 3)) - then[..., :, None] * then[..., None, :]
    turn = cross @ _inverse(spread + _RIDGE * torch.eye(3))
    known = count / (count + 1)
    return torch.cat(
        [
            torch.log1p(count),
            known,
            known * now,
            known * (then - joints),
            turn.flatten(2),
            100 * cross.flatten(2),
            100 * _upper(spread),
            joints - parents,
        ],
        dim=2,
    )


def compared(share: Tensor, placed: Tensor, gap: Tensor, turn: Tensor, place: Tensor, extra: Tensor) -> Tensor:
    """(B, 24, 46): of each bone, and of all that hangs on it, how far its markers are from where the pose puts them.

    In the bone's own axes, so that the same error looks the same in every posture. The rotation that would mend it is
    one damped Gauss-Newton step of that joint alone.

    Parameters
    ----------
    placed, gap : (B, M, 3) m, where the pose puts the markers, and from there to where they were seen
    turn, place : (B, 24, 3, 3) and (B, 24, 3) m of the pose
    extra : (B, 24, 12), handed on
    """
    import torch

    below = torch.as_tensor(descendants(), dtype=gap.dtype)
    moment = torch.linalg.cross(placed, gap)
    square = (placed[..., :, None] * placed[..., None, :]).flatten(2)
    ones = torch.ones_like(gap[..., :1])
    own = share @ torch.cat([ones, gap, moment, placed, square], dim=2)
    return torch.cat([_mending(own, turn, place), _mending(below @ own, turn, place), extra], dim=2)


def _mending(sums: Tensor, turn: Tensor, place: Tensor) -> Tensor:
    """(B, 24, 17) of sums over markers: count, mean error, mean lever, mending rotation, how well it is known."""
    import torch

    count, force, moment, first = sums[..., :1], sums[..., 1:4], sums[..., 4:7], sums[..., 7:10]
    second = sums[..., 10:].unflatten(2, (3, 3))
    torque = moment - torch.linalg.cross(place, force)
    cross = place[..., :, None] * first[..., None, :]
    second = second - cross - cross.transpose(2, 3)
    second = second + count[..., None] * place[..., :, None] * place[..., None, :]
    inertia = second.diagonal(dim1=2, dim2=3).sum(2)[..., None, None] * torch.eye(3) - second
    back = turn.transpose(2, 3)
    inertia = back @ inertia @ turn
    step = _inverse(inertia + (_RIDGE + 1e-3 * count[..., None]) * torch.eye(3)) @ (back @ torque[..., None])
    mean = 1 / (count + 1e-3)
    lever = (back @ (first - count * place)[..., None])[..., 0] * mean
    error = (back @ force[..., None])[..., 0] * mean
    return torch.cat(
        [
            torch.log1p(count),
            count / (count + 1),
            10 * error,
            lever,
            step[..., 0],
            10 * _upper(inertia) * mean,
        ],
        dim=2,
    )


def _upper(matrix: Tensor) -> Tensor:
    """(..., 6) of a symmetric (..., 3, 3)."""
    import torch

    return torch.stack([matrix[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], dim=-1)


def _inverse(matrix: Tensor) -> Tensor:
    """(..., 3, 3) inverses by cross products: many small ones, quicker than a factorisation each."""
    import torch

    a, b, c = matrix[..., 0, :], matrix[..., 1, :], matrix[..., 2, :]
    bc = torch.linalg.cross(b, c)
    columns = torch.stack([bc, torch.linalg.cross(c, a), torch.linalg.cross(a, b)], dim=-1)
    determinant = (a * bc).sum(-1)
    return columns / determinant.clamp_min(1e-18)[..., None, None]
