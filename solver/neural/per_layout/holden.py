"""The network of Holden (2018), to compare with: dense residual blocks from markers to the joints' places and axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from markerscope.solver.neural import kinematics
from markerscope.solver.neural.layers import Params, dense, new_dense, residual
from markerscope.solver.neural.per_layout.heterogeneous import SCALE_M, Solution
from markerscope.solver.neural.training.examples import generator as new_generator

if TYPE_CHECKING:
    from torch import Tensor

_OUT = 9  # two columns of a rotation, and a place


@dataclass(frozen=True, eq=False)
class Holden:
    """A pure function of its numbers, of local markers and of which are seen.

    It says where every joint is and how it is turned, in the frame of the markers, one by one; lost markers are zero.
    The publication also tells it each marker's offset from its joint, measured beforehand; here, as for the network it
    is compared with, nothing is known of the person.

    Attributes
    ----------
    parents : J, of the joints
    mean_markers, mean_rotations, mean_places : what input and output vary about
    width, blocks : of the residual blocks; the publication has 2048 and 5
    """

    parents: tuple[int, ...]
    mean_markers: Sequence[Sequence[float]]
    mean_rotations: Sequence[Sequence[Sequence[float]]]
    mean_places: Sequence[Sequence[float]]
    width: int = 2048
    blocks: int = 5

    kind = "holden"

    def config(self) -> dict[str, Any]:
        """All that ``from_config`` needs, as JSON has it."""
        names = ("parents", "mean_markers", "mean_rotations", "mean_places", "width", "blocks")
        return {name: getattr(self, name) for name in names}

    @classmethod
    def from_config(cls, said: Mapping[str, Any]) -> Holden:
        """The network of a card."""
        return cls(**dict(said) | {"parents": tuple(said["parents"])})

    @cached_property
    def _means(self) -> tuple[Tensor, Tensor, Tensor]:
        import torch

        given = (self.mean_markers, self.mean_rotations, self.mean_places)
        markers, rotations, places = (torch.tensor(x, dtype=torch.float32) for x in given)
        return markers, rotations, places

    def initial(self, seed: int) -> Params:
        """Numbers to begin with."""
        random, params = new_generator(seed), Params()
        new_dense(params, "in", 3 * len(self.mean_markers), self.width, random, 2**0.5)
        for k in range(self.blocks):
            new_dense(params, f"block{k}", self.width, self.width, random, 0.5)
        new_dense(params, "out", self.width, _OUT * len(self.parents), random, 0.1)
        return params

    def __call__(self, params: Params, markers: Tensor, visible: Tensor) -> Solution:
        """Solve; see ``Heterogeneous.__call__``."""
        mean_markers, mean_rotations, mean_places = self._means
        seen = (markers - mean_markers) / SCALE_M * visible[..., None]
        x = dense(params, "in", seen.flatten(1)).relu()
        x = residual(params, [f"block{k}" for k in range(self.blocks)], x)
        out = dense(params, "out", x).unflatten(1, (len(self.parents), _OUT))
        world = kinematics.orthonormal(mean_rotations.flatten(1) + out[..., :6])
        places = mean_places + SCALE_M * out[..., 6:]
        return placed(world, places, self.parents)


def placed(world: Tensor, places: Tensor, parents: tuple[int, ...]) -> Solution:
    """Joints' rotations and places in one frame as rotations and offsets from the parents."""
    import torch

    above = [max(parent, 0) for parent in parents]
    bones = (world[:, above].transpose(-1, -2) @ (places - places[:, above])[..., None])[..., 0]
    return Solution(kinematics.local_of(world, parents), torch.cat([places[:, :1], bones[:, 1:]], 1))
