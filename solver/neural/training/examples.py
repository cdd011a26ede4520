"""What networks learn from: poses of clips on bodies that all differ, with markers, made as they are needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.layout import HEIGHT_M, Layout
from markerscope.solver.neural.training.library import Clip
from markerscope.solver.synth.body import vary_body

if TYPE_CHECKING:
    from torch import Generator, Tensor

_LEGS = tuple(INDEX[f"{side}_{name}"] for side in ("left", "right") for name in ("hip", "knee", "ankle", "foot"))
_NO_SHAKE = tuple(INDEX[name] for name in ("pelvis", "spine1", "spine2", "spine3", "neck", "left_hand", "right_hand"))
"""Joints whose share of a movement no marker tells from their neighbours': what is usual is learnt from the clips."""


@dataclass(frozen=True)
class ExampleSettings:
    """How examples differ from each other.

    Attributes
    ----------
    spread : standard deviation of each shape coefficient
    bones : standard deviation of each bone-length coefficient of ``markerscope.solver.body.bones``
    placement_mm : mm, standard deviation of where on the skin a marker is, along each axis
    height_mm : mm, standard deviation of its height above the skin
    jitter_mm : mm, white noise of each coordinate in each frame
    mirrored : chance that left and right are exchanged
    mixed : chance that the legs are another example's
    shaken, shake_deg : chance that every joint is turned at random, and degrees about each axis
    fingers : whether fingers curl at random, where the clip does not move them
    """

    spread: float = 0.8
    bones: float = 1.0
    placement_mm: float = 5.0
    height_mm: float = 1.5
    jitter_mm: float = 0.5
    mirrored: float = 0.5
    mixed: float = 0.3
    shaken: float = 0.3
    shake_deg: float = 6.0
    fingers: bool = False

    def plain(self) -> ExampleSettings:
        """The same bodies and markers, poses just as the clips have them: what is judged on."""
        return replace(self, mirrored=0.0, mixed=0.0, shaken=0.0)


@dataclass(frozen=True, eq=False)
class Examples:
    """A batch; all float32. With windows of W frames, frames of a window follow each other: B = windows * W.

    Attributes
    ----------
    markers : (B, M, 3) m in the lab, z up
    rotations : (B, 24, 3, 3), root in the lab, others relative to the parent
    joints : (B, 24, 3) m in the lab
    rest_joints : (B, 24, 3) m, the body at rest
    rest_markers : (B, M, 3) m, the markers on it
    window : W
    """

    markers: Tensor
    rotations: Tensor
    joints: Tensor
    rest_joints: Tensor
    rest_markers: Tensor
    window: int = 1

    def offsets(self, joint: Any) -> Tensor:
        """(B, M, 3) m, rest offsets: from the joint (M,) or (B, M) of each marker to it, in the rest body's axes."""
        import torch

        index = torch.as_tensor(np.asarray(joint))
        if index.ndim == 1:
            return self.rest_markers - self.rest_joints[:, index]
        return self.rest_markers - self.rest_joints.gather(1, index[..., None].expand(-1, -1, 3))


@dataclass(frozen=True, eq=False)
class BodyPool:
    """Bodies to draw from: means that differ, and one shape basis; float32 tensors.

    Attributes
    ----------
    template : (P, V, 3) m, joints : (P, 24, 3) m
    shape_dirs : (V, 3, S), joint_dirs : (24, 3, S) m, bone lengths last
    betas_count : of S, those that are no bone lengths
    weights : (V, 24)
    normals : (V, 3), of the first body
    """

    template: Tensor
    joints: Tensor
    shape_dirs: Tensor
    joint_dirs: Tensor
    betas_count: int
    weights: Tensor
    normals: Tensor

    def __len__(self) -> int:
        return len(self.template)


def body_pool(
    body: Body, count: int, seed: int, *, bones: float = 0.03, bumps: float = 0.010, plain: bool = True
) -> BodyPool:
    """Bodies of means outside the shape basis, ``markerscope.solver.synth.vary_body`` with different seeds.

    Parameters
    ----------
    body : without bone lengths among its coefficients
    count : how many beside the body itself; about 30 ms and 160 kB each
    plain : whether the body itself is one; without, all are outside the basis
    """
    import torch

    def tensor(array: np.ndarray) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(array, np.float32))

    grown = with_bone_lengths(body)
    varied = [vary_body(body, np.random.default_rng([seed, i]), bones=bones, bumps=bumps) for i in range(count)]
    bodies = [body, *varied] if plain else varied
    return BodyPool(
        tensor(np.stack([b.template for b in bodies])),
        tensor(np.stack([b.joint_template for b in bodies])),
        tensor(grown.shape_dirs),
        tensor(grown.joint_dirs),
        body.shape_count,
        tensor(body.weights),
        tensor(body.normals(np.zeros(body.shape_count))),
    )


@dataclass(frozen=True, eq=False)
class Sampler:
    """Draws batches from clips and bodies. Every draw is a function of its generator alone.

    Attributes
    ----------
    clips : of one rate, each kind drawn as often as another
    pool : bodies
    settings : how they vary
    mean : (S,) shape coefficients that the drawn ones vary about; None is zero
    """

    clips: Sequence[Clip]
    pool: BodyPool
    settings: ExampleSettings = ExampleSettings()
    mean: np.ndarray | None = None

    @cached_property
    def _frames(self) -> tuple[Tensor, Tensor]:
        """(N, 24, 3, 3) and (N, 3): all clips in a row."""
        import torch

        rotations = np.concatenate([clip.rotations for clip in self.clips]).astype(np.float32)
        trans = np.concatenate([clip.trans for clip in self.clips]).astype(np.float32)
        return torch.as_tensor(rotations), torch.as_tensor(trans)

    @cached_property
    def _kinds(self) -> dict[str, list[int]]:
        kinds: dict[str, list[int]] = {}
        for i, clip in enumerate(self.clips):
            kinds.setdefault(clip.kind, []).append(i)
        return kinds

    def _starts(self, count: int, window: int, generator: Generator) -> Tensor:
        """(count, window) frames of ``_frames``: the kind drawn by the root of its length, then the frame evenly.

        A clip shorter than the window is played forth and back.
        """
        import torch

        lengths = np.array([len(clip.trans) for clip in self.clips])
        first = np.concatenate([[0], np.cumsum(lengths)[:-1]])
        chance = np.zeros(len(lengths))
        for members in self._kinds.values():
            chance[members] = lengths[members] / np.sqrt(lengths[members].sum())
        clip = torch.multinomial(torch.as_tensor(chance, dtype=torch.float64), count, True, generator=generator)
        long = torch.as_tensor(lengths)[clip]
        start = (torch.rand(count, generator=generator) * (long - window + 1).clamp_min(1)).long()
        step = start[:, None] + torch.arange(window)
        turn = (2 * (long - 1)).clamp_min(1)[:, None]
        step = step % turn
        step = torch.where(step >= long[:, None], turn - step, step)
        return torch.as_tensor(first)[clip][:, None] + step

    def poses(self, count: int, generator: Generator, window: int = 1) -> tuple[Tensor, Tensor]:
        """Rotations (count * window, 24, 3, 3) and places (count * window, 3) m of the root, at any heading."""
        import torch

        s = self.settings
        rotations, trans = self._frames
        frames = self._starts(count, window, generator)
        local, place = rotations[frames], trans[frames]

        def picked(chance: float) -> Tensor:
            return torch.rand(count, generator=generator) < chance

        other = rotations[self._starts(count, window, generator)][:, :, _LEGS] if s.mixed else None
        if other is not None:
            chosen = picked(s.mixed)[:, None, None, None, None]
            local[:, :, _LEGS] = torch.where(chosen, other, local[:, :, _LEGS])
        if s.mirrored:
            flip = torch.diag(torch.tensor([-1.0, 1, 1]))
            turned = flip @ local[:, :, mirror_index().tolist()] @ flip
            chosen = picked(s.mirrored)
            local = torch.where(chosen[:, None, None, None, None], turned, local)
            place = torch.where(chosen[:, None, None], place * torch.tensor([-1.0, 1, 1]), place)
        if s.shaken:
            shake = np.radians(s.shake_deg) * torch.randn(count, 1, len(JOINTS), 3, generator=generator)
            shake[:, :, _NO_SHAKE] = 0
            shake = torch.where(picked(s.shaken)[:, None, None, None], shake, torch.zeros(()))
            local = local @ kinematics.exp(shake)
        if s.fingers:
            for side, sign in ((INDEX["left_hand"], 1.0), (INDEX["right_hand"], -1.0)):
                still = (local[:, :1, side, 0, 0] > 0.9999) & (local[:, -1:, side, 0, 0] > 0.9999)
                vector = torch.zeros(count, window, 3)
                vector[..., 2] = -sign * self._curl(count, window, generator)
                local[:, :, side] = torch.where(still[..., None, None], kinematics.exp(vector), local[:, :, side])
        yaw = 2 * np.pi * torch.rand(count, 1, generator=generator)
        vector = torch.stack([torch.zeros_like(yaw), torch.zeros_like(yaw), yaw], -1)
        about = kinematics.exp(vector)  # (count, 1, 3, 3)
        local[:, :, 0] = about @ local[:, :, 0]
        place = (about @ place[..., None])[..., 0]
        return local.flatten(0, 1), place.flatten(0, 1)

    @staticmethod
    def _curl(count: int, window: int, generator: Generator) -> Tensor:
        """(count, window) rad, fingers that bend slowly."""
        import torch

        ends = torch.rand(count, 2, generator=generator) * 1.7 - 0.2
        share = 0.5 - 0.5 * torch.cos(
            torch.pi * torch.arange(window) / 60 + 6.3 * torch.rand(count, 1, generator=generator)
        )
        return ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * share

    def draw(
        self, layout: Layout | Tensor, count: int, generator: Generator, window: int = 1, noise: bool = True
    ) -> Examples:
        """A batch of ``count`` windows.

        Parameters
        ----------
        layout : where the markers are; or vertices (count, M), another set in each example, all at the usual height
        noise : whether markers jitter
        """
        import torch

        s, pool = self.settings, self.pool
        local, place = self.poses(count, generator, window)
        which = torch.randint(len(pool), (count,), generator=generator)
        betas = torch.randn(count, pool.shape_dirs.shape[2], generator=generator)
        betas[:, : pool.betas_count] *= s.spread
        betas[:, pool.betas_count :] *= s.bones
        if self.mean is not None:
            betas[:, : len(self.mean)] += torch.as_tensor(self.mean, dtype=torch.float32)
        rest_joints = pool.joints[which] + (pool.joint_dirs @ betas.T).permute(2, 0, 1)
        if isinstance(layout, Layout):
            vertex = torch.as_tensor(layout.vertex)
            skin = pool.template[which[:, None], vertex] + (pool.shape_dirs[vertex] @ betas.T).permute(2, 0, 1)
            weights = pool.weights[vertex]
            normal = torch.as_tensor(layout.normal, dtype=torch.float32)
            offset = torch.as_tensor(layout.offset, dtype=torch.float32)
        else:
            vertex = layout
            skin = pool.template[which[:, None], vertex]
            skin = skin + torch.einsum("nmas,ns->nma", pool.shape_dirs[vertex], betas)
            weights, normal = pool.weights[vertex], pool.normals[vertex]
            offset = HEIGHT_M * normal
        markers = vertex.shape[-1]
        moved = 1e-3 * s.placement_mm * torch.randn(count, markers, 3, generator=generator)
        moved = moved - (moved * normal).sum(-1, keepdim=True) * normal
        lifted = 1e-3 * s.height_mm * torch.randn(count, markers, 1, generator=generator)
        rest_markers = skin + offset + moved + lifted.clamp_min(-5e-3) * normal
        many = torch.arange(count).repeat_interleave(window)
        rest_joints, rest_markers = rest_joints[many], rest_markers[many]
        turn, joints = kinematics.forward(local, _placed(rest_joints, place))
        points = skinned(turn, joints, rest_joints, rest_markers, weights if weights.ndim == 2 else weights[many])
        if noise and s.jitter_mm:
            points = points + 1e-3 * s.jitter_mm * torch.randn(points.shape, generator=generator)
        return Examples(points, local, joints, rest_joints, rest_markers, window)


def _placed(rest_joints: Tensor, place: Tensor) -> Tensor:
    bones = kinematics.bones_of(rest_joints)
    bones[:, 0] = rest_joints[:, 0] + place
    return bones


def skinned(turn: Tensor, joints: Tensor, rest_joints: Tensor, rest: Tensor, weights: Tensor) -> Tensor:
    """(B, M, 3) m, points of the rest body (B, M, 3) moved with the skin: linear blend skinning at these points alone.

    Parameters
    ----------
    turn, joints : world pose, (B, 24, 3, 3) and (B, 24, 3) m
    rest_joints : (B, 24, 3) m
    weights : (M, 24) or (B, M, 24)
    """
    import torch

    shift = joints - (turn @ rest_joints[..., None])[..., 0]
    moves = torch.cat([turn, shift[..., None]], -1).flatten(2)  # (B, 24, 12)
    blended = (weights @ moves).unflatten(2, (3, 4))
    return (blended[..., :3] @ rest[..., None])[..., 0] + blended[..., 3]


def generator(seed: int, *more: int) -> Generator:
    """A generator of torch that a few numbers determine, the same on every machine."""
    import torch

    state = np.random.SeedSequence([seed, *more]).generate_state(2, np.uint32)
    return torch.Generator().manual_seed(int(state[0]) << 31 ^ int(state[1]))
