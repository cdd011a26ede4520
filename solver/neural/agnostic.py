"""A network that reads a pose off markers anywhere on any body: no weight belongs to a marker.

Each marker comes with its place on the resting body and the bones that carry it. What the markers of a bone say is
summed over them (messages from markers to bones, the same for every marker), the bones tell each other, and a first
pose comes out. Then the body is posed, each bone compares where its markers are with where they should be, and the
pose is mended: three times, by networks of their own. It is a learned Gauss-Newton descent, whose start and whose
idea of what bodies do are learned too.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from solver.body.skeleton import JOINTS, PARENTS
from solver.neural import kinematics
from solver.neural.agnostic_moments import COMPARED, OBSERVED, compared, observed
from solver.neural.examples import skinned

BONES = len(JOINTS)
_ABOVE = torch.tensor([max(int(p), 0) for p in PARENTS])


@dataclass(frozen=True)
class AgnosticSettings:
    """Sizes of the network.

    Attributes
    ----------
    message : numbers that a marker tells each of its bones beside where it is
    bone : numbers that describe a bone
    width, blocks : of the first network, residual blocks
    mend_width, mends : of each network that mends the pose, and how many there are
    """

    message: int = 32
    bone: int = 32
    width: int = 512
    blocks: int = 2
    mend_width: int = 256
    mends: int = 3


@dataclass(frozen=True)
class Frames:
    """What the network is given: B frames, each of its own body and layout, in the aligned frame, float32.

    Attributes
    ----------
    markers : (B, M, 3) m, 0 where lost
    seen : (B, M) 1 where a marker is seen, 0 where it is lost or there is none
    rest : (B, M, 3) m, the markers on the resting body, whose root joint is the origin
    weights : (B, M, 24) skinning weights
    joints : (B, 24, 3) m, joints at rest
    """

    markers: Tensor
    seen: Tensor
    rest: Tensor
    weights: Tensor
    joints: Tensor


@dataclass(frozen=True)
class Posed:
    """A pose in the aligned frame: (B, 24, 3, 3) local rotations, (B, 3) m root, and what follows from them.

    Attributes
    ----------
    local, root : the pose
    turn, place : (B, 24, 3, 3) and (B, 24, 3) m of the joints
    markers : (B, M, 3) m, where it puts them
    """

    local: Tensor
    root: Tensor
    turn: Tensor
    place: Tensor
    markers: Tensor


class AgnosticSolver(nn.Module):
    """See the module. ``forward`` returns the pose after each step, the last one being the answer."""

    def __init__(self, settings: AgnosticSettings | None = None) -> None:
        super().__init__()
        self.settings = own = settings or AgnosticSettings()
        self.message = nn.Sequential(nn.Linear(6 + 8, 64), nn.SiLU(), nn.Linear(64, own.message))
        self.names = nn.Parameter(0.3 * torch.randn(BONES, 8))
        self.first = _Bones(OBSERVED + own.message, own.bone, own.width, own.blocks, BONES * 6 + 3)
        self.mending = nn.ModuleList(
            _Bones(COMPARED, own.bone, own.mend_width, 1, BONES * 3 + 3) for _ in range(own.mends)
        )

    def forward(self, frames: Frames) -> list[Posed]:
        """The pose after each step."""
        share = (frames.weights * frames.seen[..., None]).transpose(1, 2)
        poses = [self._posed(frames, *self._start(frames, share))]
        bone = frames.joints - frames.joints[:, _ABOVE]
        for mend in self.mending:
            last = poses[-1]
            gap = (frames.markers - last.markers) * frames.seen[..., None]
            extra = torch.cat([last.local.flatten(2), bone], dim=2)
            step = mend(compared(share, last.markers, gap, last.turn, last.place, extra))
            turned = last.local @ kinematics.exp(0.2 * step[:, :-3].unflatten(1, (BONES, 3)))
            moved = last.root + 0.05 * (last.turn[:, 0] @ step[:, -3:, None])[..., 0]
            poses.append(self._posed(frames, turned, moved))
        return poses

    def _start(self, frames: Frames, share: Tensor) -> tuple[Tensor, Tensor]:
        told = self.message(torch.cat([frames.markers, frames.rest, frames.weights @ self.names], dim=2))
        told = (share @ told) / (share.sum(2, keepdim=True) + 1e-3)
        known = observed(share, frames.markers, frames.rest, frames.joints, frames.joints[:, _ABOVE])
        out = self.first(torch.cat([known, told], dim=2))
        identity = out.new_tensor([1.0, 0, 0, 0, 1, 0])
        return kinematics.orthonormal(out[:, :-3].unflatten(1, (BONES, 6)) + identity), 0.1 * out[:, -3:]

    @staticmethod
    def _posed(frames: Frames, local: Tensor, root: Tensor) -> Posed:
        bones = kinematics.bones_of(frames.joints)
        bones[:, 0] = root
        turn, place = kinematics.forward(local, bones)
        return Posed(local, root, turn, place, skinned(turn, place, frames.joints, frames.rest, frames.weights))


class _Bones(nn.Module):
    """From what is known of each bone to something about all of them: bones one by one, then all together."""

    def __init__(self, inputs: int, bone: int, width: int, blocks: int, outputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.randn(BONES, inputs, bone) / inputs**0.5)
        self.bias = nn.Parameter(torch.zeros(BONES, 1, bone))
        self.join = nn.Linear(BONES * bone, width)
        self.blocks = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(width), nn.Linear(width, width), nn.SiLU(), nn.Linear(width, width))
            for _ in range(blocks)
        )
        self.out = nn.Linear(width, outputs)
        nn.init.zeros_(self.out.bias)
        with torch.no_grad():
            self.out.weight *= 0.1

    def forward(self, known: Tensor) -> Tensor:
        """(B, 24, inputs) to (B, outputs)."""
        each = nn.functional.silu(known.transpose(0, 1) @ self.weight + self.bias)
        all_ = nn.functional.silu(self.join(each.transpose(0, 1).flatten(1)))
        for block in self.blocks:
            all_ = all_ + block(all_)
        out: Tensor = self.out(all_)
        return out
