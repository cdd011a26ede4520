"""How each network is trained, and what is said of it then."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from types import FrameType
from typing import TYPE_CHECKING

from markerscope.solver.cleaning.gaps import FillSettings
from markerscope.solver.commands.train_site import ground_of, site_of
from markerscope.solver.core.progress import Progress, part_of
from markerscope.solver.neural.layout_free.agnostic_solve import NETWORK, load
from markerscope.solver.neural.layout_free.finetune import TUNING, figures_on, finetune
from markerscope.solver.neural.request import Network, Size, TrainRequest
from markerscope.solver.neural.training.library import motions_of
from markerscope.solver.neural.training.train import TrainSettings, train
from markerscope.solver.neural.weights import Card, require_torch, save_weights

if TYPE_CHECKING:
    import numpy as np

    from markerscope.solver.neural.layout import Layout
    from markerscope.solver.neural.per_layout.filling import FillBank
    from markerscope.solver.neural.per_layout.occlusion import Occlusion
    from markerscope.solver.neural.training.examples import Sampler

_SPANS, _JUDGED_SPANS = 200, 16
"""Recordings with gaps that the occlusion network learns from, and is judged on; few of them it learns by heart."""
_SPAN_FRAMES = 128
_FILL_RATE = 4e-3
"""Of learning; few of the output's numbers are asked in a batch, those of the markers that are lost."""
_FILLED_BY = FillSettings().method
"""What the occlusion network corrects: the default, beside which it is judged on every recording. Distances alone, from
which the published one starts, leave ten times its error."""
_HELD_OUT = "On motions that were not learnt from:"


@dataclass(frozen=True)
class Learnt:
    """What came of a training, its weights written.

    Attributes
    ----------
    card : of the weights
    lines : how good it is on what was held out
    stopped : whether Ctrl-C ended it
    before : the same figures of what it began with, where there is such a thing
    doubts : whether it is worth using
    """

    card: Card
    lines: tuple[str, ...]
    stopped: bool
    before: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()


def train_agnostic(request: TrainRequest, progress: Progress) -> Learnt:
    """The network for any layout, trained further for one."""
    ready = load(request.start)
    ground, places, labels = ground_of(request, part_of(progress, 0.0, 0.05))
    clips = motions_of(request.motions, request.made, request.seed)
    training = replace(TUNING, seconds=60 * request.minutes, steps=request.steps, seed=request.seed)
    before = _without_score(figures_on(ready, ground, clips, request.seed))
    with stopped_by_hand() as enough:
        found = finetune(
            ready,
            ground,
            clips,
            training,
            checkpoint=request.checkpoint,
            progress=part_of(progress, 0.05, 1.0),
            enough=enough,
        )
    config = {"sizes": asdict(ready.network.settings), "places": places}
    after, data = _without_score(found.figures), (*ready.card.data, *_said_data(request))
    card = save_weights(
        request.out,
        {name: value.half() for name, value in found.params.items()},
        Card(NETWORK, config, ground.digest, labels, data, after, request.seed, found.steps, found.seconds),
    )
    line = (
        f"{_HELD_OUT} joints turned wrongly by {after['joe_deg']:.1f} degrees ({before['joe_deg']:.1f} before), "
        f"misplaced by {after['jpe_cm']:.2f} cm ({before['jpe_cm']:.2f} before)."
    )
    worse = before["joe_deg"] + 4 * before["jpe_cm"] < after["joe_deg"] + 4 * after["jpe_cm"]
    doubts = ("It was better before; train longer, or use the weights it began with.",) if worse else ()
    return Learnt(card, (line,), found.stopped, before, doubts)


def train_graph(request: TrainRequest, progress: Progress) -> Learnt:
    """The published solver of one layout: the body's network, and a hand's where its fingers carry markers."""
    from markerscope.solver.neural.per_layout.build import Choice
    from markerscope.solver.neural.per_layout.heterogeneous import COMPACT
    from markerscope.solver.neural.per_layout.named import groups_of, load_solver, save_solver, train_solver

    require_torch()
    site = site_of(request, part_of(progress, 0.0, 0.05))
    start, before = (None, None) if request.start is None else load_solver(request.start, site.layout)
    clips = motions_of(request.motions, request.made, request.seed)
    with stopped_by_hand() as enough:
        solver, found = train_solver(
            site.body,
            site.layout,
            site.samplers(clips, request.seed),
            Choice() if request.size == "published" else Choice(sizes=COMPACT, batch=96),
            replace(_settings(request), average=0.99),
            start=start,
            checkpoint=request.checkpoint,
            progress=part_of(progress, 0.05, 1.0),
            enough=enough,
        )
    figures: dict[str, float] = {}
    lines = []
    for group, one in found.items():
        name = "" if group == "body" else f"{group}_"
        figures |= {f"{name}joe_deg": one.figures["joe"], f"{name}jpe_cm": one.figures["jpe"]}
        who = "joints" if group == "body" else f"the fingers of the {group.replace('_', ' ')}"
        off = f"{one.figures['joe']:.1f} degrees, misplaced by {one.figures['jpe']:.2f} cm"
        lines.append(f"{_HELD_OUT} {who} turned wrongly by {off}.")
    steps, seconds = found["body"].steps, sum(one.seconds for one in found.values())
    card = save_solver(request.out, solver, _card(request, before, figures, steps, seconds))
    stopped = len(found) < len(groups_of(site.layout)) or any(one.stopped for one in found.values())
    return Learnt(card, tuple(lines), stopped)


def train_occlusion(request: TrainRequest, progress: Progress) -> Learnt:
    """The published network that fills gaps."""
    from markerscope.solver.neural.per_layout.fill_file import load_fill_network, save_fill_network
    from markerscope.solver.neural.per_layout.filling import FillNetwork, FillTask, fill_bank

    require_torch()
    site = site_of(request, part_of(progress, 0.0, 0.05))
    layout, rest = site.layout, site.layout.rest(site.body)
    start, before = (None, None) if request.start is None else load_fill_network(request.start, layout)
    clips = motions_of(request.motions, request.made, request.seed)
    learnt, judged = site.samplers(clips, request.seed)
    method = _FILLED_BY if start is None else start.start
    banks = [
        fill_bank(sampler, layout, rest, count, request.seed + i, frames=_SPAN_FRAMES, start=method, progress=report)
        for i, (sampler, count, report) in enumerate(
            (
                (learnt, _SPANS, part_of(progress, 0.05, 0.14)),
                (judged, _JUDGED_SPANS, part_of(progress, 0.14, 0.15)),
            )
        )
    ]
    if start is None:
        network = _occlusion(request.size, learnt, layout, rest, banks[0])
    else:
        network = start.network
    task = FillTask(network, banks[0], banks[1])
    with stopped_by_hand() as enough:
        found = train(
            network.initial(request.seed) if start is None else start.params,
            task.loss,
            task.judge,
            replace(_settings(request), rate=_FILL_RATE),
            checkpoint=request.checkpoint,
            what=f"{layout.digest} {network.kind} {request.seed} {[clip.name for clip in clips]}",
            progress=part_of(progress, 0.15, 1.0),
            enough=enough,
        )
    figures = {"ompe_cm": found.figures["ompe"], "start_cm": task.start_cm}
    card = save_fill_network(
        request.out,
        FillNetwork(network, found.params, layout, rest, method),
        _card(request, before, figures, found.steps, found.seconds),
    )
    line = (
        f"{_HELD_OUT} lost markers misplaced by {10 * figures['ompe_cm']:.1f} mm; as {method} fills them, which it "
        f"corrects, by {10 * task.start_cm:.1f} mm."
    )
    worse = figures["ompe_cm"] >= task.start_cm
    doubts = ("It corrects nothing yet; train longer. Cleaning will not use it.",) if worse else ()
    return Learnt(card, (line,), found.stopped, {"ompe_cm": task.start_cm}, doubts)


def _occlusion(size: Size, sampler: Sampler, layout: Layout, rest: np.ndarray, bank: FillBank) -> Occlusion:
    """The network as published; or a smaller one, in which markers need not all go through the recurrent layer."""
    from markerscope.solver.neural.metrics import ompe
    from markerscope.solver.neural.per_layout.filling import new_occlusion
    from markerscope.solver.neural.per_layout.occlusion import COMPACT_HIDDEN, HIDDEN

    compact = size == "compact"
    network = new_occlusion(sampler, layout, rest, hidden=COMPACT_HIDDEN if compact else HIDDEN["body"])
    off = ompe(bank.local.numpy(), bank.truth.numpy(), bank.visible.numpy() == 0) / 100
    return replace(network, beside=compact, correction_m=max(off, 1e-3))


TRAININGS: Mapping[Network, Callable[[TrainRequest, Progress], Learnt]] = {
    "agnostic": train_agnostic,
    "graph": train_graph,
    "occlusion": train_occlusion,
}


@contextmanager
def stopped_by_hand() -> Iterator[Callable[[], bool]]:
    """Ask whether Ctrl-C was pressed; a second time it does what it always does."""
    pressed = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    before = signal.getsignal(signal.SIGINT)

    def noted(number: int, frame: FrameType | None) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, noted)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)


def _settings(request: TrainRequest) -> TrainSettings:
    return TrainSettings(seconds=60 * request.minutes, steps=request.steps, seed=request.seed)


def _card(request: TrainRequest, before: Card | None, figures: Mapping[str, float], steps: int, seconds: float) -> Card:
    """A card that has yet to be told of network and layout; what was learnt before counts too."""
    earlier = () if before is None else before.data
    data = tuple(dict.fromkeys((*earlier, *_said_data(request))))
    return Card("", {}, "", (), data, figures, request.seed, steps, seconds)


def _said_data(request: TrainRequest) -> tuple[str, ...]:
    """What it learnt from here, a line each."""
    made = (f"{request.made} made motions of Markerscope (Apache-2.0)",) if request.made else ()
    return (*made, *(f"the user's own folder {folder.name}" for folder in request.motions))


def _without_score(figures: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in figures.items() if name != "score"}
