"""Learning to solve motion: what a network is given, what it should say, and how far off it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.align import Frame, align, into
from markerscope.solver.neural.augment import FrameNoise, corrupted
from markerscope.solver.neural.graph import Graph, build_graph
from markerscope.solver.neural.layers import Params, spread_of
from markerscope.solver.neural.layout import Group, Layout
from markerscope.solver.neural.training.examples import (
    BodyPool,
    Examples,
    ExampleSettings,
    Sampler,
    body_pool,
    generator,
)

if TYPE_CHECKING:
    from torch import Generator, Tensor

    from markerscope.solver.neural.training.library import Clip

BODY_JOINTS = tuple(range(22))
JOINTS_OF: Mapping[Group, tuple[int, ...]] = {
    "body": BODY_JOINTS,
    "left_hand": (INDEX["left_wrist"], INDEX["left_hand"]),
    "right_hand": (INDEX["right_wrist"], INDEX["right_hand"]),
}
"""The joints that each network solves. A hand's root, the wrist, is the body's; only the fingers' joint is taken."""
FRAME_OF: Mapping[Group, Frame] = {"body": "waist", "left_hand": "left_wrist", "right_hand": "right_wrist"}


class Network(Protocol):
    """What solves: see ``markerscope.solver.neural.per_layout.heterogeneous`` and
    ``markerscope.solver.neural.per_layout.holden``.
    """

    kind: str

    def config(self) -> dict[str, Any]:
        """As JSON has it."""

    def initial(self, seed: int) -> Params:
        """Numbers to begin with."""

    def __call__(self, params: Params, markers: Tensor, visible: Tensor) -> Any:
        """Solve."""


@dataclass(frozen=True)
class Balance:
    """Weights of the terms of equation (5): rotations, the skeleton (per m), and joint positions (per m)."""

    rotations: float = 1.0
    skeleton: float = 10.0
    positions: float = 15.0


@dataclass(frozen=True, eq=False)
class Target:
    """What a network should say of B frames, all in the frame that rides with the markers.

    Attributes
    ----------
    rotations : (B, J, 3, 3), offsets : (B, J, 3) m, as ``Solution`` has them
    places : (B, J, 3) m
    """

    rotations: Tensor
    offsets: Tensor
    places: Tensor


@dataclass(frozen=True, eq=False)
class Task:
    """One network and what it learns from.

    Attributes
    ----------
    network : with its graph
    joints : those that it solves
    parents : among these
    layout : of the markers that it is given
    chosen : (M,) their indices in the layout that is drawn
    whole : the layout that is drawn
    frame : that the markers are seen in
    rest : (M, 3) m, the markers on the mean body
    sampler, held_out : what is learnt from, and what is judged on
    noise : markers that are lost, filled and displaced on purpose
    batch : examples a step
    balance : of the loss
    windows, window : judged on so many spans of so many frames, in each of which the skeleton is averaged
    """

    network: Network
    joints: tuple[int, ...]
    parents: tuple[int, ...]
    layout: Layout
    chosen: np.ndarray
    whole: Layout
    frame: Frame
    rest: np.ndarray
    sampler: Sampler
    held_out: Sampler
    noise: FrameNoise = field(default_factory=FrameNoise)
    batch: int = 256
    balance: Balance = field(default_factory=Balance)
    windows: int = 64
    window: int = 16

    def given(self, examples: Examples) -> tuple[Tensor, Target]:
        """Local markers (B, M, 3) m and what should be said of them."""
        import torch

        rest = torch.as_tensor(self.rest, dtype=torch.float32)
        markers = examples.markers if len(self.chosen) == len(self.whole) else examples.markers[:, self.chosen]
        local, R, t = align(markers, self.layout, rest, self.frame)
        joints = list(self.joints)
        root = joints[0]
        rotations = examples.rotations[:, joints]
        first = rotations[:, :1] if root == 0 else _world_rotation(examples.rotations, root)[:, None]
        rotations = torch.cat([R.transpose(1, 2)[:, None] @ first, rotations[:, 1:]], 1)
        places = into(examples.joints[:, joints], R, t)
        bones = kinematics.bones_of(examples.rest_joints)[:, joints]
        offsets = torch.cat([places[:, :1], bones[:, 1:]], 1)
        return local, Target(rotations, offsets, places)

    def loss(self, params: Params, generator: Generator) -> dict[str, Tensor]:
        """Equation (5) on a batch; distances, not their squares, so that no joint rules."""
        import torch

        with torch.no_grad():
            local, target = self.given(self.sampler.draw(self.whole, self.batch, generator))
            markers, visible = corrupted(local, self.noise, generator)
        said = self.network(params, markers, visible)
        _, places = kinematics.forward(said.rotations, said.offsets, self.parents)
        b = self.balance
        return {
            "rotations": b.rotations * (said.rotations - target.rotations).flatten(2).norm(dim=2).mean(),
            "skeleton": b.skeleton * (said.offsets[:, 1:] - target.offsets[:, 1:]).norm(dim=2).mean(),
            "positions": b.positions * (places - target.places).norm(dim=2).mean(),
        }

    @cached_property
    def _examination(self) -> tuple[Tensor, Tensor, Target]:
        """Drawn once: the same for every look."""
        import torch

        drawn = self.held_out.draw(self.whole, self.windows, generator(1), self.window)
        local, target = self.given(drawn)
        return local, torch.ones(local.shape[:2]), target

    def judge(self, params: Params) -> dict[str, float]:
        """JOE (degrees) and JPE (cm) on what is held out, nothing lost, the skeleton averaged over each span."""
        local, visible, target = self._examination
        return self.figures(params, local, visible, target, self.window)

    def figures(self, params: Params, local: Tensor, visible: Tensor, target: Target, window: int) -> dict[str, float]:
        """The same on anything."""
        rotations, places = self.solved(params, local, visible, window)
        angle = kinematics.angle_between(rotations, target.rotations)
        apart = 100 * (places - target.places).norm(dim=2)
        # Of a hand only the fingers count; its root is the body's.
        counted = slice(None) if self.joints[0] == 0 else slice(1, None)
        joe, jpe = float(angle[:, counted].mean()), float(apart[:, counted].mean())
        return {"score": 0.5 * (joe / 2.2 + jpe / 0.6), "joe": joe, "jpe": jpe}

    def solved(self, params: Params, local: Tensor, visible: Tensor, window: int) -> tuple[Tensor, Tensor]:
        """Rotations (B, J, 3, 3) and places (B, J, 3) m, bones of the same length throughout each window."""
        import torch

        with torch.no_grad():
            said = self.network(params, local, visible)
            skeleton = said.offsets[:, 1:].unflatten(0, (-1, window)).mean(1).repeat_interleave(window, 0)
            offsets = torch.cat([said.offsets[:, :1], skeleton], 1)
            return said.rotations, kinematics.forward(said.rotations, offsets, self.parents)[1]


def _world_rotation(rotations: Tensor, joint: int) -> Tensor:
    """(B, 3, 3) of one joint in the lab."""
    line = [joint]
    while kinematics.SMPL[line[-1]] >= 0:
        line.append(kinematics.SMPL[line[-1]])
    turn = rotations[:, line[-1]]
    for j in reversed(line[:-1]):
        turn = turn @ rotations[:, j]
    return turn


def members(layout: Layout, group: Group, split: bool = True) -> np.ndarray:
    """(M,) indices of the markers that a network is given: a hand's also the forearm's, which make its frame."""
    if group == "body":
        fingers = np.isin(layout.joint, [INDEX["left_hand"], INDEX["right_hand"]])
        return np.flatnonzero(~fingers) if split else np.arange(len(layout))
    side = group.partition("_")[0]
    return np.flatnonzero(np.isin(layout.joint, [INDEX[f"{side}_{name}"] for name in ("elbow", "wrist", "hand")]))


def graph_of(
    body: Body, layout: Layout, chosen: np.ndarray, joints: tuple[int, ...], sampler: Sampler, *, frames: int = 1500
) -> Graph:
    """The graph of some of a layout's markers, from how they move on the mean body."""
    plain = replace(sampler.settings.plain(), spread=0.0, bones=0.0, placement_mm=0.0, height_mm=0.0, jitter_mm=0.0)
    still = Sampler(sampler.clips, only_first(sampler.pool), plain, sampler.mean)
    moved = still.draw(layout, frames, generator(0)).markers[:, chosen].numpy()
    betas = np.zeros(body.shape_count)
    return build_graph(moved, layout.rest(body)[chosen], body.joints(betas), joints)


def only_first(pool: BodyPool) -> BodyPool:
    """The first of the bodies alone."""
    return replace(pool, template=pool.template[:1], joints=pool.joints[:1])


@dataclass(frozen=True)
class Means:
    """What inputs and outputs vary about; plain lists, as a card holds them.

    Attributes
    ----------
    markers, offsets, places : m
    rotations, world : two columns each of the rotations relative to the parent, and to the markers' frame
    spread : m, see ``Heterogeneous``
    """

    markers: list[list[float]]
    rotations: list[list[list[float]]]
    world: list[list[list[float]]]
    offsets: list[list[float]]
    places: list[list[float]]
    spread: list[list[float]]


def means_of(task: Task, graph: Graph, count: int = 2000) -> Means:
    """Of what a task draws; ``task.network`` is not used."""
    local, target = task.given(task.sampler.draw(task.whole, count, generator(2)))
    world, places = kinematics.forward(target.rotations, target.offsets, task.parents)
    return Means(
        _listed(local),
        _listed(target.rotations[..., :2].transpose(-1, -2)),
        _listed(world[..., :2].transpose(-1, -2)),
        _listed(target.offsets),
        _listed(places),
        spread_of(local, graph.marker_marker),
    )


def _listed(values: Tensor) -> list[Any]:
    """The mean over the batch, to five digits after the point."""
    mean: list[Any] = np.round(values.mean(0).numpy().astype(float), 5).tolist()
    return mean


def samplers(
    body: Body,
    learnt: tuple[Clip, ...],
    judged: tuple[Clip, ...],
    settings: ExampleSettings | None = None,
    *,
    bodies: int = 48,
    seed: int = 0,
) -> tuple[Sampler, Sampler]:
    """What is learnt from, and what is judged on: clips and bodies of the second are in none of the first's batches."""
    settings = settings or ExampleSettings()
    return (
        Sampler(learnt, body_pool(body, bodies, seed), settings),
        Sampler(judged, body_pool(body, max(8, bodies // 4), seed + 1000, plain=False), settings.plain()),
    )
