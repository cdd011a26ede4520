"""Frames for the layout-agnostic network to learn from: what a capture does to markers, and what a solver believes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.core.skeleton import JOINTS, PARENTS, descendants
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.layout import Layout
from markerscope.solver.neural.layout_free.agnostic import Frames
from markerscope.solver.neural.layout_free.agnostic_align import align_to_rest
from markerscope.solver.neural.layout_free.agnostic_layouts import Skin
from markerscope.solver.neural.layout_free.agnostic_solve import Marked
from markerscope.solver.neural.training.examples import Examples, Sampler, skinned

if TYPE_CHECKING:
    from torch import Generator, Tensor

_FEWEST, _MOST = 20, 60
_ENOUGH, _HARDLY = 0.3, 0.1
_ADJACENT = np.eye(len(JOINTS)) + sum(
    np.eye(len(JOINTS))[:, [j]] @ np.eye(len(JOINTS))[[PARENTS[j]]] for j in range(1, len(JOINTS))
)
_ADJACENT = np.maximum(_ADJACENT, _ADJACENT.T)


@dataclass(frozen=True)
class Spoiling:
    """What is wrong with the markers and with what is known of them; each frame draws its share of each, up to this.

    Attributes
    ----------
    slide : m, standard deviation of skin over bone
    lost : chance of a marker to be lost
    far : chance of a marker to be somewhere else, by some ``far_by`` m
    place : m, how far each marker is from where the solver believes it on the resting body
    joint : m, the same of the joints, with which the markers about them move half
    """

    slide: float = 5e-3
    lost: float = 0.25
    far: float = 0.01
    far_by: float = 0.08
    place: float = 6e-3
    joint: float = 10e-3


CLEAN = Spoiling(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Nothing wrong."""


@dataclass(frozen=True, eq=False)
class Task:
    """What the network is given, and the truth in the same frame.

    Attributes
    ----------
    frames : given
    local, turn : (B, 24, 3, 3) of the joints, relative to the parent and in the aligned frame
    place : (B, 24, 3) m of the joints
    markers : (B, M, 3) m, where the markers truly are
    turn_share, place_share : (B, 24) how much each joint counts: little where no marker tells of it
    """

    frames: Frames
    local: Tensor
    turn: Tensor
    place: Tensor
    markers: Tensor
    turn_share: Tensor
    place_share: Tensor


def any_layout(
    sampler: Sampler,
    skin: Skin,
    count: int,
    generator: Generator,
    spoiling: Spoiling = Spoiling(),
    parts: float = 0.1,
) -> Task:
    """Frames of random bodies, each with a layout of its own; a share of them of one part of the body alone."""
    import torch

    rng = numbers_of(generator)
    vertex, there = skin.layouts(count, int(rng.integers(_FEWEST, _MOST + 1)), rng, parts)
    index = torch.as_tensor(vertex)
    drawn = sampler.draw(index, count, generator)
    return spoilt(drawn, sampler.pool.weights[index], there, rng, spoiling)


def one_layout(
    sampler: Sampler, layout: Layout, count: int, generator: Generator, spoiling: Spoiling = Spoiling()
) -> Task:
    """Frames of random bodies with the same layout."""
    import torch

    drawn = sampler.draw(layout, count, generator)
    weights = sampler.pool.weights[torch.as_tensor(layout.vertex)].expand(count, -1, -1)
    return spoilt(drawn, weights, np.ones((count, len(layout)), dtype=bool), numbers_of(generator), spoiling)


def one_person(
    poses: Sampler, person: Marked, count: int, generator: Generator, spoiling: Spoiling = Spoiling(), window: int = 1
) -> Task:
    """Frames of one body with its markers, in poses of a sampler's; ``window`` of them at a time follow each other."""
    import torch

    count = count // window * window
    local, place = poses.poses(count // window, generator, window)
    joints, rest, weights = (
        torch.as_tensor(array, dtype=torch.float32).expand(count, *array.shape)
        for array in (person.joints, person.rest, person.weights)
    )
    bones = kinematics.bones_of(joints)
    bones[:, 0] = joints[:, 0] + place
    turn, there = kinematics.forward(local, bones)
    markers = skinned(turn, there, joints, rest, weights)
    drawn = Examples(markers, local, there, joints, rest)
    return spoilt(drawn, weights, np.ones(rest.shape[:2], dtype=bool), numbers_of(generator), spoiling)


def spoilt(drawn: Examples, weights: Tensor, there: np.ndarray, rng: np.random.Generator, spoiling: Spoiling) -> Task:
    """Examples as a capture and a solver that knows about their bodies would have them.

    Parameters
    ----------
    weights : (B, M, 24)
    there : (B, M) False where there is no marker
    """
    import torch

    clean, count = drawn.markers.numpy(), len(there)
    share = rng.random((5, count), np.float32) ** np.float32(1.5)

    def normal(shape: tuple[int, ...], size: float, part: int) -> np.ndarray:
        return np.float32(size) * share[part].reshape(-1, 1, 1) * rng.standard_normal(shape, np.float32)

    moved = normal(clean.shape, spoiling.slide / np.sqrt(3), 0)
    moved += normal(clean.shape, spoiling.far_by, 1) * (rng.random((*there.shape, 1)) < spoiling.far)
    lost = ~there | (rng.random(there.shape) < spoiling.lost * share[2, :, None])
    centre = drawn.rest_joints[:, :1].numpy()
    off = normal((count, 24, 3), spoiling.joint / np.sqrt(3), 3)
    off[:, 0] = 0
    joints = drawn.rest_joints.numpy() - centre + off
    rest = drawn.rest_markers.numpy() - centre + normal(clean.shape, spoiling.place / np.sqrt(3), 4)
    rest += 0.5 * (weights @ torch.as_tensor(off)).numpy()
    aligned, R, t = align_to_rest(np.where(lost[..., None], np.nan, clean + moved), rest, weights.numpy())
    R_lab, origin = _tensor(R), _tensor(t)[:, None]
    local = drawn.rotations.clone()
    local[:, 0] = R_lab.transpose(1, 2) @ local[:, 0]
    frames = Frames(_tensor(aligned), _tensor(~lost), _tensor(rest), weights, _tensor(joints))
    turn, _ = kinematics.forward(local, torch.zeros(count, local.shape[1], 3))
    place, markers = (drawn.joints - origin) @ R_lab, (drawn.markers - origin) @ R_lab
    return Task(frames, local, turn, place, markers, *told(frames))


def told(frames: Frames) -> tuple[Tensor, Tensor]:
    """(B, 24) how much a joint's rotation, and its place, is told by the markers that are seen: all, or hardly.

    A rotation is by markers on both sides of the joint, a place by markers on a bone that ends there.
    """
    import torch

    own = (frames.weights * frames.seen[..., None]).sum(1)
    below = own @ torch.as_tensor(descendants(), dtype=own.dtype).T
    least = torch.minimum(below, own.sum(1, keepdim=True) - below)
    near = own @ torch.as_tensor(_ADJACENT, dtype=own.dtype)
    least[:, 0] = near[:, 0]
    turn, place = (torch.where(known > _ENOUGH, 1.0, _HARDLY) for known in (least, near))
    return turn, place


def numbers_of(generator: Generator) -> np.random.Generator:
    """A generator of numpy's that goes on from one of torch's."""
    import torch

    return np.random.default_rng(int(torch.randint(2**62, (1,), generator=generator)))


def _tensor(array: np.ndarray) -> Tensor:
    import torch

    return torch.as_tensor(array, dtype=torch.float32)
