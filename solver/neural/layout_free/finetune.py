"""The layout-agnostic network trained a little further on one layout: that of a session, or one with a name."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.neural.layout import Layout
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Ready
from markerscope.solver.neural.training.library import Clip, procedural_clips
from markerscope.solver.neural.training.train import Trained, TrainSettings, never, train

if TYPE_CHECKING:
    from torch import Generator

    from markerscope.solver.neural.layout_free.agnostic_examples import Spoiling, Task
    from markerscope.solver.neural.training.examples import ExampleSettings

TUNING = TrainSettings(seconds=60.0, rate=5e-4, warm=30, average=0.98, check=100, patience=None)
"""A minute, after which little is gained."""
_CLIPS = 60


@dataclass(frozen=True, eq=False)
class Ground:
    """What a network is tuned to: a layout on anybody, or the markers of one person.

    Attributes
    ----------
    body : the one whose vertices are meant, without bone lengths among its coefficients
    layout : of the markers, on anybody
    person : of the one that was fitted, instead
    """

    body: Body
    layout: Layout | None = None
    person: Marked | None = None

    @property
    def digest(self) -> str:
        """Equal for equal grounds."""
        if self.person is not None:
            return sha256(np.round(1000 * self.person.rest).astype("<i8").tobytes()).hexdigest()[:16]
        assert self.layout is not None
        return self.layout.digest


def finetune(
    ready: Ready,
    ground: Ground,
    clips: Sequence[Clip],
    training: TrainSettings = TUNING,
    *,
    bodies: int = 24,
    batch: int = 160,
    checkpoint: Path | None = None,
    progress: Progress = silent,
    enough: Callable[[], bool] = never,
) -> Trained:
    """Train on one layout from the numbers of a network on, which are not changed.

    Parameters
    ----------
    clips : to learn from; the last tenth of each is only judged on
    bodies : outside of what the shape coefficients reach, where it is for anybody
    batch : frames a step
    """
    from markerscope.solver.neural.layout_free.agnostic_examples import Spoiling
    from markerscope.solver.neural.layout_free.pretrain import judged_on, objective
    from markerscope.solver.neural.training.examples import ExampleSettings

    own = ExampleSettings(mixed=0.35, shaken=0.4, shake_deg=8.0)
    learn = _drawer(ground, [clip.part(0, 0.9) for clip in clips], own, bodies, training.seed)
    tasks = _held_out(ground, clips, training.seed)
    what = json.dumps([asdict(ready.network.settings), ground.digest, [clip.name for clip in clips], training.seed])
    return train(
        ready.params,
        objective(ready.network, lambda numbers: learn(batch, numbers, Spoiling())),
        judged_on(ready.network, tasks),
        training,
        checkpoint=checkpoint,
        what=what,
        progress=progress,
        enough=enough,
    )


def figures_on(ready: Ready, ground: Ground, clips: Sequence[Clip], seed: int) -> dict[str, float]:
    """JOE in degrees and JPE in cm of a network on what ``finetune`` holds out."""
    from markerscope.solver.neural.layout_free.pretrain import judged_on

    return judged_on(ready.network, _held_out(ground, clips, seed))(ready.params)


def _held_out(ground: Ground, clips: Sequence[Clip], seed: int) -> list[Task]:
    """The last tenth of each clip on other bodies, once clean and once a little spoilt."""
    from markerscope.solver.neural.layout_free.agnostic_examples import CLEAN, Spoiling
    from markerscope.solver.neural.training.examples import ExampleSettings, generator

    examine = _drawer(ground, [clip.part(0.9, 1) for clip in clips], ExampleSettings().plain(), 6, seed + 1)
    mild = Spoiling(slide=3e-3, lost=0.05, place=3e-3, joint=4e-3)
    return [examine(256, generator(seed + 1, i), spoiling) for i, spoiling in enumerate((CLEAN, mild))]


def _drawer(
    ground: Ground, clips: Sequence[Clip], settings: ExampleSettings, bodies: int, seed: int
) -> Callable[[int, Generator, Spoiling], Task]:
    """Draws so many frames with a generator, spoilt so much."""
    from markerscope.solver.neural.layout_free.agnostic_examples import one_layout, one_person
    from markerscope.solver.neural.training.examples import Sampler, body_pool

    person, layout = ground.person, ground.layout
    if person is not None:
        poses = Sampler(clips, body_pool(ground.body, 0, seed), settings)
        return lambda count, numbers, spoiling: one_person(poses, person, count, numbers, spoiling)
    assert layout is not None
    sampler = Sampler(clips, body_pool(ground.body, bodies, seed), settings)
    return lambda count, numbers, spoiling: one_layout(sampler, layout, count, numbers, spoiling)


def tuned(ready: Ready, ground: Ground, steps: int, progress: Progress = silent) -> Ready:
    """The network after some steps of training on made motions."""
    training = replace(TUNING, seconds=None, steps=steps)
    found = finetune(ready, ground, procedural_clips(_CLIPS, 0), training, progress=progress)
    return replace(ready, params=found.params)
