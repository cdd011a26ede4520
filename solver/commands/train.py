"""What ``markerscope train`` does: a network trained for one layout, its weights in a file with a card."""

from __future__ import annotations

from markerscope.solver.commands.trainings import TRAININGS, Learnt
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.neural.request import TrainRequest
from markerscope.solver.neural.training.library import motions_of as motions_of

_WHAT = {
    "agnostic": "The network for any layout",
    "graph": "The solver of one layout",
    "occlusion": "The network that fills gaps",
}


def train_network(request: TrainRequest, progress: Progress = silent) -> Outcome:
    """Train, write the weights, and say how good they are on motions and bodies that were not learnt from.

    Ctrl-C ends the training, not the command: the best so far is written.

    Raises
    ------
    InputError : something cannot be read or written, or an earlier training would be lost
    """
    from markerscope.solver.io.output_folder import check_output_folder

    check_output_folder(request.out.parent)
    if request.checkpoint.exists() and not request.resume:
        raise InputError(
            "a training that was stopped lies there", request.checkpoint, "add --resume to go on, or remove it"
        )
    if request.resume and not request.checkpoint.exists():
        raise InputError("there is no training to go on with", request.checkpoint, "leave --resume out")
    return _outcome(request, TRAININGS[request.network](request, progress))


def _outcome(request: TrainRequest, learnt: Learnt) -> Outcome:
    card = learnt.card
    whose = f"the layout {request.layout}" if request.session is None else f"the markers and body of {request.session}"
    lines = (
        f"{_WHAT[request.network]}, for {whose}: {card.steps} steps in {card.seconds / 60:.1f} min on "
        f"{len(card.labels)} markers.",
        *learnt.lines,
        f"The weights are in {request.out}.",
    )
    doubts = learnt.doubts
    if learnt.stopped:
        doubts = (f"It was stopped; {request.checkpoint} is where --resume goes on.",)
    summary = {
        "out": str(request.out),
        "network": request.network,
        "figures": dict(card.figures),
        "before": dict(learnt.before),
        "steps": card.steps,
        "seconds": card.seconds,
        "layout": card.layout,
        "markers": len(card.labels),
        "stopped": learnt.stopped,
    }
    return Outcome(summary=summary, lines=lines, warnings=doubts)
