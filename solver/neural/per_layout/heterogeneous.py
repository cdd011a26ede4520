"""The network that solves motion from a graph of markers and joints (Pan et al. 2023, section 3.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from markerscope.solver.neural import kinematics
from markerscope.solver.neural.graph import Graph
from markerscope.solver.neural.layers import (
    EdgeConvolution,
    Params,
    dense,
    first_nodes,
    flat,
    leaky,
    new_bias,
    new_dense,
    per_node,
    relative,
    residual,
)
from markerscope.solver.neural.training.examples import generator as new_generator

if TYPE_CHECKING:
    from torch import Tensor

SCALE_M = 0.25
"""Positions are divided by this, so that features are about one."""
_OFFSET_M = 0.05
_OUT = 9  # two columns of a rotation, and an offset


@dataclass(frozen=True)
class Sizes:
    """How large the network is; the defaults are the publication's.

    Attributes
    ----------
    markers : features of marker nodes after each marker convolution; the input is 4: position and visibility
    linked : features of marker and joint nodes after each convolution between the two graphs
    wide, deep : width and number of residual blocks of the branch for the whole body
    joints : features of joint nodes after each convolution on the bones; the rotation and the offset come last
    marker_convolution : without, dense residual blocks make the features of markers (an ablation)
    """

    markers: tuple[int, ...] = (8, 16)
    linked: tuple[int, ...] = (30, 40, 30)
    wide: int = 1024
    deep: int = 3
    joints: tuple[int, ...] = (40, 20)
    marker_convolution: bool = True


COMPACT = Sizes(wide=384)
"""Half the time a step, for a training of a few minutes on a laptop."""


@dataclass(frozen=True, eq=False)
class Solution:
    """What a network says of B frames, in the frame that the markers are given in.

    Attributes
    ----------
    rotations : (B, J, 3, 3), relative to the parent, the root's in the given frame
    offsets : (B, J, 3) m from the parent's joint, in its axes; the root's is its place
    """

    rotations: Tensor
    offsets: Tensor


@dataclass(frozen=True, eq=False)
class Heterogeneous:
    """A pure function of its numbers, of local markers and of which are seen.

    Attributes
    ----------
    graph : markers and joints
    mean_markers : (M, 3) m, subtracted from the input
    mean_rotations : (J, 2, 3), the two first columns that the output adds to
    mean_offsets : (J, 3) m, likewise
    in_one_frame : whether joints say how they are turned to the markers' frame (the parents' is worked out then)
    spread : (M, K) m, how much each marker's place varies, then that of each it hears from, seen from it
    """

    graph: Graph
    mean_markers: Sequence[Sequence[float]]
    mean_rotations: Sequence[Sequence[Sequence[float]]]
    mean_offsets: Sequence[Sequence[float]]
    spread: Sequence[Sequence[float]]
    sizes: Sizes = field(default_factory=Sizes)
    in_one_frame: bool = False

    kind = "heterogeneous"

    def config(self) -> dict[str, Any]:
        """All that ``from_config`` needs, as JSON has it."""
        return {
            "graph": self.graph.plain(),
            "mean_markers": self.mean_markers,
            "mean_rotations": self.mean_rotations,
            "mean_offsets": self.mean_offsets,
            "spread": self.spread,
            "sizes": vars(self.sizes),
            "in_one_frame": self.in_one_frame,
        }

    @classmethod
    def from_config(cls, said: Mapping[str, Any]) -> Heterogeneous:
        """The network of a card."""
        sizes: dict[str, Any] = {k: tuple(v) if isinstance(v, list | tuple) else v for k, v in said["sizes"].items()}
        names = ("mean_markers", "mean_rotations", "mean_offsets", "spread")
        markers, rotations, offsets, spread = (said[name] for name in names)
        graph, one = Graph.from_plain(said["graph"]), bool(said["in_one_frame"])
        return cls(graph, markers, rotations, offsets, spread, Sizes(**sizes), one)

    @cached_property
    def _means(self) -> tuple[Tensor, Tensor, Tensor]:
        import torch

        given = (self.mean_markers, self.mean_rotations, self.mean_offsets)
        markers, rotations, offsets = (torch.tensor(x, dtype=torch.float32) for x in given)
        return markers, rotations, offsets

    @cached_property
    def _on_markers(self) -> list[EdgeConvolution]:
        sizes = (4, *self.sizes.markers)
        return [EdgeConvolution(self.graph.marker_marker, a, b) for a, b in pairwise(sizes)]

    @cached_property
    def _between(self) -> list[dict[str, EdgeConvolution]]:
        """For each layer between the graphs: what joints and markers hear from each other, and from themselves."""
        sizes, g = (self.sizes.markers[-1], *self.sizes.linked), self.graph
        own = [tuple((i,) for i in range(n)) for n in (g.markers, len(g.joints))]
        layers = []
        for k, (a, b) in enumerate(pairwise(sizes)):
            layer = {"mj": EdgeConvolution(g.joint_marker, a, b)}
            if k:  # joints have no features before the first
                layer["jj"] = EdgeConvolution(own[1], a, b)
            if k + 1 < len(self.sizes.linked):  # what markers are after the last, nobody hears
                layer["mm"] = EdgeConvolution(own[0], a, b)
                if k:
                    layer["jm"] = EdgeConvolution(g.marker_joint, a, b)
            layers.append(layer)
        return layers

    @cached_property
    def _on_joints(self) -> list[EdgeConvolution]:
        sizes = (2 * self.sizes.linked[-1], *self.sizes.joints, _OUT)
        return [EdgeConvolution(self.graph.joint_joint, a, b) for a, b in pairwise(sizes)]

    def initial(self, seed: int) -> Params:
        """Numbers to begin with."""
        random, params = new_generator(seed), Params()
        s, m, j = self.sizes, self.graph.markers, len(self.graph.joints)
        if s.marker_convolution:
            for k, layer in enumerate(self._on_markers):
                layer.new(params, f"marker{k}", random)
                new_bias(params, f"marker{k}", m, layer.outputs)
        else:
            new_dense(params, "marker", 4 * m, m * s.markers[-1], random, 2**0.5)
            for k in range(len(s.markers) - 1):
                new_dense(params, f"marker{k}", m * s.markers[-1], m * s.markers[-1], random, 0.5)
        first = s.markers[-1]
        for k, (a, b) in enumerate(zip((first, *s.linked), s.linked)):
            for name, layer in self._between[k].items():
                layer.new(params, f"linked{k}.{name}", random, 1.0)
            new_bias(params, f"linked{k}.j", j, b)
            new_bias(params, f"linked{k}.m", m, b)
            new_dense(params, f"linked{k}.to_all", m * a + (j * a + a if k else 0), b, random)
            new_dense(params, f"linked{k}.of_all", a if k else b, (m + j) * b, random, 0.3)
        new_dense(params, "wide", m * first, s.wide, random, 2**0.5)
        for k in range(s.deep):
            new_dense(params, f"wide{k}", s.wide, s.wide, random, 0.5)
        new_dense(params, "whole", s.wide, j * s.linked[-1], random)
        for k, layer in enumerate(self._on_joints):
            last = k + 1 == len(self._on_joints)
            layer.new(params, f"joint{k}", random, 0.1 if last else 2**0.5)
            new_bias(params, f"joint{k}", j, layer.outputs)
        new_dense(params, "place", s.wide + s.linked[-1], 3, random, 0.1)
        return params

    def __call__(self, params: Params, markers: Tensor, visible: Tensor) -> Solution:
        """Solve.

        Parameters
        ----------
        markers : (B, M, 3) m in the frame of the waist (the wrist, for a hand), lost ones filled
        visible : (B, M) 1 where a marker was seen, 0 where it was filled
        """
        import torch

        mean_markers, mean_rotations, mean_offsets = self._means
        features = torch.cat([markers - mean_markers, visible[..., None].to(markers.dtype)], -1)
        on_markers = self._marker_features(params, features)
        wide = dense(params, "wide", flat(on_markers)).relu()
        wide = residual(params, [f"wide{k}" for k in range(self.sizes.deep)], wide)
        local, whole = self._linked(params, on_markers)
        x = torch.cat([local, per_node(dense(params, "whole", wide), len(self.graph.joints))], -1)
        for k, layer in enumerate(self._on_joints):
            x = layer(params, f"joint{k}", x) + params[f"joint{k}.b"]
            x = x if k + 1 == len(self._on_joints) else leaky(x)
        out = first_nodes(x)  # (B, J, 9)
        rotations = kinematics.orthonormal(mean_rotations.flatten(1) + out[..., :6])
        if self.in_one_frame:
            rotations = kinematics.local_of(rotations, self.graph.parents)
        offsets = mean_offsets + _OFFSET_M * out[..., 6:]
        place = mean_offsets[0] + SCALE_M * dense(params, "place", torch.cat([wide, whole], -1))
        return Solution(rotations, torch.cat([place[:, None], offsets[:, 1:]], 1))

    def _marker_features(self, params: Params, features: Tensor) -> Tensor:
        """(M, B, C)."""
        if not self.sizes.marker_convolution:
            sized = features / features.new_tensor([SCALE_M, SCALE_M, SCALE_M, 1.0])
            x = dense(params, "marker", sized.flatten(1)).relu()
            x = residual(params, [f"marker{k}" for k in range(len(self.sizes.markers) - 1)], x)
            return per_node(x, self.graph.markers)
        x = relative(self._on_markers[0], params, "marker0", first_nodes(features), self.spread)
        x = leaky(x + params["marker0.b"])
        for k, layer in enumerate(self._on_markers[1:], start=1):
            x = leaky(layer(params, f"marker{k}", x) + params[f"marker{k}.b"])
        return x

    def _linked(self, params: Params, on_markers: Tensor) -> tuple[Tensor, Tensor]:
        """Features of joints (J, B, C) and of the whole (B, C), after the markers and joints heard each other."""
        import torch

        m, nodes = self.graph.markers, self.graph.markers + len(self.graph.joints)
        on_joints: Tensor | None = None
        whole: Tensor | None = None
        for k, layer in enumerate(self._between):
            name = f"linked{k}"
            heard = [flat(on_markers)]
            if on_joints is not None and whole is not None:
                heard += [flat(on_joints), whole]
            now = leaky(dense(params, f"{name}.to_all", torch.cat(heard, -1)))
            told = per_node(dense(params, f"{name}.of_all", now if whole is None else whole), nodes)
            j = layer["mj"](params, f"{name}.mj", on_markers) + params[f"{name}.j.b"] + told[m:]
            if on_joints is not None:
                j = j + layer["jj"](params, f"{name}.jj", on_joints)
            if "mm" in layer:
                own = layer["mm"](params, f"{name}.mm", on_markers) + params[f"{name}.m.b"] + told[:m]
                if on_joints is not None:
                    own = own + layer["jm"](params, f"{name}.jm", on_joints)
                on_markers = leaky(own)
            on_joints, whole = leaky(j), now
        if on_joints is None or whole is None:
            raise ValueError("a network needs a convolution between markers and joints")
        return on_joints, whole
