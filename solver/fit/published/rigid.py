"""The video's body as a rigid thing of variable shape: what marker-part matching moves (equations 1 and 2).

Its pose stays the video's, so every vertex is linear in the shape. That is worked out once a chain; an evaluation of
E_S then costs little more than finding the nearest vertices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.fit.published.energies import nearest_points, two_way_chamfer
from markerscope.solver.fit.published.sequence import Sequence
from markerscope.solver.fit.published.turns import about_vertical

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any


@dataclass(frozen=True, eq=False)
class RigidBody:
    """Some vertices in the video's pose, about the root joint, its camera upright and looking along y.

    Attributes
    ----------
    sequence : the recording
    base : (N, n, 3) m, float32, of the mean shape
    dirs : (N, n, 3, S) m per unit of each free shape coefficient, float32
    root, root_dirs : (3,) and (3, S) m, the root joint at rest
    """

    sequence: Sequence
    base: Tensor
    dirs: Tensor
    root: Tensor
    root_dirs: Tensor

    @classmethod
    def of(cls, sequence: Sequence, vertices: np.ndarray) -> RigidBody:
        """The given vertices of the video's body."""
        import torch

        body, count = sequence.body, len(sequence.betas)
        root = torch.tensor(body.joint_template[0])
        root_dirs = torch.tensor(body.joint_dirs[0, :, :count])
        index = torch.as_tensor(vertices)
        rotations = sequence.rotations.float()
        still = torch.zeros(len(rotations), 3)
        units = torch.eye(count)
        with torch.no_grad():
            base = sequence.posed(rotations, torch.zeros(count), still, index) - root.float()
            dirs = torch.empty(*base.shape, count)
            for k in range(count):
                unit = sequence.posed(rotations, units[k], still, index)
                dirs[..., k] = unit - (root + root_dirs[:, k]).float() - base
        return cls(sequence, base, dirs, root, root_dirs)

    def every(self, betas: Tensor) -> Tensor:
        """(N, n, 3) m, all vertices, float32 and without derivatives."""
        return self.base + self.dirs @ betas.detach().float()

    def carried_back(self, yaw: Tensor, trans: Tensor, betas: Tensor) -> Tensor:
        """(N, U, 3) m, the markers in this body's frame when it is turned by ``yaw`` rad and shifted by ``trans``."""
        shift = trans + self.root + self.root_dirs @ betas
        return (self.sequence.markers - shift[:, None]) @ about_vertical(yaw)

    def one_way(self, yaw: Tensor, trans: Tensor, betas: Tensor) -> Tensor:
        """Equation 1 over these vertices, m^2."""
        import torch

        seen = self.sequence.seen
        markers = self.carried_back(yaw, trans, betas)
        with torch.no_grad():
            nearest = nearest_points(self.every(betas), markers.float())[seen]
        frame = seen.nonzero()[:, 0]
        points = self.base[frame, nearest].double() + self.dirs[frame, nearest].double() @ betas
        return (points - markers[seen]).square().sum(dim=1).mean()

    def two_way(self, yaw: Tensor, trans: Tensor, betas: Tensor) -> tuple[float, float]:
        """Two-way Chamfer distance over these vertices and its one-way part, m^2."""
        import torch

        with torch.no_grad():
            markers = self.carried_back(yaw, trans, betas).float()
            return two_way_chamfer(self.every(betas), markers, self.sequence.seen)
