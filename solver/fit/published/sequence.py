"""One recording as the published method sees it: markers, the video's body set upright in the lab, as tensors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.localize import R_LAB_UPRIGHT_CAMERA
from markerscope.solver.fit.published.settings import Mesh
from markerscope.solver.fit.state import Observations

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any


@dataclass(frozen=True, eq=False)
class Sequence:
    """N frames of U markers and the video's body.

    Attributes
    ----------
    body : to be fitted
    markers : (N, U, 3) m, lab frame, zero where lost
    seen : (N, U) bool
    tracked : (N,) bool, the video tracked the person
    rotations : (N, 24, 3, 3) the video's pose, its camera taken to stand upright and look along the lab's y
    betas : (S,) the video's shape
    """

    body: Body
    markers: Tensor
    seen: Tensor
    tracked: Tensor
    rotations: Tensor
    betas: Tensor

    @cached_property
    def centre(self) -> Tensor:
        """(N, 3) m, median marker of each frame; where none is seen, that of the nearest frame that has one."""
        import torch

        values = np.where(self.seen.numpy()[..., None], self.markers.numpy(), np.nan)
        some = np.flatnonzero(self.seen.numpy().any(axis=1))
        middle = np.nanmedian(values[some], axis=1)
        every = np.arange(len(values))
        return torch.as_tensor(np.stack([np.interp(every, some, middle[:, k]) for k in range(3)], axis=1))

    def posed(self, rotations: Tensor, betas: Tensor, trans: Tensor, vertices: Tensor) -> Tensor:
        """(N, n, 3) m, some of the vertices."""
        placed: Tensor = self.body.pose(rotations, betas, trans, vertices)[0]
        return placed


def sequence_of(
    body: Body,
    seen: Observations,
    frames: np.ndarray,
    markers: np.ndarray,
    betas: int,
    video_betas: np.ndarray | None = None,
) -> Sequence:
    """The given frames and markers of what was observed, the body's first ``betas`` shape coefficients being free."""
    import torch

    if not seen.tracked.any():
        raise InputError(
            "the video tracks the person at no time when markers were recorded",
            "the video",
            "check that both show the same movement, and the offset between them",
        )
    positions = seen.markers[frames][:, markers]
    present = np.isfinite(positions).all(axis=2)
    rotations = seen.prior[frames].copy()
    rotations[:, 0] = R_LAB_UPRIGHT_CAMERA @ rotations[:, 0]
    shape = np.zeros(min(betas, body.betas_count))
    if video_betas is not None:
        given = np.asarray(video_betas, dtype=float)[: len(shape)]
        shape[: len(given)] = given
    return Sequence(
        body,
        torch.as_tensor(np.where(present[..., None], positions, 0.0)),
        torch.as_tensor(present),
        torch.as_tensor(np.asarray(seen.tracked[frames], dtype=bool)),
        torch.as_tensor(rotations),
        torch.as_tensor(shape),
    )


def frames_at(time: np.ndarray, rate: float) -> np.ndarray:
    """(N,) ascending frame numbers about 1/``rate`` s apart, the first and last included."""
    steps = np.arange(time[0], time[-1] + 1e-9, 1 / rate)
    right = np.clip(np.searchsorted(time, steps), 1, max(len(time) - 1, 1))
    if len(time) == 1:
        return np.zeros(1, dtype=np.intp)
    nearest = np.where(steps - time[right - 1] <= time[right] - steps, right - 1, right)
    return np.union1d(nearest, [len(time) - 1]).astype(np.intp)


def mesh_vertices(body: Body, mesh: Mesh) -> np.ndarray:
    """(n,) vertices that the nearest to a marker is sought among."""
    return np.sort(body.lod_index) if mesh == "coarse" else np.arange(len(body.template))


def chain_vertices(body: Body, vertices: np.ndarray, bones: np.ndarray) -> np.ndarray:
    """Those of the vertices whose greatest skinning weight is of one of the bones: the V_S of the paper."""
    return vertices[np.isin(body.weights[vertices].argmax(axis=1), bones)]


def turned_video(rotations: np.ndarray, yaw_deg: float) -> np.ndarray:
    """(N, 24, 3, 3) the same poses, the root turned about the vertical."""
    out = rotations.copy()
    out[:, 0] = exp_so3(np.array([0, 0, np.radians(yaw_deg)])) @ rotations[:, 0]
    return out


WHOLE = np.arange(len(JOINTS))
"""The bones of the whole body."""
