"""Training of the layout-agnostic network on layouts, bodies and motions of all kinds: what ships is made by this.

python -m markerscope.solver.neural.layout_free.pretrain --motions FOLDER... --minutes 25 --out weights.safetensors
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.neural.training.library import Clip, procedural_clips
from markerscope.solver.neural.training.train import Trained, TrainSettings, train

if TYPE_CHECKING:
    from torch import Generator, Tensor

    from markerscope.solver.neural.layout_free.agnostic import Agnostic, AgnosticSettings, Posed
    from markerscope.solver.neural.layout_free.agnostic_examples import Task
    from markerscope.solver.neural.training.train import Params

    Draw = Callable[[Generator], Task]

_EARLIER = (0.25, 0.25, 0.5)
"""How much the poses before the last count in the loss."""
_METRE, _MARKER = 6.0, 2.0
"""What a metre at a joint, and at a marker, counts against a rotation that is quite wrong."""


@dataclass(frozen=True)
class PretrainSettings:
    """How the shipped network is trained.

    Attributes
    ----------
    bodies : outside of what the shape coefficients reach
    clips : made motions
    batch : frames a step
    seed : of everything
    """

    bodies: int = 120
    clips: int = 240
    batch: int = 160
    seed: int = 0


def loss_terms(poses: Sequence[Posed], task: Task) -> dict[str, Tensor]:
    """Rotation, joint and marker errors of all poses, the last one counting most."""
    shares = (*_EARLIER[-(len(poses) - 1) :], 1.0) if len(poses) > 1 else (1.0,)
    terms: dict[str, Tensor] = {}
    for share, pose in zip(shares, poses, strict=True):
        parts = {
            "turn": 0.5 * _mean((pose.local - task.local).flatten(2), task.turn_share)
            + 0.3 * _mean((pose.turn - task.turn).flatten(2), task.place_share),
            "place": _METRE * _mean(pose.place - task.place, task.place_share),
            "marker": _MARKER * _length(pose.markers - task.markers).mean(),
        }
        for name, part in parts.items():
            terms[name] = terms[name] + share * part if name in terms else share * part
    return terms


def _mean(vector: Tensor, share: Tensor) -> Tensor:
    """Over the 22 joints of the body."""
    return (share * _length(vector))[:, :22].mean()


def _length(vector: Tensor) -> Tensor:
    """Along the last axis, with a gradient at zero."""
    return (vector.square().sum(-1) + 1e-8).sqrt()


def figures_of(posed: Posed, task: Task) -> dict[str, float]:
    """JOE in degrees and JPE in cm over the 22 joints of the body, and both as one score."""
    from markerscope.solver.neural.metrics import joe, jpe

    turn = joe(posed.local.numpy(), task.local.numpy())
    place = jpe(posed.place.numpy(), task.place.numpy())
    return {"joe_deg": turn, "jpe_cm": place, "score": turn + 4 * place}


def objective(network: Agnostic, draw: Draw) -> Callable[[Params, Generator], dict[str, Tensor]]:
    """The loss of a network's parameters on frames that ``draw`` makes from a generator."""

    def loss(params: Params, numbers: Generator) -> dict[str, Tensor]:
        task = draw(numbers)
        return loss_terms(network(params, task.frames), task)

    return loss


def judged_on(network: Agnostic, tasks: Sequence[Task]) -> Callable[[Params], dict[str, float]]:
    """The figures of a network's parameters on given frames, the mean over the tasks."""
    import torch

    def judge(params: Params) -> dict[str, float]:
        with torch.no_grad():
            rows = [figures_of(network(params, task.frames)[-1], task) for task in tasks]
        return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}

    return judge


def pretrain(
    clips: Sequence[Clip],
    training: TrainSettings,
    settings: PretrainSettings | None = None,
    sizes: AgnosticSettings | None = None,
    *,
    start: Params | None = None,
    checkpoint: Path | None = None,
    progress: Progress = silent,
) -> Trained:
    """Train on random layouts and bodies in poses of clips (the last tenth of each is only judged on) and made ones.

    Parameters
    ----------
    start : parameters to go on from, of a network of the same sizes: after a change of the body, say
    """
    from markerscope.solver.neural.layout_free.agnostic import Agnostic, AgnosticSettings
    from markerscope.solver.neural.layout_free.agnostic_examples import CLEAN, Spoiling, any_layout
    from markerscope.solver.neural.layout_free.agnostic_layouts import Skin
    from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator

    settings = settings or PretrainSettings()
    body = Body.load()
    skin, pool = Skin.of(body), body_pool(body, settings.bodies, settings.seed)
    own = ExampleSettings(mixed=0.35, shaken=0.4, shake_deg=8.0, height_mm=3.0)
    made: Sequence[Clip] = procedural_clips(settings.clips, settings.seed)
    # Every recording is a kind of its own, all made motions two: they are many, and alike.
    made = [replace(clip, kind=clip.kind.partition(" ")[0]) for clip in made]
    learnt = [replace(clip.part(0, 0.9), kind=clip.name) for clip in clips]
    sampler = Sampler((*made, *learnt), pool, own)
    held = (*procedural_clips(24, settings.seed + 1), *(clip.part(0.9, 1) for clip in clips))
    others = Sampler(held, body_pool(body, 12, settings.seed + 1, plain=False), own.plain())
    mild = Spoiling(slide=3e-3, lost=0.05, place=3e-3, joint=4e-3)
    tasks = [
        any_layout(others, skin, 256, generator(settings.seed + 1, i), mild if i % 2 else CLEAN, 0.0) for i in range(4)
    ]
    network = Agnostic(sizes or AgnosticSettings())
    loss = objective(network, lambda numbers: any_layout(sampler, skin, settings.batch, numbers))
    what = json.dumps([asdict(settings), asdict(network.settings), [clip.name for clip in clips]])
    return train(
        start or network.initial(settings.seed),
        loss,
        judged_on(network, tasks),
        training,
        checkpoint=checkpoint,
        what=what,
        progress=progress,
    )
