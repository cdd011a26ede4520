"""Where the body is and how it is turned, told from its markers, so that a network sees it always from the front."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.neural.layout import Layout

if TYPE_CHECKING:
    from torch import Tensor

Frame = Literal["waist", "left_wrist", "right_wrist"]

_WAIST = ("left_asis", "right_asis", "left_psis", "right_psis")
_TRUNK = {"pelvis": 1.0, "spine1": 1.0, "spine2": 0.7, "spine3": 0.5, "left_collar": 0.2, "right_collar": 0.2}
_THIGHS = {"left_hip": 0.2, "right_hip": 0.2}
_ELSE = 0.02
"""Weight of any other marker: it decides only where there are none better."""


def frame_weights(layout: Layout, frame: Frame = "waist") -> np.ndarray:
    """(M,) how much each marker counts where a frame is laid over the markers."""
    if frame == "waist":
        share = {INDEX[name]: weight for name, weight in (_TRUNK | _THIGHS).items()}
    else:
        side = frame.partition("_")[0]
        share = {INDEX[f"{side}_wrist"]: 1.0, INDEX[f"{side}_elbow"]: 0.1}
    return np.array([share.get(int(joint), _ELSE) for joint in layout.joint])


def waist_markers(layout: Layout) -> tuple[int, ...] | None:
    """Indices of the four markers of the waist, left front, right front, left back, right back, where all are named."""
    where = {label: i for i, label in enumerate(layout.labels)}
    return tuple(where[name] for name in _WAIST) if all(name in where for name in _WAIST) else None


def align(markers: Tensor, layout: Layout, rest: Tensor, frame: Frame = "waist") -> tuple[Tensor, Tensor, Tensor]:
    """Markers in a frame that rides with the waist, or with a hand.

    The waist's is made of its four markers where the layout names them, as published: across from right to left,
    forward from the back ones to the front ones. Otherwise, in frames where one of them is lost, and for a hand, it is
    the frame in which the markers lie best over ``rest``, those of the trunk (the hand) weighing most.

    Parameters
    ----------
    markers : (B, M, 3) m in the lab, NaN = lost
    layout : of these markers
    rest : (M, 3) or (B, M, 3) m, the markers on the body at rest (y up, facing +z, the left side at +x)

    Returns
    -------
    local : (B, M, 3) m, NaN where lost
    R_lab_local : (B, 3, 3)
    t : (B, 3) m, the frame's origin in the lab
    """
    import torch

    weights = torch.as_tensor(frame_weights(layout, frame), dtype=markers.dtype)
    seen = torch.isfinite(markers).all(-1)
    waist = waist_markers(layout) if frame == "waist" else None
    if waist is None:
        R, t = over_rest(markers, seen, rest, weights)
    else:
        R, t = _of_waist(markers, waist)
        whole = seen[:, list(waist)].all(1)
        if not whole.all():
            # What the four markers would have said at rest, carried by the others.
            R_rest, t_rest = _of_waist(rest if rest.ndim == 3 else rest[None], waist)
            turn, shift = over_rest(markers, seen, rest, weights)
            R = torch.where(whole[:, None, None], R, turn @ R_rest)
            t = torch.where(whole[:, None], t, (turn @ t_rest[..., None])[..., 0] + shift)
    return into(markers, R, t), R, t


def into(points: Tensor, R: Tensor, t: Tensor) -> Tensor:
    """Points (B, N, 3) of the lab in the frames."""
    return (points - t[:, None]) @ R


def out_of(points: Tensor, R: Tensor, t: Tensor) -> Tensor:
    """Points (B, N, 3) of the frames in the lab."""
    return points @ R.transpose(-1, -2) + t[:, None]


def over_rest(markers: Tensor, seen: Tensor, rest: Tensor, weights: Tensor) -> tuple[Tensor, Tensor]:
    """Rotation (B, 3, 3) and shift (B, 3) m that lay markers at rest best over those that were seen (weighted Kabsch).

    Without three markers that are not in a line, a rotation that explains what there is.
    """
    import torch

    own = torch.where(seen, weights, torch.zeros(())).to(markers.dtype)
    share = own / own.sum(-1, keepdim=True).clamp_min(1e-9)
    there = torch.where(seen[..., None], markers, torch.zeros((), dtype=markers.dtype))
    rest = rest.expand(len(markers), -1, -1)
    middle, rest_middle = (share[..., None] * there).sum(1), (share[..., None] * rest).sum(1)
    cross = ((there - middle[:, None]) * share[..., None]).transpose(1, 2) @ (rest - rest_middle[:, None])
    u, _, vt = torch.linalg.svd(cross)
    sign = torch.linalg.det(u @ vt)
    u = torch.cat([u[..., :2], u[..., 2:] * sign[:, None, None]], -1)
    turn = u @ vt
    return turn, middle - (turn @ rest_middle[..., None])[..., 0]


def _of_waist(markers: Tensor, waist: Sequence[int]) -> tuple[Tensor, Tensor]:
    """Axes (B, 3, 3), x to the left, y up, z forward, and middle (B, 3) m of the four markers of the waist."""
    import torch

    left_front, right_front, left_back, right_back = (markers[:, i] for i in waist)
    across = (left_front - right_front) + 0.5 * (left_back - right_back)
    forward = (left_front + right_front) - (left_back + right_back)
    x = across / across.norm(dim=-1, keepdim=True)
    y = torch.linalg.cross(forward, x, dim=-1)
    y = y / y.norm(dim=-1, keepdim=True)
    middle = (left_front + right_front + left_back + right_back) / 4
    return torch.stack([x, y, torch.linalg.cross(x, y, dim=-1)], -1), middle
