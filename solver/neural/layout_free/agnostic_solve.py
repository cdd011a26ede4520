"""The layout-agnostic network put to use: weights from a file or the shipped ones, poses of every frame of a take."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.resources import resource
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.neural.weights import Card, load_weights
from markerscope.solver.neural.weights import require_torch as require_torch

if TYPE_CHECKING:
    from markerscope.solver.neural.layout_free.agnostic import Agnostic
    from markerscope.solver.neural.training.train import Params

NETWORK = "agnostic"
"""The network's name on cards."""
SHIPPED = resource("neural", "agnostic.safetensors")
_AT_ONCE = 512


@dataclass(frozen=True, eq=False)
class Marked:
    """A body and where its markers are.

    Attributes
    ----------
    rest : (M, 3) m, the markers on the shaped body at rest
    weights : (M, 24) the bones that carry each, summing to 1
    joints : (24, 3) m, joints at rest
    """

    rest: np.ndarray
    weights: np.ndarray
    joints: np.ndarray


@dataclass(frozen=True, eq=False)
class Solved:
    """Poses as the network says them, lab frame; see ``Body.pose``.

    Attributes
    ----------
    rotations : (T, 24, 3, 3)
    trans : (T, 3) m
    seen : (T,) False where fewer than 3 markers are: such frames hold what the frames beside them say
    """

    rotations: np.ndarray
    trans: np.ndarray
    seen: np.ndarray


@dataclass(frozen=True, eq=False)
class Ready:
    """A network with its numbers, and their card."""

    network: Agnostic
    params: Params
    card: Card


def load(path: str | Path | None = None) -> Ready:
    """A network ready for use, and the card of its weights; None takes the shipped ones.

    Raises
    ------
    InputError : torch is not there, or the file holds no weights of such a network
    """
    from markerscope.solver.neural.layout_free.agnostic import Agnostic, AgnosticSettings

    params, card = load_weights(SHIPPED if path is None else path, network=NETWORK)
    try:
        network = Agnostic(AgnosticSettings(**card.config["sizes"]))
        wanted = {name: value.shape for name, value in network.initial(0).items()}
    except (KeyError, TypeError, ValueError, RuntimeError):
        wanted = {}
    if not wanted or wanted != {name: value.shape for name, value in params.items()}:
        raise InputError("holds the weights of another version of the network", path or SHIPPED, "train it again")
    return Ready(network, {name: value.float() for name, value in params.items()}, card)


def solve_frames(ready: Ready, markers: np.ndarray, body: Marked, progress: Progress = silent) -> Solved:
    """Poses of all frames of a take, each by itself.

    Parameters
    ----------
    markers : (T, M, 3) m in the lab, NaN = lost
    body : with these markers
    """
    import torch

    from markerscope.solver.neural.layout_free.agnostic import Frames
    from markerscope.solver.neural.layout_free.agnostic_align import align_to_rest

    count, frames = markers.shape[1], len(markers)
    rest, joints = body.rest - body.joints[0], body.joints - body.joints[0]
    rotations, root = np.empty((frames, len(JOINTS), 3, 3)), np.empty((frames, 3))
    with torch.inference_mode():
        for first in range(0, frames, _AT_ONCE):
            progress(first / frames, "the network solves")
            part = markers[first : first + _AT_ONCE]
            aligned, R, t = align_to_rest(part, rest, body.weights)

            def same(array: np.ndarray, many: int = len(part)) -> torch.Tensor:
                return torch.as_tensor(array, dtype=torch.float32).expand(many, *array.shape)

            given = Frames(
                torch.as_tensor(aligned, dtype=torch.float32),
                torch.as_tensor(np.isfinite(part).all(axis=2), dtype=torch.float32),
                same(rest),
                same(body.weights),
                same(joints),
            )
            found = ready.network(ready.params, given)[-1]
            local = found.local.numpy().astype(float)
            local[:, 0] = R @ local[:, 0]
            rotations[first : first + len(part)] = local
            root[first : first + len(part)] = np.einsum("tij,tj->ti", R, found.root.numpy()) + t
    seen = np.isfinite(markers).all(axis=2).sum(axis=1) >= min(3, count)
    return held(Solved(rotations, root - body.joints[0], seen))


def held(solved: Solved) -> Solved:
    """Frames without markers as the frames beside them have it."""
    from markerscope.solver.core.rotations import slerp

    if solved.seen.all() or not solved.seen.any():
        return solved
    frames, known = np.arange(len(solved.seen), dtype=float), np.flatnonzero(solved.seen)
    lost = np.flatnonzero(~solved.seen)
    rotations, trans = solved.rotations.copy(), solved.trans.copy()
    rotations[lost] = slerp(solved.rotations[known], frames[known], frames[lost])
    for k in range(3):
        trans[lost, k] = np.interp(frames[lost], frames[known], solved.trans[known, k])
    return Solved(rotations, trans, solved.seen)
