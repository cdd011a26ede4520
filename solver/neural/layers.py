"""Layers as functions of named numbers: dense ones, and convolutions with a filter for every edge of a graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.neural.graph import Links

if TYPE_CHECKING:
    from torch import Generator, Tensor

Params = dict[str, "Tensor"]


def new_dense(params: Params, name: str, inputs: int, outputs: int, generator: Generator, gain: float = 1.0) -> None:
    """Add the numbers of a dense layer: normal of variance ``gain^2 / inputs``, biases zero."""
    import torch

    params[f"{name}.w"] = torch.randn(inputs, outputs, generator=generator) * (gain / inputs**0.5)
    params[f"{name}.b"] = torch.zeros(outputs)


def dense(params: Params, name: str, x: Tensor) -> Tensor:
    """(..., inputs) to (..., outputs)."""
    import torch

    return torch.addmm(params[f"{name}.b"], x.flatten(0, -2), params[f"{name}.w"]).unflatten(0, x.shape[:-1])


def leaky(x: Tensor) -> Tensor:
    """What follows every convolution."""
    import torch

    return torch.nn.functional.leaky_relu(x, 0.2)


@dataclass(frozen=True)
class EdgeConvolution:
    """f'_i = sum over j heard from of W_ij f_j (Pan et al. 2023, equation 4, without the bias, which is the node's).

    Features are (nodes, B, C): the nodes come first, so that each has its own filters in one batched product.

    Attributes
    ----------
    links : for each receiving node, those that it hears from
    inputs, outputs : C of either side
    """

    links: Links
    inputs: int
    outputs: int

    @property
    def _degree(self) -> int:
        return max(1, max(len(row) for row in self.links))

    @cached_property
    def _slots(self) -> tuple[Tensor, Tensor]:
        """(nodes * degree,) who is heard in each slot, and (nodes, degree * inputs, 1) 0 where a slot is empty."""
        import torch

        index = np.zeros((len(self.links), self._degree), dtype=np.int64)
        there = np.zeros(index.shape, dtype=np.float32)
        for i, row in enumerate(self.links):
            index[i, : len(row)], there[i, : len(row)] = row, 1
        mask = np.repeat(there, self.inputs, axis=1)[..., None]
        return torch.as_tensor(index.ravel()), torch.as_tensor(mask)

    def new(self, params: Params, name: str, generator: Generator, gain: float = 2**0.5) -> None:
        """Add its filters."""
        import torch

        degree = np.array([max(1, len(row)) for row in self.links], dtype=np.float32)
        scale = torch.as_tensor(gain / np.sqrt(degree * self.inputs))[:, None, None]
        shape = (len(self.links), self._degree * self.inputs, self.outputs)
        params[f"{name}.w"] = torch.randn(shape, generator=generator) * scale * self._slots[1]

    def __call__(self, params: Params, name: str, x: Tensor) -> Tensor:
        """(N, B, inputs) to (receiving nodes, B, outputs)."""
        return self.filtered(params, name, self.heard(x))

    def heard(self, x: Tensor) -> Tensor:
        """(receiving nodes, degree, B, inputs), what comes in over each edge."""
        return x[self._slots[0]].unflatten(0, (len(self.links), self._degree))

    def filtered(self, params: Params, name: str, heard: Tensor) -> Tensor:
        """(receiving nodes, B, outputs)."""
        return heard.transpose(1, 2).flatten(2) @ (params[f"{name}.w"] * self._slots[1])


def relative(layer: EdgeConvolution, params: Params, name: str, x: Tensor, spread: Sequence[Sequence[float]]) -> Tensor:
    """A convolution on places, with neighbours as seen from the marker and every edge's input of size one.

    A sum over neighbours of filtered places is the same sum of filtered differences with another filter for the marker
    itself, so this is equation (4) as it stands. But millimetres between the markers of a wrist tell how it is turned,
    and half a metre does not where they are: with filters on places that is learnt slowly.

    Parameters
    ----------
    layer : each marker hears itself first
    x : (M, B, 4), place (m) and whether it was seen
    spread : (M, K) m, how much the marker's place varies, and then what it hears, seen from it
    """
    import torch

    heard = layer.heard(x)  # (M, K, B, 4)
    places = heard[..., :3]
    apart = torch.cat([places[:, :1], places[:, 1:] - places[:, :1]], 1)
    sized = apart / torch.tensor(spread, dtype=x.dtype)[:, :, None, None]
    return layer.filtered(params, name, torch.cat([sized, heard[..., 3:]], -1))


def spread_of(local: Tensor, links: Links) -> list[list[float]]:
    """(M, K) m, as ``relative`` takes it, of markers (B, M, 3) m: root mean squares along an axis, at least 5 mm."""
    rows = []
    for m, row in enumerate(links):
        apart = [local[:, m], *(local[:, k] - local[:, m] for k in row[1:])]
        rows.append([round(float(p.std(0).square().mean().sqrt().clamp_min(0.005)), 4) for p in apart])
    return rows


def new_bias(params: Params, name: str, nodes: int, outputs: int) -> None:
    """Add a bias for each node."""
    import torch

    params[f"{name}.b"] = torch.zeros(nodes, 1, outputs)


def first_nodes(x: Tensor) -> Tensor:
    """(B, N, C) to (N, B, C), or back."""
    return x.transpose(0, 1)


def flat(x: Tensor) -> Tensor:
    """(N, B, C) to (B, N * C): what a dense layer over all nodes takes."""
    return x.transpose(0, 1).flatten(1)


def per_node(x: Tensor, nodes: int) -> Tensor:
    """(B, N * C) to (N, B, C)."""
    return x.unflatten(1, (nodes, -1)).transpose(0, 1)


def residual(params: Params, names: Sequence[str], x: Tensor) -> Tensor:
    """One residual block after another, x + relu(dense(x))."""
    for name in names:
        x = x + dense(params, name, x).relu()
    return x
