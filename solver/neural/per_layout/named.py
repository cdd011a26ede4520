"""A trained solver for one layout: the body's network and, where fingers carry markers, the hands'."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS
from markerscope.solver.neural.align import align
from markerscope.solver.neural.layers import Params
from markerscope.solver.neural.layout import Group, Layout
from markerscope.solver.neural.per_layout.build import Choice, from_config, make_task
from markerscope.solver.neural.per_layout.filling import completed
from markerscope.solver.neural.per_layout.solving import FRAME_OF, Network, members
from markerscope.solver.neural.training.examples import Sampler
from markerscope.solver.neural.training.train import Trained, TrainSettings, never, train
from markerscope.solver.neural.weights import Card, load_weights, save_weights

if TYPE_CHECKING:
    from torch import Tensor

KIND = "solver"
RATES = {"heterogeneous": 4e-3, "holden": 5e-4}
"""Of learning, where none is given: filters of single edges stand more than wide dense layers."""
_FRAMES_AT_ONCE = 2048
_HAND_SHARE = 0.1
"""Of the time of a training, for each hand; the rest is the body's."""


@dataclass(frozen=True, eq=False)
class Part:
    """One network of a solver.

    Attributes
    ----------
    group : what it solves
    joints : those of the 24 that it says, its root first
    chosen : (m,) the layout's markers that it is given
    """

    group: Group
    joints: tuple[int, ...]
    chosen: np.ndarray
    network: Network
    params: Params


@dataclass(frozen=True, eq=False)
class Solver:
    """Networks for one layout; ``rest`` (M, 3) m are its markers on the mean body at rest."""

    layout: Layout
    rest: np.ndarray
    parts: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class NeuralMotion:
    """What networks say of a recording.

    Attributes
    ----------
    rotations : (T, 24, 3, 3), root in the lab (z up), others relative to the parent
    joints : (T, 24, 3) m in the lab
    bones : (24, 3) m from each joint's parent to it at rest, the same in all frames; zero for the root
    filled : (T, M) True where a marker was not seen
    """

    rotations: np.ndarray
    joints: np.ndarray
    bones: np.ndarray
    filled: np.ndarray


def train_solver(
    body: Body,
    layout: Layout,
    samplers: tuple[Sampler, Sampler],
    choice: Choice,
    settings: TrainSettings,
    *,
    start: Solver | None = None,
    checkpoint: Path | None = None,
    progress: Progress = silent,
    enough: Callable[[], bool] = never,
) -> tuple[Solver, dict[Group, Trained]]:
    """Train what a layout needs: the body's network, and a hand's where its fingers carry markers.

    Where it is stopped, a hand that was not begun has no network, and its fingers stay straight.

    Parameters
    ----------
    samplers : what is learnt from, and what is judged on
    settings : of the whole; hands take a tenth of steps and time each
    start : a solver of the same layout that is trained further, its networks as they are; ``choice`` says the rest
    checkpoint, enough : see ``train``; the hands' networks have checkpoints of their own beside the body's
    """
    groups = groups_of(layout, split=choice.split)
    shares = {group: 1 - _HAND_SHARE * (len(groups) - 1) if group == "body" else _HAND_SHARE for group in groups}
    motions = sha256(json.dumps([clip.name for clip in samplers[0].clips]).encode()).hexdigest()[:16]
    parts: list[Part] = []
    results: dict[Group, Trained] = {}
    files: list[Path] = []
    done = 0.0
    for group in groups:
        if results and enough():
            break
        task = make_task(body, layout, group, *samplers, choice)
        before = None if start is None else next((p for p in start.parts if p.group == group), None)
        if before is not None:
            task = replace(task, network=before.network)
        own = _share_of(settings, shares[group])
        own = replace(own, rate=settings.rate or RATES[task.network.kind])
        file = None
        if checkpoint is not None:
            file = checkpoint if group == "body" else checkpoint.with_name(f"{checkpoint.stem}.{group}.checkpoint")
            files.append(file)
        found = train(
            task.network.initial(settings.seed) if before is None else before.params,
            task.loss,
            task.judge,
            own,
            checkpoint=file,
            what=f"{layout.digest} {group} {task.network.kind} {settings.seed} {motions}",
            progress=part_of(progress, done, done + shares[group]),
            enough=enough,
            keep=True,
        )
        results[group] = found
        parts.append(Part(group, task.joints, task.chosen, task.network, found.params))
        done += shares[group]
    if len(results) == len(groups) and not any(found.stopped for found in results.values()):
        for file in files:
            file.unlink(missing_ok=True)
    return Solver(layout, layout.rest(body), tuple(parts)), results


def groups_of(layout: Layout, *, split: bool = True) -> tuple[Group, ...]:
    """The networks that a layout needs: fingers without a marker are not solved."""
    sides: tuple[tuple[str, Group], ...] = (("left", "left_hand"), ("right", "right_hand"))
    hands = [
        group
        for side, group in sides
        if (layout.joint == INDEX[f"{side}_hand"]).sum() >= 2 and len(members(layout, group)) >= 3
    ]
    return ("body", *hands) if split else ("body",)


def _share_of(settings: TrainSettings, share: float) -> TrainSettings:
    return replace(
        settings,
        steps=None if settings.steps is None else max(1, round(share * settings.steps)),
        seconds=None if settings.seconds is None else share * settings.seconds,
    )


def save_solver(path: str | Path, solver: Solver, card: Card) -> Card:
    """Write a solver; the card's network, configuration and layout are filled in."""
    layout = solver.layout
    config = {
        "layout": layout.plain(),
        "rest": solver.rest.tolist(),
        "parts": [
            {"group": p.group, "joints": list(p.joints), "chosen": p.chosen.tolist(), "kind": p.network.kind,
             "network": p.network.config()}
            for p in solver.parts
        ],
    }  # fmt: skip
    params = {f"{part.group}/{name}": value for part in solver.parts for name, value in part.params.items()}
    known = vars(card) | {"network": KIND, "config": config, "layout": layout.digest, "labels": layout.labels}
    return save_weights(path, params, Card(**known))


def load_solver(path: str | Path, layout: Layout | None = None) -> tuple[Solver, Card]:
    """Read a solver.

    Parameters
    ----------
    layout : that it is to be used for; None takes the one that it was trained for

    Raises
    ------
    InputError : the file holds no solver, or one for another layout
    """
    params, card = load_weights(path, network=KIND, layout=None if layout is None else layout.digest)
    try:
        own = Layout.from_plain(card.config["layout"])
        parts = tuple(_part(row, params) for row in card.config["parts"])
        return Solver(layout or own, np.array(card.config["rest"], dtype=float), parts), card
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise InputError("is damaged: its card does not fit its weights", path, "train it again") from error


def _part(said: Mapping[str, Any], params: Params) -> Part:
    network = from_config(said["kind"], said["network"])
    prefix = f"{said['group']}/"
    own = {name.removeprefix(prefix): value for name, value in params.items() if name.startswith(prefix)}
    wanted = {name: value.shape for name, value in network.initial(0).items()}
    if wanted != {name: value.shape for name, value in own.items()}:
        raise ValueError("shapes")
    chosen = np.array(said["chosen"], dtype=np.intp)
    return Part(said["group"], tuple(int(j) for j in said["joints"]), chosen, network, own)


def solve(solver: Solver, positions: np.ndarray, rate: float, body: Body) -> NeuralMotion:
    """Solve a recording whose markers are known.

    Parameters
    ----------
    positions : (T, M', 3) m in the lab, z up, NaN = lost; the layout's columns are taken
    rate : Hz
    body : whose bones stand in where no network says any
    """
    columns = solver.layout.columns
    if positions.shape[1] <= int(columns.max()):
        what = f"{positions.shape[1]} markers are fewer than the network's layout has"
        raise InputError(what, "the recording", "train a network on this layout")
    given = positions[:, columns]
    present = np.isfinite(given).all(axis=2)
    whole = completed(given, rate, "regression", solver.layout, solver.rest)
    frames = len(whole)
    rest_joints = body.joints(np.zeros(body.shape_count))
    bones = rest_joints - rest_joints[np.maximum(PARENTS, 0)]
    rotations = np.tile(np.eye(3), (frames, len(JOINTS), 1, 1))
    root = np.zeros((frames, 3))
    for part in solver.parts:
        local, place, offsets = _said(part, solver, whole, present)
        if part.joints[0] == 0:
            rotations[:, list(part.joints)], root = local, place
            bones[list(part.joints[1:])] = offsets[1:]
        else:
            rotations[:, part.joints[1]] = local[:, 1]
            bones[part.joints[1]] = offsets[1]
    bones[0] = 0
    rest = np.zeros((len(JOINTS), 3))
    for j in range(1, len(JOINTS)):
        rest[j] = rest[PARENTS[j]] + bones[j]
    _, joints = chain(rotations, rest, root)
    return NeuralMotion(rotations, joints, bones, ~present)


def _said(
    part: Part, solver: Solver, whole: np.ndarray, present: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations (T, J, 3, 3), place of the root (T, 3) m in the lab, and offsets (J, 3) m averaged over all frames."""
    import torch

    layout = solver.layout.select(part.chosen)
    rest = torch.as_tensor(solver.rest[part.chosen], dtype=torch.float32)
    turned, placed, total = [], [], np.zeros((len(part.joints), 3))
    with torch.no_grad():
        for start in range(0, len(whole), _FRAMES_AT_ONCE):
            frames = slice(start, start + _FRAMES_AT_ONCE)
            markers = torch.as_tensor(whole[frames][:, part.chosen], dtype=torch.float32)
            seen = torch.as_tensor(present[frames][:, part.chosen], dtype=torch.float32)
            local, R, t = align(markers, layout, rest, FRAME_OF[part.group])
            said = part.network(part.params, local, seen)
            turned.append(_in_lab(said.rotations, R))
            placed.append(((R @ said.offsets[:, 0, :, None])[..., 0] + t).numpy())
            total += said.offsets.sum(0).numpy()
    return np.concatenate(turned).astype(float), np.concatenate(placed).astype(float), total / len(whole)


def _in_lab(rotations: Tensor, R: Tensor) -> np.ndarray:
    import torch

    lab: np.ndarray = torch.cat([(R @ rotations[:, 0])[:, None], rotations[:, 1:]], 1).numpy()
    return lab


def shape_of(body: Body, bones: np.ndarray, *, noise_m: float = 0.01) -> np.ndarray:
    """(S,) the shape coefficients whose bones come nearest to those a network says: where a refinement may start.

    Parameters
    ----------
    body : with as many coefficients as are wanted; each is taken to vary by about 1
    bones : (24, 3) m
    noise_m : m, how far a bone is taken to be off
    """
    above = np.maximum(PARENTS, 0)
    basis = (body.joint_dirs - body.joint_dirs[above])[1:].reshape(-1, body.shape_count)
    rest = body.joints(np.zeros(body.shape_count))
    apart = (bones - (rest - rest[above]))[1:].ravel()
    inverse = basis.T @ basis + noise_m**2 * np.eye(body.shape_count)
    return np.asarray(np.linalg.solve(inverse, basis.T @ apart))
