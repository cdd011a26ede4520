"""What ``markerscope train`` does: the shipped network trained further for one layout, with a card."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from types import FrameType
from typing import Any

from solver.body.model import Body
from solver.errors import InputError
from solver.neural.agnostic_solve import NETWORK, load
from solver.neural.finetune import TUNING, Ground, figures_on, finetune
from solver.neural.library import Clip, load_library, procedural_clips
from solver.neural.places import places_of
from solver.neural.request import TrainRequest
from solver.neural.weights import Card, save_weights
from solver.pipeline.request import Outcome
from solver.progress import Progress, part_of, silent


def train_network(request: TrainRequest, progress: Progress = silent) -> Outcome:
    """Train, write the weights, and say how good they are on motions and bodies that were not learnt from.

    Ctrl-C ends the training, not the command: the best so far is written.

    Raises
    ------
    InputError : something cannot be read or written, or an earlier training would be lost
    """
    from solver.pipeline.output import check_output_folder

    check_output_folder(request.out.parent)
    if request.checkpoint.exists() and not request.resume:
        raise InputError(
            "a training that was stopped lies there", request.checkpoint, "add --resume to go on, or remove it"
        )
    if request.resume and not request.checkpoint.exists():
        raise InputError("there is no training to go on with", request.checkpoint, "leave --resume out")
    ready = load(request.start)
    ground, places, labels = _ground(request, part_of(progress, 0.0, 0.05))
    clips = motions_of(request.motions, request.made, request.seed)
    training = replace(TUNING, seconds=60 * request.minutes, steps=request.steps, seed=request.seed)
    before = figures_on(ready, ground, clips, request.seed)
    with _stopped_by_hand() as enough:
        found = finetune(
            ready,
            ground,
            clips,
            training,
            checkpoint=request.checkpoint,
            progress=part_of(progress, 0.05, 1.0),
            enough=enough,
        )
    data = (*ready.card.data, *_said_data(request))
    config = {"sizes": asdict(ready.network.settings), "places": places}
    figures = {name: value for name, value in found.figures.items() if name != "score"}
    card = save_weights(
        request.out,
        {name: value.half() for name, value in found.params.items()},
        Card(NETWORK, config, ground.digest, labels, data, figures, request.seed, found.steps, found.seconds),
    )
    return _outcome(request, card, before, found.stopped)


def motions_of(folders: Sequence[Path], made: int, seed: int) -> tuple[Clip, ...]:
    """Recorded motions, each of a kind of its own, and made ones, of two kinds: they are many, and alike."""
    recorded = load_library(folders) if folders else ()
    return (
        *(replace(clip, kind=clip.kind.partition(" ")[0]) for clip in procedural_clips(made, seed)),
        *(replace(clip, kind=clip.name) for clip in recorded),
    )


def _ground(request: TrainRequest, progress: Progress) -> tuple[Ground, dict[str, Any], tuple[str, ...]]:
    """What is trained for, where its markers sit, and what they are called."""
    if request.layout is not None:
        from solver.neural.layout import named_layout

        body = Body.load()
        layout = named_layout(body, request.layout)  # type: ignore[arg-type]
        return Ground(body, layout=layout), places_of(body, layout.vertex), layout.labels
    assert request.session is not None
    return _of_session(request.session, progress)


def _of_session(path: Path, progress: Progress) -> tuple[Ground, dict[str, Any], tuple[str, ...]]:
    """The body and the markers of a session as its fit goes on with them; what is not cached is computed."""
    from solver.body.bones import with_bone_lengths
    from solver.neural.agnostic_fit import marked
    from solver.pipeline.methods import graph_of
    from solver.pipeline.run import run_stages
    from solver.pipeline.session import load_session
    from solver.solve.method import chosen_row

    if not path.exists():
        raise InputError("there is no such session", path, "check the name and the folder")
    session = load_session(path)
    run = run_stages(session, ("orient",), progress)
    fit = session.stage_settings(graph_of(session))["fit"]
    candidate = run["orient"].candidates[chosen_row(run["orient"], fit)]
    file = session.inputs.get("body_file")
    body = Body.load(None if file is None else file.path)
    used = run["markers"].labels
    labels = tuple(used[int(i)] for i in run["localize"].markers)
    person = marked(with_bone_lengths(body), candidate)
    return Ground(body, person=person), places_of(body, candidate.vertex), labels


def _said_data(request: TrainRequest) -> tuple[str, ...]:
    """What it learnt from here, a line each."""
    made = (f"{request.made} made motions of Markerscope (Apache-2.0)",) if request.made else ()
    return (*made, *(f"the user's own folder {folder.name}" for folder in request.motions))


@contextmanager
def _stopped_by_hand() -> Iterator[Callable[[], bool]]:
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


def _outcome(request: TrainRequest, card: Card, before: dict[str, float], stopped: bool) -> Outcome:
    after = card.figures
    lines = (
        f"{card.steps} steps in {card.seconds / 60:.1f} min on {len(card.labels)} markers.",
        f"On motions that were not learnt from: joints turned wrongly by {after['joe_deg']:.1f} degrees "
        f"({before['joe_deg']:.1f} before), misplaced by {after['jpe_cm']:.2f} cm ({before['jpe_cm']:.2f} before).",
        f"The weights are in {request.out}.",
    )
    doubts: tuple[str, ...] = ()
    if stopped:
        doubts = (f"It was stopped; {request.checkpoint} is where --resume goes on.",)
    elif before["joe_deg"] + 4 * before["jpe_cm"] < after["joe_deg"] + 4 * after["jpe_cm"]:
        doubts = ("It was better before; train longer, or use the weights it began with.",)
    summary = {
        "out": str(request.out),
        "figures": dict(after),
        "before": {name: value for name, value in before.items() if name != "score"},
        "steps": card.steps,
        "seconds": card.seconds,
        "layout": card.layout,
        "markers": len(card.labels),
        "stopped": stopped,
    }
    return Outcome(summary=summary, lines=lines, warnings=doubts)
