"""The network that corrects filled markers from their neighbours and from what was before and after (Pan, 3.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.neural.layers import EdgeConvolution, Params, dense, leaky, new_bias, new_dense, relative
from markerscope.solver.neural.training.examples import generator as new_generator

if TYPE_CHECKING:
    from torch import Tensor

WINDOW, OVERLAP = 64, 32
"""Frames the network sees at a time, and how many two such windows share, in which what they say is averaged."""
HIDDEN: Mapping[str, int] = {"body": 800, "left_hand": 400, "right_hand": 400}
"""Units of the recurrent layer, each way, as published."""
COMPACT_HIDDEN = 128


@dataclass(frozen=True, eq=False)
class Occlusion:
    """A pure function of its numbers, of windows of filled local markers and of which were seen.

    Attributes
    ----------
    links : for each marker, itself and the neighbours that it hears from (``graph.nearest`` with ``graph.FILLING``)
    mean_markers : (M, 3) m, subtracted from the input
    spread : (M, K) m, how much each marker's place varies, then that of each it hears from, seen from it
    features : of marker nodes after each convolution; the input is 4
    hidden : units of the recurrent layer each way
    filled_first : without, lost markers come in at their mean place, not where distances put them (an ablation)
    beside : whether each marker's features after the convolutions speak for it beside the recurrent layer; without, as
        published, all markers are squeezed through that layer, which takes many units and a long training
    correction_m : m, what one at the output means: about as far as what is filled is off
    """

    links: tuple[tuple[int, ...], ...]
    mean_markers: Sequence[Sequence[float]]
    spread: Sequence[Sequence[float]]
    features: tuple[int, ...] = (6, 10, 16)
    hidden: int = 800
    filled_first: bool = True
    beside: bool = False
    correction_m: float = 0.03

    kind = "occlusion"

    def config(self) -> dict[str, Any]:
        """All that ``from_config`` needs, as JSON has it."""
        return {own.name: getattr(self, own.name) for own in fields(self)}

    @classmethod
    def from_config(cls, said: Mapping[str, Any]) -> Occlusion:
        """The network of a card."""
        links = tuple(tuple(int(i) for i in row) for row in said["links"])
        features = tuple(int(f) for f in said["features"])
        rest = {name: said[name] for name in ("filled_first", "beside", "correction_m") if name in said}
        return cls(links, said["mean_markers"], said["spread"], features, int(said["hidden"]), **rest)

    @cached_property
    def _layers(self) -> list[EdgeConvolution]:
        return [EdgeConvolution(self.links, a, b) for a, b in pairwise((4, *self.features))]

    @cached_property
    def _mean(self) -> Tensor:
        import torch

        return torch.tensor(self.mean_markers, dtype=torch.float32)

    def initial(self, seed: int) -> Params:
        """Numbers to begin with; the correction begins at zero."""
        import torch

        random, params = new_generator(seed), Params()
        markers = len(self.links)
        for k, layer in enumerate(self._layers):
            layer.new(params, f"marker{k}", random)
            new_bias(params, f"marker{k}", markers, layer.outputs)
        width = markers * self.features[-1]
        bound = self.hidden**-0.5
        for way in ("forth", "back"):
            for name, shape in (
                ("ih", (4 * self.hidden, width)),
                ("hh", (4 * self.hidden, self.hidden)),
                ("bih", (4 * self.hidden,)),
                ("bhh", (4 * self.hidden,)),
            ):
                params[f"lstm.{way}.{name}"] = bound * (2 * torch.rand(shape, generator=random) - 1)
        new_dense(params, "out", 2 * self.hidden, 3 * markers, random, 0.0)
        if self.beside:
            params["beside.w"] = torch.zeros(markers, self.features[-1], 3)
        return params

    def __call__(self, params: Params, markers: Tensor, visible: Tensor) -> Tensor:
        """Correct.

        Parameters
        ----------
        markers : (N, W, M, 3) m in the frame of the waist, lost ones filled
        visible : (N, W, M) 1 where a marker was seen, 0 where it was filled

        Returns
        -------
        (N, W, M, 3) m : where the lost ones are; seen ones as they came
        """
        import torch

        count, window = markers.shape[:2]

        def per_window(features: Tensor) -> Tensor:
            """(M, N W, C) to (N, W, M, C)."""
            return features.transpose(0, 1).unflatten(0, (count, window))

        seen = visible[..., None].to(markers.dtype)
        given = markers if self.filled_first else seen * markers + (1 - seen) * self._mean
        x = torch.cat([given - self._mean, seen], -1).flatten(0, 1).transpose(0, 1)  # (M, N W, 4)
        x = leaky(relative(self._layers[0], params, "marker0", x, self.spread) + params["marker0.b"])
        for k, layer in enumerate(self._layers[1:], start=1):
            x = leaky(layer(params, f"marker{k}", x) + params[f"marker{k}.b"])
        own = per_window(x @ params["beside.w"]) if self.beside else 0.0
        x = per_window(x).flatten(2)
        zero = x.new_zeros(2, count, self.hidden)
        weights = [params[f"lstm.{way}.{name}"] for way in ("forth", "back") for name in ("ih", "hh", "bih", "bhh")]
        x, _, _ = torch.lstm(x, (zero, zero), weights, True, 1, 0.0, False, True, True)
        off = dense(params, "out", x).unflatten(2, (len(self.links), 3)) + own
        return given + (1 - seen) * self.correction_m * off


def windows(frames: int) -> np.ndarray:
    """First frames of the windows that cover a recording, each ``OVERLAP`` after the one before; the last ends with it.

    A recording shorter than a window has one, which the caller lengthens.
    """
    if frames <= WINDOW:
        return np.zeros(1, dtype=np.intp)
    starts = np.arange(0, frames - WINDOW + 1, WINDOW - OVERLAP)
    if starts[-1] + WINDOW < frames:
        starts = np.append(starts, frames - WINDOW)
    return starts


def corrected(network: Occlusion, params: Params, local: np.ndarray, visible: np.ndarray) -> np.ndarray:
    """(T, M, 3) m, a whole recording corrected: windows that overlap are averaged.

    Parameters
    ----------
    local : (T, M, 3) m in the frame of the waist, lost ones filled
    visible : (T, M) True where a marker was seen
    """
    import torch

    frames = len(local)
    if frames < WINDOW:  # held at the end
        short = WINDOW - frames
        local = np.concatenate([local, np.repeat(local[-1:], short, axis=0)])
        visible = np.concatenate([visible, np.repeat(visible[-1:], short, axis=0)])
    starts = windows(len(local))
    index = starts[:, None] + np.arange(WINDOW)
    total, count = np.zeros(local.shape), np.zeros(len(local))
    with torch.no_grad():
        for some in np.array_split(index, max(1, len(index) // 16)):
            given = torch.as_tensor(local[some], dtype=torch.float32)
            seen = torch.as_tensor(visible[some], dtype=torch.float32)
            said = network(params, given, seen).numpy()
            for frame, values in zip(some, said):
                total[frame] += values
                count[frame] += 1
    mean = total / count[:, None, None]
    return np.where(visible[..., None], local, mean)[:frames]
