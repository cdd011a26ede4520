"""A network that reads a pose off markers anywhere on any body: no weight belongs to a marker.

Each marker comes with its place on the resting body and the bones that carry it. What the markers of a bone say is
summed over them (messages from markers to bones, the same for every marker), the bones tell each other, and a first
pose comes out. Then the body is posed, each bone compares where its markers are with where they should be, and the
pose is mended: three times, by networks of their own. It is a learned Gauss-Newton descent, whose start and whose
idea of what bodies do are learned too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.layout_free.agnostic_moments import COMPARED, OBSERVED, compared, observed
from markerscope.solver.neural.training.examples import generator, skinned
from markerscope.solver.neural.training.train import Params

if TYPE_CHECKING:
    from torch import Generator, Tensor

BONES = len(JOINTS)
_ABOVE = [max(int(p), 0) for p in PARENTS]
_NAME, _HIDDEN = 8, 64  # numbers that stand for a bone, and of the layer between, where a marker makes its message


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


@dataclass(frozen=True)
class Agnostic:
    """See the module: a pure function of its numbers and of frames."""

    settings: AgnosticSettings = AgnosticSettings()

    def initial(self, seed: int) -> Params:
        """Numbers to begin with."""
        import torch

        own, random, params = self.settings, generator(seed), Params()
        params["names"] = 0.3 * torch.randn(BONES, _NAME, generator=random)
        _new_linear(params, "message.0", 6 + _NAME, _HIDDEN, random)
        _new_linear(params, "message.2", _HIDDEN, own.message, random)
        _new_bones(params, "first", OBSERVED + own.message, own.bone, own.width, own.blocks, BONES * 6 + 3, random)
        for k in range(own.mends):
            _new_bones(params, f"mending.{k}", COMPARED, own.bone, own.mend_width, 1, BONES * 3 + 3, random)
        return params

    def __call__(self, params: Params, frames: Frames) -> list[Posed]:
        """The pose after each step, the last one being the answer."""
        import torch

        share = (frames.weights * frames.seen[..., None]).transpose(1, 2)
        poses = [_posed(frames, *self._start(params, frames, share))]
        bone = frames.joints - frames.joints[:, _ABOVE]
        for k in range(self.settings.mends):
            last = poses[-1]
            gap = (frames.markers - last.markers) * frames.seen[..., None]
            extra = torch.cat([last.local.flatten(2), bone], dim=2)
            known = compared(share, last.markers, gap, last.turn, last.place, extra)
            step = _bones(params, f"mending.{k}", known, 1)
            turned = last.local @ kinematics.exp(0.2 * step[:, :-3].unflatten(1, (BONES, 3)))
            moved = last.root + 0.05 * (last.turn[:, 0] @ step[:, -3:, None])[..., 0]
            poses.append(_posed(frames, turned, moved))
        return poses

    def _start(self, params: Params, frames: Frames, share: Tensor) -> tuple[Tensor, Tensor]:
        import torch

        told = torch.cat([frames.markers, frames.rest, frames.weights @ params["names"]], dim=2)
        told = _linear(params, "message.2", torch.nn.functional.silu(_linear(params, "message.0", told)))
        told = (share @ told) / (share.sum(2, keepdim=True) + 1e-3)
        known = observed(share, frames.markers, frames.rest, frames.joints, frames.joints[:, _ABOVE])
        out = _bones(params, "first", torch.cat([known, told], dim=2), self.settings.blocks)
        identity = out.new_tensor([1.0, 0, 0, 0, 1, 0])
        return kinematics.orthonormal(out[:, :-3].unflatten(1, (BONES, 6)) + identity), 0.1 * out[:, -3:]


def _posed(frames: Frames, local: Tensor, root: Tensor) -> Posed:
    bones = kinematics.bones_of(frames.joints)
    bones[:, 0] = root
    turn, place = kinematics.forward(local, bones)
    return Posed(local, root, turn, place, skinned(turn, place, frames.joints, frames.rest, frames.weights))


def _bones(params: Params, name: str, known: Tensor, blocks: int) -> Tensor:
    """From what is known of each bone (B, 24, inputs) to something about all: bones one by one, then together."""
    import torch

    silu = torch.nn.functional.silu
    each = silu(known.transpose(0, 1) @ params[f"{name}.weight"] + params[f"{name}.bias"])
    x = silu(_linear(params, f"{name}.join", each.transpose(0, 1).flatten(1)))
    for k in range(blocks):
        scale, shift = (params[f"{name}.blocks.{k}.0.{kind}"] for kind in ("weight", "bias"))
        normed = torch.nn.functional.layer_norm(x, x.shape[1:], scale, shift)
        x = x + _linear(params, f"{name}.blocks.{k}.3", silu(_linear(params, f"{name}.blocks.{k}.1", normed)))
    return _linear(params, f"{name}.out", x)


def _linear(params: Params, name: str, x: Tensor) -> Tensor:
    import torch

    return torch.nn.functional.linear(x, params[f"{name}.weight"], params[f"{name}.bias"])


def _new_bones(
    params: Params, name: str, inputs: int, bone: int, width: int, blocks: int, outputs: int, random: Generator
) -> None:
    import torch

    params[f"{name}.weight"] = torch.randn(BONES, inputs, bone, generator=random) / inputs**0.5
    params[f"{name}.bias"] = torch.zeros(BONES, 1, bone)
    _new_linear(params, f"{name}.join", BONES * bone, width, random)
    for k in range(blocks):
        params[f"{name}.blocks.{k}.0.weight"] = torch.ones(width)
        params[f"{name}.blocks.{k}.0.bias"] = torch.zeros(width)
        _new_linear(params, f"{name}.blocks.{k}.1", width, width, random)
        _new_linear(params, f"{name}.blocks.{k}.3", width, width, random)
    _new_linear(params, f"{name}.out", width, outputs, random)
    params[f"{name}.out.weight"] *= 0.1
    params[f"{name}.out.bias"] *= 0.0


def _new_linear(params: Params, name: str, inputs: int, outputs: int, random: Generator) -> None:
    """Evenly between plus and minus the root of one over the inputs."""
    import torch

    for kind, shape in (("weight", (outputs, inputs)), ("bias", (outputs,))):
        params[f"{name}.{kind}"] = (2 * torch.rand(shape, generator=random) - 1) / inputs**0.5
